//! Lesson 6: a car with the wheels M1 and M2 drives 500 pulses straight ahead and back, and the program ends.

use std::time::Duration;

use ft_transfer_area::tx::Motor::{self, M1, M2};

use crate::check::moment::Moment;
use crate::check::stage::{ended_by_an_error, Stage};
use crate::check::words::{Check, Wrong};

const PULSES: f64 = 500.0;
/// How far a wheel runs on when its distance is counted, and how far one may be behind the other on the way.
const TOLERANCE: f64 = 20.0;
/// How many pulses a wheel that has arrived may be short of its place. One that was not waited for is short of more.
const SHORT: f64 = 1.5;
/// Ahead and back take about eight seconds.
const LIMIT: Duration = Duration::from_secs(40);

pub(in crate::check) fn check(stage: &mut Stage) -> Check {
    stage.step(
        "the car drives 500 pulses ahead and back, and the program ends",
        "das Auto fährt 500 Impulse vor und zurück, und das Programm endet",
    );
    let ended = stage.wait_end(LIMIT)?;
    let log = stage.log();
    let (Some(first), Some(last)) = (log.first(), log.last()) else { return Ok(()) };
    // What it has not done is the error's fault.
    let because_of = |wrong| if ended == Some(false) { ended_by_an_error() } else { wrong };
    ways(&log, first, last, ended.is_some()).map_err(because_of)?;
    stage.step(
        "it drives straight: both wheels together",
        "es fährt geradeaus: beide Räder gemeinsam",
    );
    straight(&log, first)?;
    stage.step("the program ends without an error", "das Programm endet ohne Fehler");
    match ended {
        Some(true) => Ok(()),
        Some(false) => Err(Wrong::new(
            "The car drove correctly, but the program ended with an error. Its message is above.",
            "Das Auto fuhr richtig, aber das Programm endete mit einem Fehler. Die Meldung steht weiter oben.",
        )
        .of_an_error()),
        None => Err(Wrong::new(
            "The car drove correctly, but the program does not end.",
            "Das Auto fuhr richtig, aber das Programm endet nicht.",
        )
        .hint("this one needs no loop.", "Dieses Programm braucht keine Schleife.")),
    }
}

/// Whether both wheels have gone ahead and back.
fn ways(log: &[Moment], first: &Moment, last: &Moment, has_ended: bool) -> Check {
    let farthest =
        |motor: Motor| log.iter().map(|now| now.way(motor) - first.way(motor)).fold(0.0, f64::max);
    let wheels = [(M1, farthest(M1)), (M2, farthest(M2))];
    if wheels.iter().all(|(_, way)| *way < 1.0) {
        return Err(Wrong::new(
            "The car does not drive.",
            "Das Auto fährt nicht.",
        )
        .hint(
            "start_motor_ex_cmd gives the command; wait_motor_ex waits until it is done. Direction::Cw is ahead.",
            "start_motor_ex_cmd gibt den Befehl, wait_motor_ex wartet, bis er fertig ist. Direction::Cw ist vorwärts.",
        ));
    }
    for ((motor, way), other) in wheels.into_iter().zip([M2, M1]) {
        if way < 1.0 {
            return Err(Wrong::new(
                format!("Only the wheel {other} turns; {motor} does not, so the car turns on the spot."),
                format!("Nur das Rad {other} dreht sich, {motor} steht. So dreht sich das Auto auf der Stelle."),
            )
            .hint(
                "M2 follows when it is in the list of slaves: &[(M2, Direction::Cw)].",
                "M2 fährt mit, wenn er in der Liste der Mitläufer steht: &[(M2, Direction::Cw)].",
            ));
        }
        if way < PULSES - 1.0 {
            return Err(too_short(motor, way, has_ended));
        }
        if way > PULSES + TOLERANCE {
            return Err(Wrong::new(
                format!("{motor} drove {way:.0} pulses ahead instead of 500."),
                format!("{motor} fuhr {way:.0} Impulse vorwärts statt 500."),
            )
            .hint(
                "give the distance to start_motor_ex_cmd: then the controller counts, and stops the motor. On the way \
                 back the slave drives with Direction::Ccw, too.",
                "Gib die Strecke bei start_motor_ex_cmd an: Dann zählt der Controller selbst und hält den Motor an. Auf \
                 dem Rückweg fährt auch der Mitläufer mit Direction::Ccw.",
            ));
        }
    }
    let back = last.way(M1) - first.way(M1);
    if back.abs() > 2.0 * TOLERANCE {
        return Err(Wrong::new(
            format!("The car is {back:.0} pulses from where it started; it should come back."),
            format!("Das Auto steht {back:.0} Impulse vom Start entfernt, soll aber zurückkommen."),
        )
        .hint(
            "the way back is the same command with Direction::Ccw for both, and another wait_motor_ex.",
            "Der Rückweg ist derselbe Befehl mit Direction::Ccw für beide, und noch ein wait_motor_ex.",
        ));
    }
    // A wheel whose command the end of the program has cut short.
    for motor in [M1, M2] {
        let left = last.way(motor) - first.way(motor);
        if left > SHORT {
            return Err(too_short_back(motor, PULSES - left));
        }
    }
    Ok(())
}

