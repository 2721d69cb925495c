//! The recorded sessions, seen from the controller's side.
//!
//! The recordings come from the kit's own client, so the simulated TXT is tested with what a real
//! program sends.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::Value;

use ft_transfer_area::transfer_area::{Config, MAX_EXTENSIONS};
use ft_transfer_area::wire::{
    CmprHeader, ExchangeData, ExchangeDataResponse, Expander, IrRemote, QueryStatusResponse,
};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::vectors::{bytes, load, number, numbers, session_names};

/// Far longer than an answer takes.
const LIMIT: Duration = Duration::from_secs(10);

fn outputs(before: &Value) -> ExchangeData {
    let [sound_command_id, sound_index, sound_repeat] = numbers(&before["sound"]);
    ExchangeData {
        duty: numbers(&before["duty"]),
        master: numbers(&before["master"]),
        distance: numbers(&before["distance"]),
        motor_command_id: numbers(&before["motor_ex_cmd_id"]),
        counter_reset_id: numbers(&before["cnt_reset_cmd_id"]),
        sound_command_id,
        sound_index,
        sound_repeat,
    }
}

fn config(recorded: &Value) -> Config {
    let modes: [u8; 8] = numbers(&recorded["uni_mode"]);
    let digital: [u8; 8] = numbers(&recorded["uni_digital"]);
    let counters: [u8; 4] = numbers(&recorded["cnt_mode"]);
    let mut config = Config { motor: numbers(&recorded["motor"]).into(), ..Config::default() };
    for (index, input) in config.uni.iter_mut().enumerate() {
        (input.mode, input.digital) = (modes[index], digital[index]);
    }
    for (counter, mode) in config.cnt.iter_mut().zip(counters) {
        counter.mode = mode;
    }
    config
}

/// The inputs of one area as the client understood them.
fn inputs(after: &Value) -> ExchangeDataResponse {
    let mut report = ExchangeDataResponse {
        uni: numbers(&after["uni"]),
        counter_input: numbers(&after["cnt_in"]),
        counter: numbers(&after["counter"]),
        counter_reset_id: numbers(&after["cnt_reset_cmd_id"]),
        motor_command_id: numbers(&after["motor_ex_cmd_id"]),
        sound_command_id: number(&after["sound_cmd_id"]),
        ..Default::default()
    };
    for (remote, fields) in report.ir.iter_mut().zip(after["ir"].as_array().into_iter().flatten()) {
        let [left_x, _, _, left_y, _, _, right_x, _, _, right_y, _, _, buttons @ ..]: [i8; 16] =
            numbers(fields);
        let bits = (0..4).fold(0, |bits, bit| bits | (buttons[bit] as u8) << bit);
        *remote = IrRemote { left_x, left_y, right_x, right_y, bits };
    }
    report
}

/// A recorded session, and the simulated TXT at its other end.
struct Replay {
    name: String,
    recorded: Value,
    txt: SimulatedTxt,
    client: TcpStream,
}

impl Replay {
    /// Replays the packets before the first exchange.
    fn start(name: String) -> Self {
        let recorded = load(&name);
        let status = bytes(&recorded["handshake"][0]["response"]);
        let status = QueryStatusResponse::parse(&status).unwrap();
        let builder = SimulatedTxt::builder().pace(Duration::ZERO).idle_limit(Duration::MAX);
        let builder = builder.extensions(MAX_EXTENSIONS).device_name(&status.name());
        let txt = builder.firmware(status.version).start().unwrap();
        let mut client = TcpStream::connect(txt.address()).unwrap();
        client.set_read_timeout(Some(LIMIT)).unwrap();
        client.set_nodelay(true).unwrap();
        for packet in recorded["handshake"].as_array().unwrap() {
            client.write_all(&bytes(&packet["request"])).unwrap();
            let response = bytes(&packet["response"]);
            assert_eq!(receive(&mut client, response.len()), response, "{name}");
        }
        Self { name, recorded, txt, client }
    }

    /// Replays a cycle. Returns the response.
    fn exchange(&mut self, cycle: &Value) -> Vec<u8> {
        self.client.write_all(&bytes(&cycle["request"])).unwrap();
        if self.recorded["mode"] != "compressed" {
            return receive(&mut self.client, ExchangeDataResponse::LEN);
        }
        let mut response = receive(&mut self.client, CmprHeader::LEN);
        let size = CmprHeader::parse_response(&response).unwrap().extra_size;
        response.extend(receive(&mut self.client, size as usize));
        response
    }

    fn cycles(&self) -> Vec<Value> {
        self.recorded["cycles"].as_array().unwrap().clone()
    }
}

