//! Lesson 7: the fan at M1 runs from 30 °C on, until it is colder than 25 °C.

use ft_transfer_area::tx::{Input::I1, Motor::M1};
use ft_transfer_area_simulator::world::Sensor;

use super::A_WHILE;
use crate::check::moment::Moment;
use crate::check::stage::Stage;
use crate::check::words::{Check, Wrong};

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step("20 °C: the fan is off", "20 °C: der Lüfter steht");
    stage.stays(A_WHILE, |now| now.motor(M1) == 0, |_| runs_in_the_cold())?;
    stage.step("35 °C: the fan runs", "35 °C: der Lüfter läuft");
    celsius(stage, 35.0);
    stage.soon(|now| now.motor(M1) != 0, |_| {
        Wrong::new(
            "It is 35 °C, but the fan is off.",
            "Es sind 35 °C, und der Lüfter steht.",
        )
        .hint(
            "at 35 °C the NTC at I1 has about 980 Ω. Is I1 set to InputMode::Resistance, not digital (false)?",
            "Bei 35 °C hat der NTC an I1 etwa 980 Ω. Steht I1 auf InputMode::Resistance, nicht digital (false)?",
        )
    })?;
    stage.step("27 °C: the fan still runs", "27 °C: der Lüfter läuft weiter");
    celsius(stage, 27.0);
    stage.stays(2 * A_WHILE, |now| now.motor(M1) != 0, between)?;
    stage.step("20 °C: the fan stops", "20 °C: der Lüfter hält an");
    celsius(stage, 20.0);
    stage.soon(|now| now.motor(M1) == 0, |_| runs_in_the_cold())?;
    stage.step("27 °C: the fan does not start yet", "27 °C: der Lüfter läuft noch nicht an");
    celsius(stage, 27.0);
    stage.stays(2 * A_WHILE, |now| now.motor(M1) == 0, between)
}

fn celsius(stage: &mut Stage, celsius: f64) {
    stage.plug(I1, Sensor::Ntc { celsius });
}

fn runs_in_the_cold() -> Wrong {
    Wrong::new(
        "It is 20 °C, but the fan is running.",
        "Es sind 20 °C, und der Lüfter läuft.",
    )
    .hint(
        "the resistance of an NTC falls when it gets warmer: 1870 Ω at 20 °C, 1500 Ω at 25 °C, 1210 Ω at 30 °C. The \
         value is in Ω only with InputMode::Resistance.",
        "Der Widerstand eines NTC sinkt, wenn es wärmer wird: 1870 Ω bei 20 °C, 1500 Ω bei 25 °C, 1210 Ω bei 30 °C. \
         Ω misst der Eingang nur mit InputMode::Resistance.",
    )
}

/// The fan does not stay as it is between the two limits.
fn between(now: &Moment) -> Wrong {
    let wrong = if now.motor(M1) == 0 {
        Wrong::new(
            "It cooled down from 35 °C to 27 °C, and the fan stopped. It should run until it is colder than 25 °C.",
            "Nach 35 °C wurden es 27 °C, und der Lüfter hielt an. Er soll laufen, bis es kälter als 25 °C ist.",
        )
    } else {
        Wrong::new(
            "It warmed up from 20 °C to 27 °C, and the fan started. It should start at 30 °C.",
            "Nach 20 °C wurden es 27 °C, und der Lüfter lief an. Er soll erst bei 30 °C anlaufen.",
        )
    };
    wrong.hint(
        "use two limits and change nothing between them: on below 1210 Ω, off above 1500 Ω.",
        "Nimm zwei Grenzen und ändere dazwischen nichts: ein unter 1210 Ω, aus über 1500 Ω.",
    )
}
