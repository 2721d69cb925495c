//! The exchange compared with recorded sessions: each byte is the one that the kit's client sends, and
//! each field of the areas has the same value afterwards.

use std::fmt::Debug;

use ft_transfer_area::transfer_area::{Config, IrInput};
use ft_transfer_area::wire::{CommandId, QueryStatusResponse, StartOnline};
use ft_transfer_area::{Exchange, FishX1Transfer, TransferMode};
use serde_json::Value;

use crate::vectors::{self, bytes, number, numbers};

#[test]
fn every_recorded_session_replays_byte_for_byte() {
    let names = vectors::session_names();
    assert!(!names.is_empty(), "no recorded sessions");
    for name in names {
        replay(&name, &vectors::load(&name));
    }
}

fn replay(name: &str, session: &Value) {
    let mut areas: Vec<FishX1Transfer> =
        session["config"].as_array().unwrap().iter().map(configured_area).collect();
    assert_eq!(areas.len(), number::<usize>(&session["areas"]), "{name}: areas");
    let mut exchange = replay_handshake(name, session, &areas);
    for (cycle, recorded) in session["cycles"].as_array().unwrap().iter().enumerate() {
        let place = format!("{name}, cycle {cycle}");
        for (area, before) in areas.iter_mut().zip(recorded["before"].as_array().unwrap()) {
            set_outputs(area, before);
        }
        let mut request = Vec::new();
        exchange.request(&areas, &mut request).unwrap();
        assert_eq!(request, bytes(&recorded["request"]), "{place}: request");
        let inputs = exchange.receive(&bytes(&recorded["response"]));
        inputs.unwrap_or_else(|error| panic!("{place}: {error}")).apply(&mut areas);
        let master = areas[0];
        for (index, after) in recorded["after"].as_array().unwrap().iter().enumerate() {
            let place = format!("{place}, area {index}");
            check_inputs(&place, &areas[index], after);
            if index > 0 {
                let alive = master.state.io_slave_alive[index - 1];
                assert_eq!(alive, number::<u8>(&after["alive"]), "{place}: alive");
            }
        }
    }
}

/// Checks our packets before the first exchange and returns the exchange that follows them.
fn replay_handshake(name: &str, session: &Value, areas: &[FishX1Transfer]) -> Exchange {
    let recorded = session["handshake"].as_array().unwrap();
    let status = QueryStatusResponse::parse(&bytes(&recorded[0]["response"])).unwrap();
    assert_eq!(status.version.to_string(), session["firmware"].as_str().unwrap(), "{name}");
    let mode = match session["mode"].as_str().unwrap() {
        "simple" => TransferMode::Simple,
        _ => TransferMode::Compressed,
    };
    let mut exchange = Exchange::new(mode, status.version);

    let mut sent = vec![Vec::new(), Vec::new()];
    CommandId::QueryStatus.emit(&mut sent[0]);
    StartOnline::new().emit(&mut sent[1]);
    while let Some(update) = exchange.next_update_config(areas) {
        let mut packet = Vec::new();
        update.emit(&mut packet);
        sent.push(packet);
    }
    let mut requests: Vec<Vec<u8>> =
        recorded.iter().map(|packet| bytes(&packet["request"])).collect();
    // One of the recorded clients asks for the status twice; once is enough.
    requests.dedup();
    assert_eq!(sent, requests, "{name}: handshake");
    exchange
}

fn configured_area(recorded: &Value) -> FishX1Transfer {
    let mut area = FishX1Transfer::default();
    let Config { motor, uni, cnt, .. } = &mut area.config;
    **motor = numbers(&recorded["motor"]);
    let modes: [u8; 8] = numbers(&recorded["uni_mode"]);
    let digital: [u8; 8] = numbers(&recorded["uni_digital"]);
    for (i, input) in uni.iter_mut().enumerate() {
        input.mode = modes[i];
        input.digital = digital[i];
    }
    let modes: [u8; 4] = numbers(&recorded["cnt_mode"]);
    for (counter, mode) in cnt.iter_mut().zip(modes) {
        counter.mode = mode;
    }
    area.state.config_id = number(&recorded["config_id"]);
    area
}

