//! The golden sessions again, so that their data stay true.

use std::fs;
use std::path::{Path, PathBuf};

use ft_transfer_area::transfer_area::DUTY_MAX;
use ft_transfer_area_simulator::Machine;

use super::{no_i2c_server_waits, wait_until, Check, ADDRESS};
use crate::board::Board;
use crate::controller;
use crate::session::{self, Outcome, Packets};

/// The sessions of the version that runs here.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../vectors/firmware/4.7.0");

pub(super) fn checks() -> impl Iterator<Item = (String, Check)> {
    let files =
        fs::read_dir(FOLDER).expect("the folder of the sessions").map(|file| file.unwrap().path());
    let mut files: Vec<PathBuf> = files.collect();
    files.sort();
    files.into_iter().map(|file| {
        let name = format!("session: {}", file.file_stem().unwrap_or_default().to_string_lossy());
        let check: Check = Box::new(move |controller| run(controller, &file));
        (name, check)
    })
}

fn run(controller: &controller::Controller, file: &Path) {
    // Nothing is plugged in, and all inputs are 0.
    controller.board.plug_in(Machine::new(0), true);
    let ip = ADDRESS.parse().unwrap();
    let address = session::Controller { ip, main: 65_000, camera: 65_001, i2c: 65_002 };
    settle(&address);
    let packets = Packets::load(&Path::new(FOLDER).join("../packets.txt")).unwrap();
    let mut plugs = Plugs { board: controller.board.clone(), first_frame: 0 };
    let text = fs::read_to_string(file).unwrap();
    let outcome = session::run(&text, &packets, address, &mut plugs, &mut Vec::new());
    settle(&address);
    assert_eq!(outcome, Ok(Outcome::Same));
    // The program is back, so it has ended.
    if text.lines().any(|line| line.starts_with("back ")) {
        controller.expect_end();
    }
}

/// Ends what a session leaves behind.
fn settle(address: &session::Controller) {
    no_i2c_server_waits();
    wait_until("the program answers", || address.answers());
}

/// What a session plugs in, and asks about the board.
struct Plugs {
    board: Board,
    /// The number of frames that are not counted.
    first_frame: u64,
}

impl session::Board for Plugs {
    fn command(&mut self, command: &str) -> Option<String> {
        let words: Vec<&str> = command.split(' ').collect();
        let mut state = self.board.state();
        match words[..] {
            ["extensions", count] => {
                state.machine = Machine::new(count.parse().ok()?);
            }
            ["i2c", address] => {
                let registers = state.machine.i2c_device(address.parse().ok()?);
                registers[0] = 0xFA;
            }
            // There always is one.
            ["camera"] => {}
            ["frames", "0"] => self.first_frame = state.frames,
            ["frames"] => return Some((state.frames - self.first_frame).to_string()),
            ["modes"] => return Some(modes(&state.machine)),
            ["duty"] => return Some(bytes(state.machine.controllers[0].outputs.duty)),
            ["duty", number] => {
                let controller: usize = number.parse().ok()?;
                return Some(bytes(state.machine.controllers.get(controller)?.outputs.duty));
            }
            _ => return None,
        }
        Some(String::from("done"))
    }
}

/// The mode of each input, and whether it is digital.
fn modes(machine: &Machine) -> String {
    let uni = machine.controllers[0].config.uni;
    uni.map(|uni| format!("{}{}", uni.mode, uni.digital)).join(" ")
}

/// Duties as the board gets them.
fn bytes(duty: [i16; 8]) -> String {
    let bytes = duty.map(|duty| if duty == DUTY_MAX { 255 } else { duty / 2 }.to_string());
    bytes.join(" ")
}
