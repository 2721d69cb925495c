//! The recorded sessions, seen from the controller's side.
//!
//! The recordings come from the kit's own client, so the simulated TXT is tested with what a real
//! program sends.

use std::path::PathBuf;
use std::{env, fs};

use serde_json::Value;

use crate::machine::Machine;
use crate::server::command::command_size;
use crate::server::protocol::{Protocol, Script, Settings};
use crate::server::words;
use ft_transfer_area::transfer_area::{Config, MAX_EXTENSIONS};
use ft_transfer_area::wire::{
    CmprHeader, ExchangeData, ExchangeDataResponse, Expander, IrRemote, QueryStatusResponse,
};
use ft_transfer_area::FirmwareVersion;

/// The recorded sessions and their file names.
fn sessions() -> Vec<(String, Value)> {
    let folder = env::var_os("TRANSFER_AREA_VECTORS").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/vectors")),
        PathBuf::from,
    );
    let mut sessions = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if name.starts_with("session_") {
            let text = fs::read_to_string(entry.path()).unwrap();
            sessions.push((name, serde_json::from_str(&text).unwrap()));
        }
    }
    assert!(!sessions.is_empty());
    sessions
}

fn bytes(hex: &Value) -> Vec<u8> {
    let hex = hex.as_str().unwrap();
    let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(byte).collect()
}

fn numbers<T: TryFrom<i64>, const N: usize>(list: &Value) -> [T; N] {
    let list = list.as_array().unwrap();
    assert_eq!(list.len(), N);
    std::array::from_fn(|index| {
        let number = list[index].as_i64().unwrap();
        T::try_from(number).unwrap_or_else(|_| panic!("{number} is out of range"))
    })
}

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
    let mut config = Config { motor: numbers(&recorded["motor"]), ..Config::default() };
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
        sound_command_id: u16::try_from(after["sound_cmd_id"].as_u64().unwrap()).unwrap(),
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

/// The simulated TXT at the other end of a recorded session.
struct Replay {
    machine: Machine,
    protocol: Protocol,
    script: Script,
}

impl Replay {
    fn new(recorded: &Value) -> Self {
        let status = bytes(&recorded["handshake"][0]["response"]);
        let QueryStatusResponse { device_name, version: firmware } =
            QueryStatusResponse::parse(&status).unwrap();
        let microphone = firmware >= FirmwareVersion::WITH_MICROPHONE;
        let settings = Settings { device_name, firmware, microphone };
        Self {
            machine: Machine::new(MAX_EXTENSIONS),
            protocol: Protocol::new(settings),
            script: Box::new(|_| {}),
        }
    }

    fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        // The simulated TXT would read exactly this packet from the stream.
        assert_eq!(command_size(request), Ok(request.len()));
        let mut out = Vec::new();
        self.protocol.answer(request, &mut self.machine, &mut self.script, &mut out).unwrap();
        out
    }

    /// Replays the packets before the first exchange.
    fn handshake(&mut self, recorded: &Value) {
        for packet in recorded["handshake"].as_array().unwrap() {
            let answer = self.answer(&bytes(&packet["request"]));
            assert_eq!(answer, bytes(&packet["response"]));
        }
    }
}

#[test]
fn the_recorded_handshakes_are_answered_as_the_controller_did() {
    for (name, recorded) in sessions() {
        let mut replay = Replay::new(&recorded);
        replay.handshake(&recorded);
        let areas = recorded["config"].as_array().unwrap();
        assert!(!areas.is_empty(), "{name}");
        for (area, (known, controller)) in areas.iter().zip(&replay.machine.controllers).enumerate()
        {
            assert_eq!(controller.config, config(known), "{name} area {area}");
            assert_eq!(i64::from(controller.config_id), known["config_id"].as_i64().unwrap());
        }
    }
}

#[test]
fn the_recorded_outputs_are_understood() {
    for (name, recorded) in sessions() {
        let mut replay = Replay::new(&recorded);
        replay.handshake(&recorded);
        let cycles = recorded["cycles"].as_array().unwrap();
        assert!(!cycles.is_empty(), "{name}");
        for (number, cycle) in cycles.iter().enumerate() {
            let request = bytes(&cycle["request"]);
            replay.answer(&request);
            let mask = CmprHeader::parse_command(&request[..CmprHeader::LEN])
                .map_or(0, |header| header.active_extensions);
            let areas = cycle["before"].as_array().unwrap();
            for (area, before) in areas.iter().enumerate() {
                if area == 0 || mask >> (area - 1) & 1 != 0 {
                    let seen = replay.machine.controllers[area].outputs;
                    assert_eq!(seen, outputs(before), "{name} cycle {number} area {area}");
                }
            }
            assert!(mask.count_ones() < areas.len() as u32, "{name} cycle {number}");
        }
        assert_eq!(replay.machine.exchanges(), cycles.len() as u64, "{name}");
    }
}

/// Both outputs of a motor at the same time do occur: the recorded programs chose duties at random.
#[test]
fn only_a_motor_both_ways_is_odd_in_the_recordings() {
    for (name, recorded) in sessions() {
        let mut replay = Replay::new(&recorded);
        replay.handshake(&recorded);
        for cycle in recorded["cycles"].as_array().unwrap() {
            let response = bytes(&cycle["response"]);
            let mask = CmprHeader::parse_response(&response[..CmprHeader::LEN])
                .map_or(0, |header| header.active_extensions);
            // The client had the extensions that the recorded response had.
            replay.machine.alive = std::array::from_fn(|extension| mask >> extension & 1 != 0);
            replay.answer(&bytes(&cycle["request"]));
        }
        let both_ways = |sentence: &str| sentence.ends_with(" at the same time");
        let odd: Vec<&str> = replay.machine.oddities().filter(|odd| !both_ways(odd)).collect();
        assert_eq!(odd, [""; 0], "{name}");
    }
}

/// Only without extensions: recordings with extensions do not have what the remotes sent.
#[test]
fn inputs_are_sent_in_words_that_the_client_understood() {
    let of_interest = |recorded: &Value| {
        recorded["mode"] == "compressed" && recorded["cycles"][0]["before"][1].is_null()
    };
    let mut replayed = 0;
    for (name, recorded) in sessions().into_iter().filter(|(_, recorded)| of_interest(recorded)) {
        let mut expander = Expander::new();
        for (number, cycle) in recorded["cycles"].as_array().unwrap().iter().enumerate() {
            let after = &cycle["after"][0];
            let mut words = Vec::new();
            words::push_inputs(&inputs(after), &mut words);
            if !after["mic"].is_null() {
                words.extend(numbers::<u16, 2>(&after["mic"]));
            }
            let response = bytes(&cycle["response"]);
            let (header, data) = response.split_at(CmprHeader::LEN);
            let crc = CmprHeader::parse_response(header).unwrap().crc;
            let expanded = expander.expand(data, words.len(), crc).unwrap();
            assert_eq!(expanded, words, "{name} cycle {number}");
        }
        replayed += 1;
    }
    assert_eq!(replayed, 2);
}
