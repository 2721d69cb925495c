//! Lesson 3: M1 turns clockwise while I1 is pressed, counter-clockwise while I2 is, and is off for both and none.

use ft_transfer_area::tx::{Input, Input::I1, Input::I2, Motor::M1};

use super::A_WHILE;
use crate::check::moment::Moment;
use crate::check::stage::Stage;
use crate::check::words::{Check, Wrong};

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("nobody presses a button: M1 is off", "niemand drückt einen Taster: M1 steht");
    stage.stays(
        A_WHILE,
        |now| now.motor(M1) == 0,
        |_| {
            Wrong::new(
                "M1 turns although nobody has pressed a button.",
                "M1 dreht sich, obwohl niemand einen Taster gedrückt hat.",
            )
            .hint("Direction::Halt is for no button.", "Für keinen Taster gibt es Direction::Halt.")
        },
    )?;
    stage.step(
        "I1 is pressed: M1 turns clockwise; released: it stops",
        "I1 wird gedrückt: M1 dreht nach rechts; losgelassen: er steht",
    );
    press(stage, I1, |now| now.motor(M1) > 0)?;
    stage.step(
        "I2 is pressed: M1 turns counter-clockwise; released: it stops",
        "I2 wird gedrückt: M1 dreht nach links; losgelassen: er steht",
    );
    press(stage, I2, |now| now.motor(M1) < 0)?;

    stage.step("I1 and I2 are pressed: M1 is off", "I1 und I2 werden gedrückt: M1 steht");
    stage.press(I1, true);
    stage.soon(|now| now.motor(M1) > 0, |now| other_way(I1, now))?;
    stage.press(I2, true);
    stage.soon(|now| now.motor(M1) == 0, both)?;
    stage.stays(A_WHILE, |now| now.motor(M1) == 0, both)?;
    if stage.log().iter().any(|now| now.is_torn(M1)) {
        return Err(Wrong::new(
            "O1 and O2 were on at the same time, which a motor can't follow.",
            "O1 und O2 waren gleichzeitig an. Damit kann ein Motor nichts anfangen.",
        )
        .hint(
            "set both outputs of a motor at once, with set_out_motor_values.",
            "Setze beide Ausgänge des Motors auf einmal, mit set_out_motor_values.",
        ));
    }
    Ok(())
}

/// Presses and releases a button.
fn press(stage: &mut Stage, button: Input, turns: fn(&Moment) -> bool) -> Check {
    stage.press(button, true);
    stage.soon(turns, |now| other_way(button, now))?;
    stage.press(button, false);
    stage.soon(|now| now.motor(M1) == 0, |_| {
        Wrong::new(
            format!("M1 keeps turning after {button} was released."),
            format!("M1 dreht weiter, nachdem {button} losgelassen wurde."),
        )
        .hint(
            "a motor keeps turning until the program stops it: with Direction::Halt when no button is pressed.",
            "Ein Motor läuft, bis das Programm ihn anhält: mit Direction::Halt, wenn kein Taster gedrückt ist.",
        )
    })?;
    Ok(())
}

/// The motor does not turn as this button says.
fn other_way(button: Input, now: &Moment) -> Wrong {
    let (en, de) = if button == I1 {
        ("clockwise (Direction::Cw)", "nach rechts (Direction::Cw)")
    } else {
        ("counter-clockwise (Direction::Ccw)", "nach links (Direction::Ccw)")
    };
    let others = now.outputs_on();
    if now.motor(M1) == 0 && !others.is_empty() {
        return Wrong::new(
            format!("{button} is pressed, but {others} went on and not M1."),
            format!("{button} ist gedrückt, aber an ging {others} und nicht M1."),
        )
        .hint("M1 is between O1 and O2.", "M1 liegt zwischen O1 und O2.");
    }
    if now.motor(M1) == 0 {
        return Wrong::new(
            format!("{button} is pressed, but M1 does not turn. It should turn {en}."),
            format!("{button} ist gedrückt, aber M1 steht. Er soll {de} drehen."),
        )
        .hint(
            "if one button works and the other does not, the second `if` may undo the first one. Use \
             match (i1, i2).",
            "Geht der eine Taster und der andere nicht? Dann macht das zweite `if` das erste vielleicht \
             rückgängig. Nimm match (i1, i2).",
        );
    }
    Wrong::new(
        format!("{button} is pressed, and M1 turns the wrong way. It should turn {en}."),
        format!("{button} ist gedrückt, und M1 dreht falsch herum. Er soll {de} drehen."),
    )
    .hint("swap Direction::Cw and Direction::Ccw.", "Vertausche Direction::Cw und Direction::Ccw.")
}

/// The motor turns while both buttons are pressed.
fn both(now: &Moment) -> Wrong {
    let (en, de) = if now.motor(M1) > 0 { ("I1", "I1") } else { ("I2", "I2") };
    Wrong::new(
        format!("I1 and I2 are both pressed, and M1 follows {en}. It should be off."),
        format!("I1 und I2 sind beide gedrückt, und M1 folgt {de}. Er soll stehen."),
    )
    .hint(
        "if … else if takes the first one that is true. match (i1, i2) has all four cases.",
        "if … else if nimmt den ersten. match (i1, i2) kennt alle vier Fälle.",
    )
}
