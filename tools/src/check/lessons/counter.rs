//! Lesson 5: each press of I1 lowers the load by 100 pulses of C1.

use std::cell::Cell;
use std::time::Duration;

use ft_transfer_area::tx::{Counter::C1, Input::I1, Motor::M1};

use super::A_WHILE;
use crate::check::moment::Moment;
use crate::check::stage::Stage;
use crate::check::words::{Check, Words, Wrong};

/// The motor gives about 63 pulses in a second.
const MOST: f64 = 140.0;
const LEAST: f64 = 99.0;
/// Five times as long as it takes.
const LIMIT: Duration = Duration::from_secs(8);

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("nobody presses I1: the winch does not turn", "niemand drückt I1: die Winde steht");
    stage.stays(
        A_WHILE,
        |now| now.motor(M1) == 0,
        |_| {
            Wrong::new(
                "The winch turns although nobody has pressed I1.",
                "Die Winde dreht sich, obwohl niemand I1 gedrückt hat.",
            )
            .hint(
                "wait for I1 first: wait_until(|areas| …, Duration::MAX).",
                "Warte zuerst auf I1: wait_until(|areas| …, Duration::MAX).",
            )
        },
    )?;
    stage.step(
        "I1 is pressed: the load goes down by 100 pulses",
        "I1 wird gedrückt: die Last sinkt um 100 Impulse",
    );
    lower(stage, true)?;
    stage.step("and again: another 100 pulses", "und noch einmal: weitere 100 Impulse");
    lower(stage, false)
}

/// Presses the button, and judges how far the load went.
fn lower(stage: &mut Stage, is_first: bool) -> Check {
    let from = stage.log().last().map_or(0.0, |now| now.way(M1));
    // The program does not see 100 itself.
    stage.be_late(C1, 98..100);
    stage.tap(I1)?;
    stage.soon(|now| now.motor(M1) != 0, |_| no_turn(is_first))?;
    let (before, skips) = (Cell::new(None), Cell::new(None));
    let stops = |now: &Moment| {
        let count = now.count(C1);
        if let Some(before) =
            before.replace(Some(count)).filter(|before| *before < 100 && count > 100)
        {
            skips.set(Some((before, count)));
        }
        now.motor(M1) == 0
    };
    stage.within(LIMIT, stops, |now| endless(now, skips.get()))?;
    // Until it has come to rest.
    stage.stays(
        A_WHILE,
        |now| now.motor(M1) == 0,
        |_| {
            Wrong::new(
                "The winch stopped and started again without I1.",
                "Die Winde hielt an und lief ohne I1 wieder los.",
            )
            .hint(
                "wait until I1 is released, and then for the next press.",
                "Warte, bis I1 losgelassen ist, und dann auf den nächsten Druck.",
            )
        },
    )?;
    let to = stage.log().last().map_or(0.0, |now| now.way(M1));
    if is_first {
        first(to - from)
    } else {
        again(to - from)
    }
}

fn first(went: f64) -> Check {
    if went < 0.0 {
        return Err(Wrong::new(
            "The load went up instead of down.",
            "Die Last ging nach oben statt nach unten.",
        )
        .hint("Direction::Cw lowers it.", "Direction::Cw lässt sie sinken."));
    }
    if !(LEAST..=MOST).contains(&went) {
        return Err(not_100(went));
    }
    Ok(())
}

fn again(went: f64) -> Check {
    if (0.0..LEAST).contains(&went) {
        return Err(too_little(went));
    }
    first(went)
}

fn no_turn(is_first: bool) -> Wrong {
    if !is_first {
        return too_little(0.0);
    }
    Wrong::new(
        "I1 was pressed for a moment, but M1 does not turn.",
        "I1 wurde kurz gedrückt, aber M1 dreht sich nicht.",
    )
    .hint(
        "set M1 with set_out_motor_values, and drop the guard before you wait again.",
        "Schalte M1 mit set_out_motor_values ein und gib den Guard frei, bevor du wieder wartest.",
    )
}

fn not_100(went: f64) -> Wrong {
    Wrong::new(
        format!("The load went down by {went:.0} pulses instead of 100."),
        format!("Die Last sank um {went:.0} Impulse statt um 100."),
    )
    .hint(
        "a time says nothing about the way, and I1 only starts the winch. Wait until get_in_cnt_count(C1) \
         is 100 or more.",
        "Eine Zeit sagt nichts über den Weg, und I1 startet die Winde nur. Warte, bis \
         get_in_cnt_count(C1) mindestens 100 ist.",
    )
}

/// It does not stop. `skips` has the count before 100 and the next one, if it was never 100.
fn endless(now: &Moment, skips: Option<(i16, i16)>) -> Wrong {
    let way = now.way(M1);
    let wrong = Wrong::new(
        format!("The winch does not stop: the load is already {way:.0} pulses down."),
        format!("Die Winde hält nicht an: Die Last ist schon {way:.0} Impulse unten."),
    );
    if let Some((before, after)) = skips {
        return wrong.advise(Words::new(
            format!(
                "the program saw {before} pulses and then {after}, never 100. Wait for 100 or more: \
                 get_in_cnt_count(C1) >= 100. After that, set M1 to Direction::Halt."
            ),
            format!(
                "Das Programm sah {before} Impulse und dann {after}, nie 100. Warte auf 100 oder mehr: \
                 get_in_cnt_count(C1) >= 100. Setze M1 danach auf Direction::Halt."
            ),
        ));
    }
    wrong.hint(
        "after the wait, set M1 to Direction::Halt.",
        "Setze M1 nach dem Warten auf Direction::Halt.",
    )
}

/// The counter was not reset.
fn too_little(went: f64) -> Wrong {
    Wrong::new(
        format!("The first press was right, but the second one lowered the load by only {went:.0} pulses."),
        format!("Beim ersten Mal stimmte es, beim zweiten Mal sank die Last nur um {went:.0} Impulse."),
    )
    .hint(
        "the counter keeps counting from its old value. Reset it before each journey: start_counter_reset, \
         then wait_counter_reset.",
        "Der Zähler zählt vom alten Stand weiter. Setze ihn vor jeder Fahrt zurück: start_counter_reset, \
         dann wait_counter_reset.",
    )
}
