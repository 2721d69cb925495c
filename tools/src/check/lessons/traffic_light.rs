//! Lesson 8: a traffic light for cars, red O1, yellow O2, green O3. After a press of I1: yellow for 1 s, red for 3 s,
//! red and yellow for 1 s, green again.

use std::time::Duration;

use ft_transfer_area::tx::Input::I1;
use ft_transfer_area::tx::Output::{O1, O2, O3};

use super::A_WHILE;
use crate::check::moment::{Lasted, Moment};
use crate::check::stage::Stage;
use crate::check::words::{self, Check, Wrong};

/// What is lit: red, yellow, green.
type Light = [bool; 3];

const GREEN: Light = [false, false, true];
const DARK: Light = [false; 3];

/// The phases after the press, and how long each lasts, in seconds.
const PHASES: [(Light, f64); 3] =
    [([false, true, false], 1.0), ([true, false, false], 3.0), ([true, true, false], 1.0)];

/// All phases take 5 s.
const LIMIT: Duration = Duration::from_secs(9);
/// How much shorter or longer a phase may be.
const TOLERANCE: f64 = 0.6;

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("at first it is green", "am Anfang ist Grün");
    stage.soon(|now| light(now) == GREEN, |now| not_green(light(now)))?;
    stage.stays(A_WHILE, |now| light(now) == GREEN, |now| not_green(light(now)))?;
    for _ in 0..2 {
        stage.step(
            "I1 is pressed: yellow, red, red and yellow, green",
            "I1 wird gedrückt: Gelb, Rot, Rot und Gelb, Grün",
        );
        stage.tap(I1)?;
        stage.soon(
            |now| light(now) != GREEN,
            |_| {
                Wrong::new(
                    "I1 was pressed for a moment, but the light stays green.",
                    "I1 wurde kurz gedrückt, aber die Ampel bleibt grün.",
                )
                .hint(
                    "check I1 in each round of the loop while it is green.",
                    "Frage I1 in jeder Runde der Schleife ab, solange Grün ist.",
                )
            },
        )?;
        let (moments, _) = stage.watch(LIMIT, |now| light(now) == GREEN)?;
        judge(&moments)?;
    }
    Ok(())
}

fn light(now: &Moment) -> Light {
    [O1, O2, O3].map(|output| now.is_on(output))
}

/// The phases that were seen, one after the other, must be those that are expected.
fn judge(moments: &[Moment]) -> Check {
    let mut seen: Vec<(Light, Lasted)> = Vec::new();
    let mut begin = moments[0];
    for now in moments.iter().skip(1) {
        if light(now) != light(&begin) {
            seen.push((light(&begin), now.since(&begin)));
            begin = *now;
        }
    }
    seen.push((light(&begin), moments[moments.len() - 1].since(&begin)));
    for (number, (expected, seconds)) in PHASES.into_iter().enumerate() {
        let Some((is, lasted)) = seen.get(number).copied() else { return Err(missing(expected)) };
        if is != expected {
            return Err(another(number, expected, is));
        }
        if let Some(lasted) = lasted.outside(seconds - TOLERANCE, seconds + TOLERANCE) {
            return Err(wrong_time(expected, seconds, lasted));
        }
    }
    match seen.get(PHASES.len()) {
        Some((light, _)) if *light == GREEN => Ok(()),
        Some((light, _)) => Err(another(PHASES.len(), GREEN, *light)),
        None => Err(missing(GREEN)),
    }
}

fn not_green(is: Light) -> Wrong {
    let (en, de) = (english(is), german(is));
    let wrong = Wrong::new(
        format!("Nobody has pressed I1, so it should be green, but it is {en}."),
        format!("Niemand hat I1 gedrückt, es sollte also Grün sein, aber es ist {de}."),
    );
    if is == DARK {
        return wrong.hint(
            "O1 to O3 are single outputs: set_ft_motor_config(M1, false), and the same for M2. Set all \
             three lamps in each state, also in the first one.",
            "O1 bis O3 sind einzelne Ausgänge: set_ft_motor_config(M1, false), ebenso für M2. Setze in \
             jedem Zustand alle drei Lampen, auch im ersten.",
        );
    }
    wrong.hint("the first state is green.", "Der erste Zustand ist Grün.")
}

fn another(number: usize, expected: Light, is: Light) -> Wrong {
    let before = number.checked_sub(1).map_or(GREEN, |before| PHASES[before].0);
    let wrong = Wrong::new(
        format!(
            "After {} comes {}, but it is {}.",
            english(before),
            english(expected),
            english(is)
        ),
        format!("Auf {} folgt {}, es ist aber {}.", german(before), german(expected), german(is)),
    );
    if is == DARK {
        return wrong.hint(
            "the lamps were set in two exchanges: set all of them under one guard.",
            "Die Lampen wurden nacheinander gesetzt: Setze alle unter einem Guard.",
        );
    }
    wrong.hint(
        "does the arrow lead to the right state? And each state sets all three lamps: those that are lit and those that \
         are dark.",
        "Führt der Pfeil zum richtigen Zustand? Und jeder Zustand setzt alle drei Lampen: die hellen und die dunklen.",
    )
}

fn missing(expected: Light) -> Wrong {
    Wrong::new(
        format!("The traffic light does not change to {}.", english(expected)),
        format!("Die Ampel kommt nicht bis {}.", german(expected)),
    )
    .hint(
        "each state has a next one; after red and yellow comes green again.",
        "Jeder Zustand hat einen Nachfolger; nach Rot und Gelb kommt wieder Grün.",
    )
}

fn wrong_time(light: Light, seconds: f64, lasted: f64) -> Wrong {
    Wrong::new(
        format!("It was {} for {lasted:.1} s; it should be {seconds:.0} s.", english(light)),
        format!(
            "Es war {} s lang {}, soll es aber {seconds:.0} s lang sein.",
            words::german(lasted, 1),
            german(light)
        ),
    )
    .hint(
        "remember when a state began, and compare: now - since >= Duration::from_secs(3).",
        "Merke dir, wann ein Zustand begann, und vergleiche: now - since >= Duration::from_secs(3).",
    )
}

fn english(light: Light) -> &'static str {
    name(
        light,
        [
            "dark",
            "green",
            "yellow",
            "yellow and green",
            "red",
            "red and green",
            "red and yellow",
            "red, yellow and green",
        ],
    )
}

fn german(light: Light) -> &'static str {
    name(
        light,
        [
            "alles dunkel",
            "Grün",
            "Gelb",
            "Gelb und Grün",
            "Rot",
            "Rot und Grün",
            "Rot und Gelb",
            "Rot, Gelb und Grün",
        ],
    )
}

fn name([red, yellow, green]: Light, names: [&'static str; 8]) -> &'static str {
    names[4 * usize::from(red) + 2 * usize::from(yellow) + usize::from(green)]
}
