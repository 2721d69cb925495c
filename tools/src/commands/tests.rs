use super::*;

fn moved(motor: Motor, duty: i64, pulses: Option<u32>, with: &[Follower]) -> Command {
    Command::Move { motor, duty, pulses, with: with.to_vec() }
}

#[test]
fn plain_speed_ends_a_distance_and_stops_the_followers_if_they_are_to_stop() {
    let mut area = FishX1Transfer::default();
    let follower = Follower { motor: Motor::M3, opposite: true };
    moved(Motor::M1, -300, Some(50), &[follower]).apply(&mut area).unwrap();
    assert_eq!((*area.output.distance, *area.output.master), ([50, 0, 50, 0], [0, 0, 1, 0]));
    assert_eq!(area.output.duty, [0, 300, 0, 0, 300, 0, 0, 0]);

    let plain = |duty, stops_followers| Command::Motor { motor: Motor::M1, duty, stops_followers };
    let mut others_go_on = area;
    plain(100, false).apply(&mut others_go_on).unwrap();
    assert_eq!(others_go_on.output.distance, [0, 0, 50, 0]);
    assert_eq!(others_go_on.output.duty, [100, 0, 0, 0, 300, 0, 0, 0]);

    plain(100, true).apply(&mut area).unwrap();
    assert_eq!((*area.output.distance, *area.output.master), ([0; 4], [0; 4]));
    assert_eq!(area.output.duty, [100, 0, 0, 0, 0, 0, 0, 0]);
    let commands = area.output.motor_ex_cmd_id;
    plain(200, true).apply(&mut area).unwrap();
    assert_eq!(area.output.motor_ex_cmd_id, commands, "it is at plain speed control already");
}

#[test]
fn without_pulses_motors_turn_together_and_0_pulses_are_no_distance() {
    let mut area = FishX1Transfer::default();
    let follower = Follower { motor: Motor::M4, opposite: false };
    moved(Motor::M2, 9, None, &[follower]).apply(&mut area).unwrap();
    assert_eq!(area.output.master, [0, 0, 0, 2]);
    assert_eq!(area.output.distance, [0; 4]);
    assert_eq!(moved(Motor::M2, 9, Some(0), &[]).apply(&mut area), Err(InvalidCall::ZeroPulses));
}

#[test]
fn what_is_wrong_for_every_area_is_known_before_and_changes_nothing() {
    let motor = |duty| Command::Motor { motor: Motor::M1, duty, stops_followers: true };
    let itself = Follower { motor: Motor::M1, opposite: false };
    for wrong in [
        motor(513),
        motor(i64::from(i16::MIN)),
        motor(i64::MAX),
        Command::Output { output: Output::O8, duty: -1 },
        moved(Motor::M1, i64::from(i16::MIN), Some(5), &[]),
        moved(Motor::M1, 5, Some(65_536), &[]),
        moved(Motor::M1, 5, Some(5), &[itself]),
        Command::Sound { index: 100, repeat: 1 },
    ] {
        let mut area = FishX1Transfer::default();
        area.set_ft_motor_config(Motor::M4, false);
        let before = area;
        assert_eq!(wrong.check(), wrong.apply(&mut area), "{wrong:?}");
        assert!(wrong.check().is_err(), "{wrong:?}");
        assert_eq!(area, before, "{wrong:?}");
    }
}

#[test]
fn what_is_wrong_for_this_area_changes_nothing() {
    let mut area = FishX1Transfer::default();
    let follower = Follower { motor: Motor::M2, opposite: false };
    moved(Motor::M1, 300, Some(50), &[follower]).apply(&mut area).unwrap();
    // As no call would leave it: a pair of outputs that follows.
    area.config.motor[0] = 0;
    let before = area;
    let plain = Command::Motor { motor: Motor::M1, duty: 1, stops_followers: true };
    assert_eq!(plain.check(), Ok(()));
    assert_eq!(plain.apply(&mut area), Err(InvalidCall::NotAMotor { motor: Motor::M1 }));
    assert_eq!(area, before);
    let output = Command::Output { output: Output::O4, duty: 9 };
    assert_eq!(output.check(), Ok(()));
    assert_eq!(output.apply(&mut area), Err(InvalidCall::NotAnOutput { output: Output::O4 }));
}

#[test]
fn what_an_absent_extension_was_told_is_stopped_once() {
    let mut areas = [FishX1Transfer::default(); 3];
    areas[0].state.io_slave_alive[1] = 1;
    for area in &mut areas {
        moved(Motor::M1, 300, Some(50), &[]).apply(area).unwrap();
        Command::Sound { index: 3, repeat: 1 }.apply(area).unwrap();
    }
    let before = areas;
    stop_absent(&mut areas);
    assert_eq!((areas[0], areas[2]), (before[0], before[2]));
    let stopped = areas[1].output;
    assert_eq!((*stopped.duty, *stopped.distance), ([0; 8], [0; 4]));
    assert_ne!(stopped.motor_ex_cmd_id, before[1].output.motor_ex_cmd_id, "a new command");
    assert_eq!(areas[1].txt_outputs.sound_index, SILENCE);
    let after = areas;
    stop_absent(&mut areas);
    assert_eq!(areas, after, "nothing is left to stop");
}
