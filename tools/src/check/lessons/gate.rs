//! Lesson 9: I3 opens the gate; after two seconds it closes. The light barrier I4 opens it again, and the stop button
//! I5 stops it at any time.

use std::time::Duration;

use ft_transfer_area::tx::Input::{I3, I4, I5};
use ft_transfer_area::tx::Motor::M1;
use ft_transfer_area_simulator::world::Sensor;

use super::A_WHILE;
use crate::check::moment::{Lasted, Moment};
use crate::check::stage::Stage;
use crate::check::words::{german, Check, Wrong};

/// Where the end switches are pressed, in pulses.
const CLOSED: f64 = 3.0;
const OPEN: f64 = 297.0;
/// The gate needs about two and a half seconds.
const TRAVEL: Duration = Duration::from_secs(8);
/// How long it is open.
const PAUSE: f64 = 2.0;
const TOLERANCE: f64 = 0.7;
/// In the middle of the way.
const MIDDLE: f64 = 150.0;
/// How often the stop button is tried.
const TRIES: usize = 3;

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("nobody is there: the gate does not move", "niemand ist da: das Tor steht");
    stage.stays(
        A_WHILE,
        |now| now.motor(M1) == 0,
        |_| {
            Wrong::new(
                "The gate moves although nobody has pressed I3.",
                "Das Tor fährt, obwohl niemand I3 gedrückt hat.",
            )
            .hint(
                "begin with the state in which the gate is closed and M1 is off.",
                "Beginne mit dem Zustand, in dem das Tor zu ist und M1 steht.",
            )
        },
    )?;
    stage.step("I3 opens the gate, up to I2", "I3 öffnet das Tor, bis I2");
    open(stage)?;
    let opened = stage.soon(|now| now.motor(M1) == 0, |_| pushes("I2"))?;
    stage.step("after two seconds it closes, up to I1", "nach zwei Sekunden schließt es, bis I1");
    let closing = stage.within(TRAVEL, closes, |_| never_closes())?;
    pause(closing.since(&opened))?;
    stage.within(TRAVEL, |now| now.way(M1) <= CLOSED, |_| not_there("I1"))?;
    stage.soon(|now| now.motor(M1) == 0, |_| pushes("I1"))?;

    stage.step(
        "something is in the light barrier I4 while it closes: it opens again",
        "beim Schließen ist etwas in der Lichtschranke I4: es öffnet wieder",
    );
    start_closing(stage)?;
    stage.plug(I4, Sensor::PhotoTransistor { light: 0.0 });
    stage.soon(|now| now.motor(M1) > 0, |_| barrier_ignored())?;
    stage.plug(I4, Sensor::PhotoTransistor { light: 1.0 });
    stage.within(TRAVEL, |now| now.way(M1) >= OPEN, |_| not_there("I2"))?;

    stage.step(
        "the stop button I5 stops it while it closes",
        "der Stopptaster I5 hält es beim Schließen an",
    );
    stage.within(TRAVEL, closes, |_| never_closes())?;
    stage.within(TRAVEL, |now| now.way(M1) < MIDDLE, |_| not_there("I1"))?;
    for _ in 0..TRIES {
        if stop(stage)? {
            break;
        }
        start_closing(stage)?;
    }
    stage.step(
        "I3 opens it again, and I5 stops it while it opens",
        "I3 öffnet es wieder, und I5 hält es beim Öffnen an",
    );
    for _ in 0..TRIES {
        stage.tap(I3)?;
        stage.soon(|now| now.motor(M1) > 0, |_| does_not_open())?;
        if stop(stage)? {
            break;
        }
        stage.within(TRAVEL, closes, |_| never_closes())?;
        stage.within(TRAVEL, |now| now.way(M1) <= CLOSED, |_| not_there("I1"))?;
    }
    Ok(())
}

fn closes(now: &Moment) -> bool {
    now.motor(M1) < 0
}

/// Presses I3 and follows the gate until it is open.
fn open(stage: &mut Stage) -> Check {
    stage.tap(I3)?;
    stage.soon(|now| now.motor(M1) > 0, |_| does_not_open())?;
    stage.within(TRAVEL, |now| now.way(M1) >= OPEN, |_| not_there("I2"))?;
    Ok(())
}

/// Opens the gate and waits until it has closed by half.
fn start_closing(stage: &mut Stage) -> Check {
    open(stage)?;
    stage.within(TRAVEL, closes, |_| never_closes())?;
    stage.within(TRAVEL, |now| now.way(M1) < MIDDLE, |_| not_there("I1"))?;
    Ok(())
}

