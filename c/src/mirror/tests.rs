use ft_transfer_area::transfer_area::TxtInputs2;

use super::*;

#[test]
fn a_command_is_done_when_its_id_comes_back_and_no_newer_one_was_given() {
    let mut command = ContinuedId::default();
    command.begin(7, 7); // What the controller remembers of the program before.
    assert_eq!(command.send(0), None);
    assert_eq!(command.send(1), Some(8));
    assert_eq!(command.receive(7, 1), (0, false));
    assert_eq!(command.receive(8, 1), (1, true));
    assert_eq!(command.receive(8, 1), (1, false), "reported once");
    assert_eq!(command.send(2), Some(9));
    assert_eq!(command.receive(9, 3), (2, false), "the program waits for 3");
    assert_eq!(command.send(3), Some(10));
    assert_eq!(command.receive(10, 3), (3, true));
}

#[test]
fn the_first_command_is_new_for_a_controller_that_has_not_done_the_last_one() {
    for (given, echo) in [(8, 7), (7, 8), (0, 7)] {
        let mut command = ContinuedId::default();
        command.begin(given, echo);
        assert_eq!(command.receive(echo, 0), (0, false));
        let sent = command.send(1).unwrap();
        assert!(sent != given && sent != echo, "{sent}");
        assert_eq!(command.receive(echo, 1), (0, false));
        assert_eq!(command.receive(sent, 1), (1, true));
    }
}

#[test]
fn the_stop_at_the_end_of_a_transfer_is_no_command_of_the_program() {
    let mut command = ContinuedId::default();
    command.begin(7, 7);
    assert_eq!(command.receive(8, 0), (0, false), "stopped before the first command");
    command.begin(8, 8);
    assert_eq!(command.send(5), Some(9));
    assert_eq!(command.receive(10, 5), (0, false), "cut off");
    assert_eq!(command.receive(9, 5), (5, true));
    assert_eq!(command.receive(10, 5), (5, false), "stopped after it");
}

#[test]
fn a_command_with_a_lower_id_is_a_command_like_each_other() {
    let mut command = ContinuedId::default();
    command.begin(4, 4);
    for before in [4, 6, 8, 10] {
        let (first, second) = (before + 1, before + 2);
        assert_eq!(command.send(1), Some(first));
        assert_eq!(command.receive(before, 1), (0, false));
        assert_eq!(command.send(0), Some(second));
        assert_eq!(command.receive(before, 0), (0, false), "a command of before had this id, too");
        assert_eq!(
            command.receive(first, 0),
            (1, false),
            "one further, but not the stop at the end"
        );
        assert_eq!(command.receive(second, 0), (0, true));
    }
}

/// A motor whose command was cut off, sent as `stop - 1` unless the pause came before.
fn cut_off(distance: u16, stop: u16, echo: u16, counter: i16) -> MotorCommand {
    let mut motor = MotorCommand::default();
    motor.begin(0, 0);
    assert_eq!(motor.send(1, 0, distance, false), (Some(1), distance));
    motor.go_on(stop, echo, counter);
    motor
}

#[test]
fn what_is_left_of_a_distance_is_a_new_command_after_a_pause() {
    let mut motor = cut_off(100, 2, 0, 30);
    assert_eq!(motor.send(1, 0, 100, false), (Some(3), 70));
    assert_eq!(motor.id.receive(0, 1), (0, false));
    assert_eq!(motor.id.receive(2, 1), (0, false), "the controller has done the stop");
    motor.go_on(4, 2, 20);
    assert_eq!(motor.send(1, 0, 100, false), (Some(5), 50));
    assert_eq!(motor.id.receive(5, 1), (1, true));
    assert_eq!(motor.send(2, 0, 100, false), (Some(6), 100));
    // It was not reported in time.
    assert_eq!(cut_off(100, 2, 0, 101).send(1, 0, 100, false), (Some(3), 1));
}

#[test]
fn a_command_that_was_not_sent_before_a_pause_is_sent_whole() {
    assert_eq!(cut_off(100, 1, 0, 30).send(1, 0, 100, false), (Some(2), 100));
    // The controller has done the stop, which has the id that the command would have had.
    assert_eq!(cut_off(100, 1, 1, 0).send(1, 0, 100, false), (Some(2), 100));
    // The rest of one that was cut off was not sent before the next pause.
    let mut motor = cut_off(100, 2, 0, 30);
    motor.go_on(3, 3, 30);
    assert!(!motor.is_still());
    assert_eq!(motor.send(1, 0, 100, false), (Some(4), 70));
}

#[test]
fn a_motor_that_has_done_its_distance_stands_still_after_a_pause() {
    for echo in [1, 2] {
        let mut motor = cut_off(100, 2, echo, 100);
        assert!(motor.is_still());
        assert_eq!(motor.id.receive(echo, 1), (1, true));
        assert_eq!(motor.id.receive(2, 1), (1, false));
        let mut again = motor;
        again.begin(2, 2);
        assert!(!again.is_still(), "in the next transfer");
        motor.send(2, 0, 50, false);
        assert!(!motor.is_still());
    }
}