fn set_outputs(area: &mut FishX1Transfer, before: &Value) {
    *area.output.duty = numbers(&before["duty"]);
    *area.output.master = numbers(&before["master"]);
    *area.output.distance = numbers(&before["distance"]);
    *area.output.motor_ex_cmd_id = numbers(&before["motor_ex_cmd_id"]);
    *area.output.cnt_reset_cmd_id = numbers(&before["cnt_reset_cmd_id"]);
    let [command, index, repeat] = numbers(&before["sound"]);
    area.txt_outputs.sound_cmd_id = command;
    area.txt_outputs.sound_index = index;
    area.txt_outputs.sound_repeat = repeat;
    *area.input.motor_ex_reached = numbers(&before["in_motor_ex_reached"]);
    *area.input.cnt_resetted = numbers(&before["in_cnt_resetted"]);
}

fn check_inputs(place: &str, area: &FishX1Transfer, after: &Value) {
    let input = &area.input;
    check(&format!("{place}: uni"), *input.uni, &after["uni"]);
    check(&format!("{place}: cnt_in"), *input.cnt_in, &after["cnt_in"]);
    check(&format!("{place}: counter"), *input.counter, &after["counter"]);
    check(&format!("{place}: cnt_resetted"), *input.cnt_resetted, &after["cnt_resetted"]);
    check(&format!("{place}: reached"), *input.motor_ex_reached, &after["motor_ex_reached"]);
    check(&format!("{place}: reset id"), *input.cnt_reset_cmd_id, &after["cnt_reset_cmd_id"]);
    check(&format!("{place}: motor id"), *input.motor_ex_cmd_id, &after["motor_ex_cmd_id"]);
    let sound = area.txt_inputs.sound_cmd_id;
    assert_eq!(sound, number::<u16>(&after["sound_cmd_id"]), "{place}: sound");
    if let Some(mic) = after.get("mic") {
        let microphone = [area.txt_inputs2.mic_lin, area.txt_inputs2.mic_log];
        check(&format!("{place}: microphone"), microphone, mic);
    }
    if let Some(remotes) = after.get("ir") {
        let remotes = remotes.as_array().unwrap();
        assert_eq!(remotes.len(), area.txt_inputs.ir_input.len(), "{place}: remotes");
        for (remote, recorded) in area.txt_inputs.ir_input.iter().zip(remotes) {
            check(&format!("{place}: infrared"), ir_fields(remote), recorded);
        }
    }
}

fn check<T: TryFrom<i64> + PartialEq + Debug, const N: usize>(
    place: &str,
    found: [T; N],
    recorded: &Value,
) {
    assert_eq!(found, numbers(recorded), "{place}");
}

/// The fields in the order of the C struct.
fn ir_fields(remote: &IrInput) -> [i16; 16] {
    let IrInput { joy_left_x, joy_left_y, joy_right_x, joy_right_y, .. } = *remote;
    let unsigned = [
        remote.joy_left_x_to_left,
        remote.joy_left_x_to_right,
        remote.joy_left_y_to_forward,
        remote.joy_left_y_to_backwards,
        remote.joy_right_x_to_left,
        remote.joy_right_x_to_right,
        remote.joy_right_y_to_forward,
        remote.joy_right_y_to_backwards,
        remote.button_on,
        remote.button_off,
        remote.dip_switch_1,
        remote.dip_switch_2,
    ];
    let [ll, lr, lf, lb, rl, rr, rf, rb, on, off, d1, d2] = unsigned.map(|value| value as i16);
    [
        joy_left_x,
        ll,
        lr,
        joy_left_y,
        lf,
        lb,
        joy_right_x,
        rl,
        rr,
        joy_right_y,
        rf,
        rb,
        on,
        off,
        d1,
        d2,
    ]
}