/// Presses the stop button for a moment: the gate stops, and stays where it is. Returns whether that was seen: on a busy
/// computer the gate may be at its end before the button is pressed.
fn stop(stage: &mut Stage) -> Check<bool> {
    let is_at_end = |now: &Moment| now.way(M1) <= CLOSED || now.way(M1) >= OPEN;
    stage.tap(I5)?;
    if is_at_end(&stage.soon(|_| true, |_| keeps_moving())?) {
        return Ok(false);
    }
    let stopped = stage.soon(|now| now.motor(M1) == 0, |_| keeps_moving())?;
    // Its end switch has stopped it.
    if is_at_end(&stopped) {
        return Err(keeps_moving());
    }
    stage.stays(
        4 * A_WHILE,
        |now| now.motor(M1) == 0,
        |_| {
            Wrong::new(
                "I5 stopped the gate, but it moved again when I5 was released.",
                "I5 hielt das Tor an, aber nach dem Loslassen fuhr es weiter.",
            )
            .hint(
                "a stop is a state of its own. Only I3 leads out of it.",
                "Der Stopp ist ein eigener Zustand. Nur I3 führt wieder heraus.",
            )
        },
    )?;
    Ok(true)
}

fn keeps_moving() -> Wrong {
    Wrong::new(
        "I5 was pressed, but the gate keeps moving.",
        "I5 wurde gedrückt, aber das Tor fährt weiter.",
    )
    .hint(
        "check I5 before anything else, in each round and in each state. A program that sleeps or waits for something \
         else does not see it.",
        "Frage I5 vor allem anderen ab, in jeder Runde und in jedem Zustand. Wer schläft oder auf etwas anderes wartet, \
         sieht den Taster nicht.",
    )
}

fn does_not_open() -> Wrong {
    Wrong::new(
        "I3 was pressed for a moment, but the gate does not open.",
        "I3 wurde kurz gedrückt, aber das Tor öffnet nicht.",
    )
    .hint(
        "M1 clockwise opens. The stop button I5 is normally closed: it reports true while nobody presses it.",
        "M1 nach rechts öffnet. Der Stopptaster I5 ist ein Öffner: Er meldet true, solange ihn niemand drückt.",
    )
}

fn not_there(switch: &str) -> Wrong {
    Wrong::new(
        format!("The gate does not reach {switch}."),
        format!("Das Tor kommt nicht bis {switch}."),
    )
    .hint(
        "I3 only starts it. After that, it goes on by itself until its switch: I2 for open, I1 for closed. Nothing is in \
         its way: I4 reports true then.",
        "I3 gibt nur den Anstoß. Danach fährt es von selbst bis zu seinem Schalter: I2 für offen, I1 für zu. Nichts ist \
         im Weg: I4 meldet dann true.",
    )
}

fn pushes(switch: &str) -> Wrong {
    Wrong::new(
        format!("The gate is at {switch}, but M1 still pushes against the end."),
        format!("Das Tor ist bei {switch}, aber M1 drückt weiter gegen den Anschlag."),
    )
    .hint(
        "the end switch leads to the next state, in which M1 is off.",
        "Der Endschalter führt in den nächsten Zustand, und in dem steht M1.",
    )
}

fn never_closes() -> Wrong {
    Wrong::new(
        "The gate is open, and does not close by itself.",
        "Das Tor ist offen und schließt nicht von selbst.",
    )
    .hint(
        "remember when it opened, and close when two seconds have passed since then.",
        "Merke dir, seit wann es offen ist, und schließe es zwei Sekunden später.",
    )
}

fn pause(lasted: Lasted) -> Check {
    let Some(seconds) = lasted.outside(PAUSE - TOLERANCE, PAUSE + TOLERANCE) else {
        return Ok(());
    };
    Err(Wrong::new(
        format!("The gate was open for {seconds:.1} s; it should be 2 s."),
        format!("Das Tor war {} s lang offen, soll es aber 2 s lang sein.", german(seconds, 1)),
    )
    .hint(
        "the time begins when the gate reaches I2.",
        "Die Zeit beginnt, wenn das Tor I2 erreicht.",
    ))
}

fn barrier_ignored() -> Wrong {
    Wrong::new(
        "Something is in the light barrier I4, but the gate keeps closing.",
        "In der Lichtschranke I4 ist etwas, aber das Tor schließt weiter.",
    )
    .hint(
        "I4 reports true with light. While the gate closes, check in each round whether it is false.",
        "I4 meldet true, wenn Licht da ist. Frage beim Schließen in jeder Runde, ob es false ist.",
    )
}