#[test]
fn an_endless_command_is_sent_again_and_an_error_is_not_injected_again() {
    assert_eq!(cut_off(0, 2, 0, 30).send(1, 0, 0, false), (Some(3), 0));
    let mut motor = MotorCommand::default();
    motor.begin(0, 0);
    motor.send(1, 5, 7, false);
    motor.go_on(2, 0, 30);
    assert_eq!(motor.send(1, 5, 7, false), (Some(3), 0));
}

fn outputs_go_out_and_inputs_come_in<A: Area>() {
    let array = Arc::new(AreaArray::<A>::new());
    let mut mirror = Mirror::new(Arc::clone(&array), DEV_MODE_LOCAL);
    let mut areas = vec![FishX1Transfer::default(); AREAS];
    mirror.introduce("TX2013", FirmwareVersion::OLDEST_SUPPORTED);
    mirror.begin(&areas);
    let places = array.places(AREAS - 1);
    let mut output = array.load(places.output);
    (output.duty[7], output.motor_ex_cmd_id[3], output.distance[3]) = (512, 1, 40);
    array.store(places.output, output);
    mirror.put_out(&mut areas);
    assert_eq!(areas[AREAS - 1].output, output);

    areas[AREAS - 1].input.uni[2] = 77;
    areas[AREAS - 1].input.motor_ex_cmd_id[3] = 1;
    areas[0].state.io_slave_alive[7] = 1;
    let mut happened = Vec::new();
    mirror.take_in(&areas, |it| happened.push(it));
    let (online, area) = (true, AREAS - 1);
    let change = Change { change_status: 1, change_uni: 1 << 2, ..Change::default() };
    let expected = [
        AreaEvent::Extension { area, online },
        AreaEvent::MotorReached { area, motor: 3 },
        AreaEvent::Inputs { area, change },
    ];
    assert_eq!(happened, expected);
    assert_eq!(array.load(places.input).uni[2], 77);
    assert_eq!(array.load(places.change), change);
}

#[test]
fn outputs_go_out_and_inputs_come_in_for_both_kinds_of_areas() {
    outputs_go_out_and_inputs_come_in::<crate::memory::Ta>();
    outputs_go_out_and_inputs_come_in::<FishX1Transfer>();
}

/// What a command that is sent and comes back reports.
fn reported_for_a_distance<A: Area>(distance: u16) -> (Vec<AreaEvent>, [u16; 4]) {
    let array = Arc::new(AreaArray::<A>::new());
    let mut mirror = Mirror::new(Arc::clone(&array), DEV_MODE_LOCAL);
    let mut areas = vec![FishX1Transfer::default(); AREAS];
    mirror.begin(&areas);
    let places = array.places(0);
    let mut output = array.load(places.output);
    (output.distance[1], output.motor_ex_cmd_id[1]) = (distance, 1);
    array.store(places.output, output);
    mirror.put_out(&mut areas);
    areas[0].input.motor_ex_cmd_id[1] = 1;
    let mut happened = Vec::new();
    mirror.take_in(&areas, |it| happened.push(it));
    (happened, *array.load(places.input).motor_ex_reached)
}

#[test]
fn a_distance_of_0_is_reached_by_programs_for_the_txt_only() {
    use crate::memory::Ta;
    let reached = vec![AreaEvent::MotorReached { area: 0, motor: 1 }];
    assert_eq!(reported_for_a_distance::<Ta>(5), (reached.clone(), [0, 1, 0, 0]));
    assert_eq!(reported_for_a_distance::<Ta>(0), (Vec::new(), [0; 4]));
    assert_eq!(reported_for_a_distance::<FishX1Transfer>(0), (reached, [0, 1, 0, 0]));
}

#[test]
fn the_end_of_a_distance_is_not_taken_for_the_next_one_on_a_txt() {
    let array = Arc::new(AreaArray::<FishX1Transfer>::new());
    let mut mirror = Mirror::on_txt(Arc::clone(&array));
    let mut areas = vec![FishX1Transfer::default(); AREAS];
    mirror.begin(&areas);
    let places = array.places(0);
    let command = |id, distance| {
        let mut output = array.load(places.output);
        (output.motor_ex_cmd_id[0], output.distance[0]) = (id, distance);
        array.store(places.output, output);
    };
    let mut exchange = |done| {
        mirror.put_out(&mut areas);
        areas[0].input.motor_ex_cmd_id[0] = done;
        mirror.take_in(&areas, |_| {});
        array.load(places.input).motor_ex_reached[0]
    };
    command(1, 0);
    assert_eq!(exchange(1), 0, "the program waits for a cycle");
    command(2, 100);
    assert_eq!((exchange(1), exchange(1), exchange(2)), (0, 0, 1));
}