fn receive(client: &mut TcpStream, size: usize) -> Vec<u8> {
    let mut bytes = vec![0; size];
    client.read_exact(&mut bytes).unwrap();
    bytes
}

fn replays() -> impl Iterator<Item = Replay> {
    let names = session_names();
    assert!(!names.is_empty());
    names.into_iter().map(Replay::start)
}

/// The words of a compressed response.
fn expand<'a>(expander: &'a mut Expander, response: &[u8], count: usize) -> &'a [u16] {
    let (header, data) = response.split_at(CmprHeader::LEN);
    let crc = CmprHeader::parse_response(header).unwrap().crc;
    expander.expand(data, count, crc).unwrap()
}

#[test]
fn the_recorded_handshakes_are_answered_as_the_controller_did() {
    for Replay { name, recorded, txt, .. } in replays() {
        let areas = recorded["config"].as_array().unwrap();
        assert!(!areas.is_empty(), "{name}");
        for (area, known) in areas.iter().enumerate() {
            let controller = txt.with_machine(|machine| machine.controllers[area].clone());
            assert_eq!(controller.config, config(known), "{name} area {area}");
            assert_eq!(i64::from(controller.config_id), known["config_id"].as_i64().unwrap());
        }
    }
}

#[test]
fn the_recorded_outputs_are_understood() {
    for mut replay in replays() {
        let name = replay.name.clone();
        let cycles = replay.cycles();
        assert!(!cycles.is_empty(), "{name}");
        for (number, cycle) in cycles.iter().enumerate() {
            replay.exchange(cycle);
            let request = bytes(&cycle["request"]);
            let mask = CmprHeader::parse_command(&request[..CmprHeader::LEN])
                .map_or(0, |header| header.active_extensions);
            let areas = cycle["before"].as_array().unwrap();
            for (area, before) in areas.iter().enumerate() {
                if area == 0 || mask >> (area - 1) & 1 != 0 {
                    let seen = replay.txt.with_machine(|machine| machine.controllers[area].outputs);
                    assert_eq!(seen, outputs(before), "{name} cycle {number} area {area}");
                }
            }
            assert!(mask.count_ones() < areas.len() as u32, "{name} cycle {number}");
        }
        let exchanges = replay.txt.with_machine(|machine| machine.exchanges());
        assert_eq!(exchanges, cycles.len() as u64, "{name}");
    }
}

/// Both outputs of a pair at the same time do occur, and no motor is plugged in there: the recorded programs
/// chose duties at random.
#[test]
fn nothing_is_odd_in_the_recordings() {
    for mut replay in replays() {
        for cycle in replay.cycles() {
            let response = bytes(&cycle["response"]);
            let mask = CmprHeader::parse_response(&response[..CmprHeader::LEN])
                .map_or(0, |header| header.active_extensions);
            // The client had the extensions that the recorded response had.
            let alive = std::array::from_fn(|extension| mask >> extension & 1 != 0);
            replay.txt.with_machine(|machine| machine.alive = alive);
            replay.exchange(&cycle);
        }
        replay.txt.with_machine(|machine| {
            let odd: Vec<&str> = machine.oddities().collect();
            assert_eq!(odd, [""; 0], "{}", replay.name);
        });
    }
}

/// Only without extensions: recordings with extensions do not have what the remotes sent.
#[test]
fn inputs_are_sent_in_words_that_the_client_understood() {
    let of_interest = |replay: &Replay| {
        let recorded = &replay.recorded;
        recorded["mode"] == "compressed" && recorded["cycles"][0]["before"][1].is_null()
    };
    let mut replayed = 0;
    for mut replay in replays().filter(of_interest) {
        let mut expanders = [Expander::new(), Expander::new()];
        for (number, cycle) in replay.cycles().iter().enumerate() {
            let after = &cycle["after"][0];
            let has_microphone = !after["mic"].is_null();
            replay.txt.with_machine(|machine| {
                machine.alive = [false; MAX_EXTENSIONS];
                let master = &mut machine.controllers[0];
                master.report_as(Some(inputs(after)));
                if has_microphone {
                    [master.mic_lin, master.mic_log] = numbers(&after["mic"]);
                }
            });
            let response = replay.exchange(cycle);
            let count = if has_microphone { 52 } else { 50 };
            let [own, recorded] = &mut expanders;
            let own = expand(own, &response, count);
            let recorded = expand(recorded, &bytes(&cycle["response"]), count);
            assert_eq!(own, recorded, "{} cycle {number}", replay.name);
        }
        replayed += 1;
    }
    assert_eq!(replayed, 2);
}
