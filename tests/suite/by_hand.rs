//! What a program writes into the area itself, without the calls of the TX library: duties, and more
//! configurations and commands than there are ids.

use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Counter, Motor};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area::{Exchange, FishX1Transfer, TimeLimits, TransferMode, TxtClient};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::support::{check_client, handler_for, strict};

/// A client that is online, and its exchange.
fn online(txt: &SimulatedTxt, mode: TransferMode) -> (TxtClient, Exchange) {
    let mut client = TxtClient::connect(txt.address(), TimeLimits::default()).unwrap();
    let exchange = Exchange::new(mode, client.query_status().unwrap().version);
    client.start_online().unwrap();
    (client, exchange)
}

#[test]
fn duties_out_of_range_reach_the_controller_in_range() {
    for mode in [TransferMode::Compressed, TransferMode::Simple] {
        let txt = strict().start().unwrap();
        let (mut client, mut exchange) = online(&txt, mode);
        let mut areas = [FishX1Transfer::default()];
        let written = [30_000, -32_768, -1, 513, 512, 0, 32_767, -512];
        *areas[LOCAL_IO].output.duty = written;
        client.do_transfer(&mut exchange, &mut areas).unwrap();
        let duty = txt.with_machine(|machine| machine.controllers[0].outputs.duty);
        assert_eq!(duty, [512, 0, 0, 512, 512, 0, 512, 0]);
        assert_eq!(areas[LOCAL_IO].output.duty, written);
        check_client(&txt);
    }
}

#[test]
fn areas_of_a_loop_of_ones_own_print_with_their_index() {
    let txt = strict().extensions(1).start().unwrap();
    let (mut client, mut exchange) = online(&txt, TransferMode::Compressed);
    let mut areas = [FishX1Transfer::default(); 2];
    client.do_transfer(&mut exchange, &mut areas).unwrap();
    let lines = areas.map(|area| area.to_string());
    assert!(lines[0].starts_with("Transfer ID=0 I=") && lines[1].starts_with("Transfer ID=1 I="));
    check_client(&txt);
}

#[test]
fn three_hundred_configurations_in_a_row_reach_the_controller() {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    for number in 0..300_u16 {
        let [low, high] = number.to_le_bytes();
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].config.uni[0].mode = low;
        areas[LOCAL_IO].config.uni[1].mode = high;
        areas[LOCAL_IO].raise_config_id();
        drop(areas);
        handler.areas().update_config().unwrap();
        let uni = txt.with_machine(|machine| machine.controllers[0].config.uni);
        assert_eq!([uni[0].mode, uni[1].mode], [low, high]);
    }
    // The ids go from 1 to 255, and then begin with 1 again, without 0.
    assert_eq!(handler.areas().lock()[LOCAL_IO].state.config_id, 46);
    handler.end_transfer().unwrap();
    check_client(&txt);
}

/// Gives a motor, a counter and the sound a new command each.
fn command(area: &mut FishX1Transfer) {
    area.raise_motor_ex_cmd_id(Motor::M2);
    area.start_counter_reset(Counter::C3);
    area.raise_sound_cmd_id();
    // The first one ends with the second one, and so on.
    area.txt_outputs.sound_index = 1;
    area.txt_outputs.sound_repeat = u16::MAX;
}

/// Whether these commands are done: the motor's, the counter's, the sound's.
fn done(area: &FishX1Transfer) -> [bool; 3] {
    [area.is_motor_ex_ready(Motor::M2), area.is_cnt_reset_ready(Counter::C3), area.is_sound_ready()]
}

#[test]
fn seventy_thousand_commands_in_a_row_are_each_carried_out_and_reported() {
    let mut machine = Machine::new(0);
    let mut area = FishX1Transfer::default();
    // Something plays from the beginning, so that each sound is done when it begins.
    area.txt_outputs.sound_cmd_id = 1;
    machine.set_outputs(
        0,
        ExchangeData {
            sound_command_id: u16::MAX,
            sound_index: 1,
            sound_repeat: u16::MAX,
            ..outputs(&area)
        },
    );
    for number in 0..70_000 {
        command(&mut area);
        assert_eq!(done(&area), [false; 3], "command {number} is done before it began");
        for _ in 0..2 {
            machine.set_outputs(0, outputs(&area));
            machine.step(Duration::from_millis(10));
            let report = machine.report(0).unwrap();
            *area.input.motor_ex_cmd_id = report.motor_command_id;
            *area.input.cnt_reset_cmd_id = report.counter_reset_id;
            area.txt_inputs.sound_cmd_id = report.sound_command_id;
        }
        assert_eq!(done(&area), [true; 3], "command {number} is not done");
    }
}

fn outputs(area: &FishX1Transfer) -> ExchangeData {
    ExchangeData {
        motor_command_id: *area.output.motor_ex_cmd_id,
        counter_reset_id: *area.output.cnt_reset_cmd_id,
        sound_command_id: area.txt_outputs.sound_cmd_id,
        sound_index: area.txt_outputs.sound_index,
        sound_repeat: area.txt_outputs.sound_repeat,
        ..ExchangeData::default()
    }
}

#[test]
fn commands_around_the_last_id_come_back_over_the_wire() {
    for mode in [TransferMode::Compressed, TransferMode::Simple] {
        let txt = strict().start().unwrap();
        let (mut client, mut exchange) = online(&txt, mode);
        let mut areas = [FishX1Transfer::default()];
        let area = &mut areas[LOCAL_IO];
        area.output.motor_ex_cmd_id[1] = u16::MAX - 6;
        area.output.cnt_reset_cmd_id[2] = u16::MAX - 6;
        area.txt_outputs.sound_cmd_id = u16::MAX - 6;
        command(area);
        client.do_transfer(&mut exchange, &mut areas).unwrap();
        for number in 0..10 {
            command(&mut areas[LOCAL_IO]);
            // The compressed exchange reports a counter's reset one response later.
            let exchanges = if mode == TransferMode::Compressed { 2 } else { 1 };
            for _ in 0..exchanges {
                assert_ne!(done(&areas[LOCAL_IO]), [true; 3], "command {number}");
                client.do_transfer(&mut exchange, &mut areas).unwrap();
            }
            assert_eq!(done(&areas[LOCAL_IO]), [true; 3], "command {number}");
        }
        assert_eq!(areas[LOCAL_IO].txt_outputs.sound_cmd_id, 4);
        check_client(&txt);
    }
}
