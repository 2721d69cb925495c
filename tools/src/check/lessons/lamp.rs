//! Lesson 1: the lamp at O8 is lit while I1 is pressed.

use ft_transfer_area::tx::{Input::I1, Output::O8};

use super::A_WHILE;
use crate::check::moment::Moment;
use crate::check::stage::Stage;
use crate::check::words::{Check, Wrong};

/// Below this duty a lamp only glows.
const GLOW: i16 = 150;

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step(
        "nobody presses I1: the lamp at O8 is dark",
        "niemand drückt I1: die Lampe an O8 ist dunkel",
    );
    stage.stays(
        A_WHILE,
        |now| !now.is_on(O8),
        |_| {
            Wrong::new(
                "The lamp at O8 is lit although nobody has pressed I1.",
                "Die Lampe an O8 leuchtet, obwohl niemand I1 gedrückt hat.",
            )
            .hint(
                "I1 reports true while it is pressed. Is the lamp switched on for false?",
                "I1 meldet true, solange der Taster gedrückt ist. Schaltest du die Lampe bei false ein?",
            )
        },
    )?;
    for _ in 0..2 {
        stage.step(
            "I1 is pressed: the lamp at O8 is lit",
            "I1 wird gedrückt: die Lampe an O8 leuchtet",
        );
        stage.press(I1, true);
        let lit = stage.soon(|now| now.is_on(O8), dark)?;
        if lit.duty(O8) < GLOW {
            return Err(too_weak(lit.duty(O8)));
        }
        stage.stays(A_WHILE, |now| now.is_on(O8), |_| {
            Wrong::new(
                "The lamp at O8 went out while I1 was still pressed.",
                "Die Lampe an O8 ging aus, obwohl I1 noch gedrückt war.",
            )
            .hint(
                "nothing but I1 decides: set the output from its state in each round of the loop.",
                "Allein I1 entscheidet: Setze den Ausgang in jeder Runde der Schleife nach seinem Zustand.",
            )
        })?;

        stage.step(
            "I1 is released: the lamp at O8 goes out",
            "I1 wird losgelassen: die Lampe an O8 geht aus",
        );
        stage.press(I1, false);
        stage.soon(|now| !now.is_on(O8), |_| {
            Wrong::new(
                "The lamp at O8 stays on after I1 was released.",
                "Die Lampe an O8 bleibt an, nachdem I1 losgelassen wurde.",
            )
            .hint(
                "an output keeps its value until the program sets another one. Set it to 0 as well.",
                "Ein Ausgang behält seinen Wert, bis das Programm einen anderen setzt. Setze ihn auch auf 0.",
            )
        })?;
    }
    Ok(())
}

fn dark(now: &Moment) -> Wrong {
    let others = now.outputs_on();
    if !others.is_empty() {
        return Wrong::new(
            format!("I1 was pressed, but {others} went on and not the lamp at O8."),
            format!("I1 wurde gedrückt, aber an ging {others} und nicht die Lampe an O8."),
        )
        .hint("outputs are called O1 to O8.", "Die Ausgänge heißen O1 bis O8.");
    }
    Wrong::new(
        "I1 was pressed, but the lamp at O8 stayed dark.",
        "I1 wurde gedrückt, aber die Lampe an O8 blieb dunkel.",
    )
    .hint(
        "does the program look at I1 and set O8? Call wait_cycle in each round of the loop, or it never sees the new \
         inputs. Write `let area = &mut now[LOCAL_IO];`: without &mut it is a copy, and nothing of it is sent.",
        "Fragt das Programm nach I1, und setzt es O8? Rufe wait_cycle in jeder Runde der Schleife auf, sonst sieht es \
         die neuen Eingänge nie. Schreib `let area = &mut now[LOCAL_IO];`: Ohne &mut ist es eine Kopie, und nichts \
         davon wird gesendet.",
    )
}

fn too_weak(duty: i16) -> Wrong {
    Wrong::new(
        format!("The lamp at O8 only glows: its duty is {duty} of 512."),
        format!("Die Lampe an O8 glimmt nur: Ihr Wert ist {duty} von 512."),
    )
    .hint("DUTY_MAX, 512, is full brightness.", "Volle Helligkeit ist DUTY_MAX, also 512.")
}