/// As with the maker's library.
#[test]
fn the_microphone_is_0_for_a_program_on_a_txt() {
    let mut areas = vec![FishX1Transfer::default(); AREAS];
    areas[0].txt_inputs2 = TxtInputs2 { mic_lin: 7, mic_log: 8 };
    let online = |array| Mirror::<FishX1Transfer>::new(array, DEV_MODE_ONLINE);
    for (mirror, heard) in [(online as fn(_) -> _, (7, 8)), (Mirror::on_txt, (0, 0))] {
        let array = Arc::new(AreaArray::new());
        let mut mirror = mirror(Arc::clone(&array));
        mirror.begin(&areas);
        mirror.take_in(&areas, |_| {});
        let TxtInputs2 { mic_lin, mic_log } = array.load(array.places(0).txt_inputs2);
        assert_eq!((mic_lin, mic_log), heard);
    }
}

/// As published programs command each distance.
#[test]
fn a_distance_is_not_reached_at_once_when_the_program_sets_its_id_back_to_0() {
    let array = Arc::new(AreaArray::<FishX1Transfer>::new());
    let mut mirror = Mirror::on_txt(Arc::clone(&array));
    let mut areas = vec![FishX1Transfer::default(); AREAS];
    mirror.begin(&areas);
    let places = array.places(0);
    let mut exchange = |id, distance, is_done| {
        let mut output = array.load(places.output);
        (output.motor_ex_cmd_id[0], output.distance[0]) = (id, distance);
        array.store(places.output, output);
        mirror.put_out(&mut areas);
        if is_done {
            areas[0].input.motor_ex_cmd_id = areas[0].output.motor_ex_cmd_id;
        }
        mirror.take_in(&areas, |_| {});
        let mut input = array.load(places.input);
        let reached = input.motor_ex_reached[0];
        input.motor_ex_reached[0] = 0;
        array.store(places.input, input);
        reached
    };
    for _ in 0..3 {
        assert_eq!(exchange(1, 0, true), 0);
        assert_eq!((exchange(0, 100, false), exchange(0, 100, false)), (0, 0), "it moves");
        assert_eq!(exchange(0, 100, true), 1);
    }
}

#[test]
fn a_command_without_a_distance_is_reached_on_a_txt() {
    let mut motor = MotorCommand::default();
    motor.begin(0, 0);
    assert_eq!(motor.send(1, 0, 0, false), (Some(1), 0));
    assert_eq!([motor.receive_on_txt(1, 1), motor.receive_on_txt(1, 1)], [(0, false), (1, true)]);
    assert_eq!(motor.send(2, 0, 40, false), (Some(2), 40));
    assert_eq!(motor.receive_on_txt(2, 2), (2, true), "a distance");
}

#[test]
fn ids_that_are_made_0_end_the_commands_and_are_not_waited_for() {
    let mut motor = MotorCommand::default();
    motor.begin(4, 4);
    motor.renew();
    assert_eq!(motor.send(0, 0, 0, false), (None, 0), "no command was given");
    assert_eq!(motor.send(7, 0, 100, false), (Some(5), 100));
    motor.renew();
    assert_eq!(motor.send(0, 0, 0, false), (Some(6), 0));
    assert_eq!(motor.receive_on_txt(5, 0), (0, false), "the distance is over");
    assert_eq!(motor.receive_on_txt(6, 0), (0, false));
    assert_eq!(motor.send(7, 0, 100, false), (Some(7), 100));
    assert_eq!(motor.receive_on_txt(6, 7), (0, false));
    assert_eq!(motor.receive_on_txt(7, 7), (7, true));
}

/// For `ftMscLib`, which sets the value 0 with the configuration.
#[test]
fn an_input_has_no_value_of_its_mode_before() {
    let array = Arc::new(AreaArray::<crate::memory::Ta>::new());
    let mut mirror = Mirror::new(Arc::clone(&array), DEV_MODE_ONLINE);
    let mut areas = vec![FishX1Transfer::default(); AREAS];
    mirror.begin(&areas);
    mirror.put_out(&mut areas);
    let places = array.places(1);
    let mut config = array.load(places.config);
    config.uni[2] = UniConfig::analog(InputMode::Ultrasonic);
    array.store(places.config, config);
    array.store(places.config_id, array.load(places.config_id) + 1);
    let mut values = |value| {
        areas[1].input.uni[2..4].fill(value);
        mirror.take_in(&areas, |_| {});
        mirror.put_out(&mut areas);
        [array.load(places.input).uni[2], array.load(places.input).uni[3]]
    };
    assert_eq!((values(77), values(40)), ([0, 77], [40, 40]));
}

#[test]
fn the_firmware_is_in_the_places_where_programs_read_it() {
    let array = Arc::new(AreaArray::<crate::memory::Ta>::new());
    let mirror = Mirror::new(Arc::clone(&array), DEV_MODE_LOCAL);
    mirror.introduce("TX2013", FirmwareVersion::new(4, 6, 6));
    // part.a to part.d, for "V %d.%02d, DLL %d" of c, d and b.
    assert_eq!(array.load(array.places(8).info).version.firmware.to_ne_bytes(), [0, 6, 4, 6]);
}