fn too_short_back(motor: Motor, way: f64) -> Wrong {
    Wrong::new(
        format!("{motor} drove only {way:.0} of 500 pulses back."),
        format!("{motor} fuhr nur {way:.0} von 500 Impulsen zurück."),
    )
    .hint(
        "each wheel arrives by itself. Wait for M1 and for M2 before the end of the program, too.",
        "Jedes Rad kommt für sich an. Warte auch vor dem Ende des Programms auf M1 und auf M2.",
    )
}

fn too_short(motor: Motor, way: f64, has_ended: bool) -> Wrong {
    let wrong = Wrong::new(
        format!("{motor} drove only {way:.0} of 500 pulses ahead."),
        format!("{motor} fuhr nur {way:.0} von 500 Impulsen vorwärts."),
    );
    if has_ended {
        return wrong.hint(
            "a command only begins the journey. Wait with wait_motor_ex, for M1 and for M2, before the next \
             command and before the end.",
            "Ein Befehl startet die Fahrt nur. Warte mit wait_motor_ex auf M1 und auf M2, bevor der nächste \
             Befehl oder das Ende kommt.",
        );
    }
    wrong.hint("the distance is the last argument.", "Die Strecke ist das letzte Argument.")
}

/// Whether no wheel was far ahead of the other.
fn straight(log: &[Moment], first: &Moment) -> Check {
    let apart =
        |now: &Moment| ((now.way(M1) - first.way(M1)) - (now.way(M2) - first.way(M2))).abs();
    let most = log.iter().map(apart).fold(0.0, f64::max);
    if most <= TOLERANCE {
        return Ok(());
    }
    Err(Wrong::new(
        format!("The car drives a curve: on the way one wheel is {most:.0} pulses ahead of the other."),
        format!("Das Auto fährt eine Kurve: Unterwegs ist ein Rad dem anderen {most:.0} Impulse voraus."),
    )
    .hint(
        "M2 runs a little harder. Let the controller keep both together: one command for M1, with M2 as its slave.",
        "M2 läuft etwas schwerer. Der Controller hält beide zusammen, wenn es ein einziger Befehl ist: für M1, \
         mit M2 als Mitläufer.",
    ))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ft_transfer_area::tx::Motor;
    use ft_transfer_area::wire::ExchangeData;
    use ft_transfer_area_simulator::Machine;

    use super::*;
    use crate::check::lesson::Lesson;
    use crate::check::words::Language;

    /// What is wrong with a journey that waits for these motors on the way there and back.
    fn judged(waits: [&[Motor]; 2]) -> Option<String> {
        let world = Lesson::find("6").unwrap().read_world().unwrap();
        let mut machine = Machine::with_world(0, world).unwrap();
        let mut log = vec![Moment::of(&machine, None)];
        let mut step = |machine: &mut Machine| {
            machine.step(Duration::from_millis(10));
            log.push(Moment::of(machine, log.last()));
        };
        for (id, waits) in (1..).zip(waits) {
            let duty =
                if id == 1 { [512, 0, 512, 0, 0, 0, 0, 0] } else { [0, 512, 0, 512, 0, 0, 0, 0] };
            let (master, distance, motor_command_id) =
                ([0, 1, 0, 0], [500, 500, 0, 0], [id, id, 0, 0]);
            machine.set_outputs(
                0,
                ExchangeData {
                    duty,
                    master,
                    distance,
                    motor_command_id,
                    ..ExchangeData::default()
                },
            );
            let is_done = |machine: &Machine| {
                let done = machine.report(0).unwrap().motor_command_id;
                waits.iter().all(|motor| done[motor.index()] == id)
            };
            while !is_done(&machine) {
                step(&mut machine);
            }
        }
        machine.set_outputs(0, ExchangeData::default());
        step(&mut machine);
        let wrong = ways(&log, &log[0], log.last().unwrap(), true).err()?;
        wrong.text(Language::En).lines().next().map(str::to_owned)
    }

    #[test]
    fn each_wheel_has_to_be_waited_for_both_ways() {
        assert_eq!(judged([&[M1, M2], &[M1, M2]]), None);
        let ahead = judged([&[M1], &[M1]]);
        assert_eq!(ahead.as_deref(), Some("M2 drove only 497 of 500 pulses ahead."));
        let back = judged([&[M1, M2], &[M1]]);
        assert_eq!(back.as_deref(), Some("M2 drove only 497 of 500 pulses back."));
    }
}
