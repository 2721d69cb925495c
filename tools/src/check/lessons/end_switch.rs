//! Lesson 4: each press of I3 moves the slide to its other end, where M1 stops at the end switch.

use std::time::Duration;

use ft_transfer_area::tx::{Input::I3, Motor::M1};

use super::A_WHILE;
use crate::check::moment::Moment;
use crate::check::stage::Stage;
use crate::check::words::{Check, Wrong};

/// Where the end switches are pressed, in pulses.
const START: f64 = 4.0;
const END: f64 = 396.0;
/// The slide needs about two seconds.
const TRAVEL: Duration = Duration::from_secs(8);

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step(
        "nobody presses I3: the slide does not move",
        "niemand drückt I3: der Schlitten steht",
    );
    stage.stays(
        A_WHILE,
        |now| now.motor(M1) == 0,
        |_| {
            Wrong::new(
                "The slide moves although nobody has pressed I3.",
                "Der Schlitten fährt, obwohl niemand I3 gedrückt hat.",
            )
            .hint(
                "wait for I3 first: wait_for(&areas, I3)?.",
                "Warte zuerst auf I3: wait_for(&areas, I3)?.",
            )
        },
    )?;
    for (there, switch) in [(true, "I2"), (false, "I1"), (true, "I2")] {
        if there {
            stage.step(
                "I3 is pressed: the slide goes to I2 and stops",
                "I3 wird gedrückt: der Schlitten fährt zu I2 und hält an",
            );
        } else {
            stage.step(
                "I3 is pressed: the slide goes back to I1 and stops",
                "I3 wird gedrückt: der Schlitten fährt zurück zu I1 und hält an",
            );
        }
        stage.tap(I3)?;
        go(stage, there, switch)?;
    }
    Ok(())
}

/// Follows the slide to this switch.
fn go(stage: &mut Stage, there: bool, switch: &str) -> Check {
    let is_right = move |now: &Moment| if there { now.motor(M1) > 0 } else { now.motor(M1) < 0 };
    stage.soon(is_right, |now| not_started(now, switch))?;
    let arrived = move |now: &Moment| if there { now.way(M1) >= END } else { now.way(M1) <= START };
    stage.within(TRAVEL, arrived, |now| not_arrived(now, switch))?;
    let rests = stage.soon(|now| now.motor(M1) == 0 || !is_near(now, there), |_| {
        Wrong::new(
            format!("The slide has reached {switch}, but M1 still pushes against the end."),
            format!("Der Schlitten ist bei {switch}, aber M1 drückt weiter gegen den Anschlag."),
        )
        .hint(
            "stop M1 when the end switch is pressed: I2 on the way there, I1 on the way back.",
            "Halte M1 an, wenn der Endschalter gedrückt ist: I2 auf dem Hinweg, I1 auf dem Rückweg.",
        )
    })?;
    if !is_near(&rests, there) {
        return Err(left(switch));
    }
    stage.stays(A_WHILE, |now| now.motor(M1) == 0, |_| left(switch))
}

/// Whether the slide is still at its end.
fn is_near(now: &Moment, there: bool) -> bool {
    const NEAR: f64 = 20.0;
    if there {
        now.way(M1) > END - NEAR
    } else {
        now.way(M1) < START + NEAR
    }
}

fn left(switch: &str) -> Wrong {
    Wrong::new(
        format!("The slide was at {switch} and left it again without I3."),
        format!("Der Schlitten war bei {switch} und fuhr ohne I3 wieder weg."),
    )
    .hint(
        "wait for I3 before each journey, not only before the first one.",
        "Warte vor jeder Fahrt auf I3, nicht nur vor der ersten.",
    )
}

fn not_started(now: &Moment, switch: &str) -> Wrong {
    if now.motor(M1) == 0 {
        return Wrong::new(
            format!("I3 was pressed for a moment, but the slide does not go to {switch}."),
            format!("I3 wurde kurz gedrückt, aber der Schlitten fährt nicht zu {switch}."),
        )
        .hint(
            "the slide has two targets in turn. Does the program wait for I3 again after the first journey?",
            "Der Schlitten hat abwechselnd zwei Ziele. Wartet das Programm nach der ersten Fahrt wieder auf I3?",
        );
    }
    Wrong::new(
        format!("I3 was pressed, but the slide goes away from {switch}."),
        format!("I3 wurde gedrückt, aber der Schlitten fährt von {switch} weg."),
    )
    .hint(
        "Direction::Cw moves the slide to I2, Direction::Ccw to I1.",
        "Direction::Cw fährt zu I2, Direction::Ccw zu I1.",
    )
}

fn not_arrived(now: &Moment, switch: &str) -> Wrong {
    let place = now.way(M1);
    Wrong::new(
        format!("The slide has not reached {switch}. It is at {place:.0} of 400 pulses."),
        format!("Der Schlitten kam nicht bei {switch} an. Er steht bei {place:.0} von 400 Impulsen."),
    )
    .hint(
        "a short press of I3 is enough to start. After that only the end switch at the end of this way stops the slide: \
         I2 clockwise, I1 back; not I3 and no time.",
        "Ein kurzer Druck auf I3 reicht zum Losfahren. Danach hält nur der Endschalter am Ende dieses Wegs an: nach \
         rechts I2, zurück I1; nicht I3 und keine Zeit.",
    )
}
