//! The simulated TXT does in the golden sessions what the maker's firmware did.

mod session;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;
use std::{fs, thread};

use ft_transfer_area::FirmwareVersion;
use ft_transfer_area_simulator::SimulatedTxt;
use session::{run, Board, Controller, Outcome, Packets};

/// How many sessions take place at once. Most of them wait most of the time.
const AT_ONCE: usize = 24;

/// The folder with the sessions of a version, and this version.
fn versions() -> [(&'static str, FirmwareVersion); 1] {
    [("4.7.0", FirmwareVersion::new(4, 7, 0))]
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("vectors/firmware")
}

/// What is plugged in at the simulated TXT.
struct Simulated {
    txt: SimulatedTxt,
    /// The number of exchanges at `frames 0`.
    frames: u64,
}

impl Simulated {
    fn start(firmware: FirmwareVersion) -> Self {
        // The board of the firmware has no motors, so nothing is counted.
        let builder = SimulatedTxt::builder()
            .firmware(firmware)
            .strict(true)
            .extensions(1)
            .camera_start_up(Duration::ZERO)
            .on_exchange(|machine| {
                for controller in &mut machine.controllers {
                    (controller.counter, controller.counter_input) = ([0; 4], [0; 4]);
                }
            });
        let txt = builder.start().unwrap();
        txt.with_machine(|machine| machine.alive[0] = false);
        Self { txt, frames: 0 }
    }

    fn controller(&self) -> Controller {
        Controller {
            ip: self.txt.address().ip(),
            main: self.txt.port(),
            camera: self.txt.camera_port(),
            i2c: self.txt.i2c_port(),
        }
    }
}

impl Simulated {
    /// The mode of each input, and whether it is digital.
    fn modes(&self) -> String {
        let uni = self.txt.with_machine(|machine| machine.controllers[0].config.uni);
        uni.map(|uni| format!("{}{}", uni.mode, uni.digital)).join(" ")
    }
}

impl Board for Simulated {
    fn command(&mut self, command: &str) -> Option<String> {
        let duty = |index: usize| {
            let duty = self.txt.with_machine(|machine| machine.controllers[index].board_duty());
            duty.map(|duty| duty.to_string()).join(" ")
        };
        let exchanges = self.txt.with_machine(|machine| machine.exchanges());
        match command {
            "extensions 0" | "extensions 1" => {
                self.txt.with_machine(|machine| machine.alive[0] = command.ends_with('1'));
            }
            "i2c 24" => drop(self.txt.with_machine(|machine| *machine.i2c_device(24))),
            "frames 0" => self.frames = exchanges,
            "camera" => {}
            "frames" => return Some((exchanges - self.frames).to_string()),
            "modes" => return Some(self.modes()),
            "duty" => return Some(duty(0)),
            "duty 1" => return Some(duty(1)),
            _ => return None,
        }
        Some(String::from("ok"))
    }
}

#[test]
fn the_simulated_txt_does_in_each_session_what_the_firmware_did() {
    let packets = Packets::load(&folder().join("packets.txt")).unwrap();
    for (version, firmware) in versions() {
        let entries = fs::read_dir(folder().join(version)).unwrap();
        let files = Mutex::new(entries.map(|entry| entry.unwrap().path()).collect::<Vec<_>>());
        assert!(files.lock().unwrap().len() >= 60, "sessions of {version}");
        let failures = Mutex::new(Vec::new());
        let next = || files.lock().unwrap().pop();
        let play_all = || {
            while let Some(file) = next() {
                if let Err(why) = play(&file, &packets, firmware) {
                    failures.lock().unwrap().push(format!("{}: {why}", file.display()));
                }
            }
        };
        thread::scope(|scope| (0..AT_ONCE).for_each(|_| drop(scope.spawn(play_all))));
        let failures = failures.into_inner().unwrap();
        assert!(failures.is_empty(), "{}", failures.join("\n"));
    }
}

fn play(file: &Path, packets: &Packets, firmware: FirmwareVersion) -> Result<(), String> {
    let text = fs::read_to_string(file).map_err(|error| error.to_string())?;
    let mut board = Simulated::start(firmware);
    let controller = board.controller();
    match run(&text, packets, controller, &mut board, &mut Vec::new())? {
        Outcome::Same => Ok(()),
        Outcome::Skipped => Err("the simulated board lacks something".into()),
    }
}
