//! `txt selftest` against the simulated TXT: what it says, and that the controller is stopped in the end.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{FirmwareVersion, TransferAreaComHandler};
use ft_transfer_area_simulator::world::{Board, MotorModel, Sensor, World};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use serde_json::Value;

use crate::running::Running;
use crate::watch::away::{at_free_ports, started};

/// How long a step may take, however busy the computer is.
const LIMIT: Duration = Duration::from_secs(60);

/// What differs on a computer that is busy.
const TIMED: &[&str] = &[
    "start-online",
    "pace",
    "answer-after-a-pause",
    "sound-repeat-0",
    "sound-repeat-2",
    "i2c-silence",
    "silence",
    "stop-online",
    "stop-online-without-i2c",
    "camera-start",
    "camera-stop",
];

/// What the simulated TXT does in another way on purpose.
const DIFFERENT: &[&str] = &["input-15k"];

/// A controller with M1, its encoder, a button at I1, and an I2C device.
fn txt() -> SimulatedTxt {
    let board = Board::default().motor(Motor::M1, MotorModel::encoder_motor());
    let world = World::new().master(board.input(Input::I1, Sensor::BUTTON));
    let builder = SimulatedTxt::builder().firmware(FirmwareVersion::new(4, 7, 0)).world(world);
    let txt = builder.device_name("Bench").strict(true).start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[0] = 1);
    txt
}

fn selftest(host: &str, options: &[&str], file: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["selftest", host]).args(options).arg("-o").arg(file).stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

/// Asserts that it has ended with status 1 and this in its sentence.
fn fails(output: &Output, part: &str) {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(text(&output.stderr).contains(part), "{output:?}");
}

/// Reads lines until one begins with this name.
fn row(running: &Running, name: &str) -> String {
    loop {
        let line = running.line();
        if line.starts_with(name) {
            return line;
        }
    }
}

/// Nothing moves, and nobody is online any more.
fn assert_stopped(txt: &SimulatedTxt) {
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    txt.with_machine(|machine| assert_eq!(machine.area(0).output.duty, [0; 8]));
}

#[test]
fn each_check_has_a_row_and_no_output_is_switched_on() {
    let (txt, folder) = (txt(), tempfile::tempdir().unwrap());
    let file = folder.path().join("result.json");
    let output = selftest(&txt.address().to_string(), &["--json"], &file).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let result = json(&output.stdout);
    assert_eq!(json(&fs::read(&file).unwrap()), result);
    assert_eq!((&result["name"], &result["motors"]), (&Value::from("Bench"), &Value::from(false)));
    assert_eq!(result["ended_early"], Value::Null);
    let checks = result["checks"].as_array().unwrap();
    let results = |wanted: &str| {
        let rows = checks.iter().filter(|row| row["result"] == wanted);
        rows.map(|row| row["check"].as_str().unwrap()).collect::<Vec<_>>()
    };
    let may_differ = |name: &&str| TIMED.contains(name);
    let unexpected: Vec<_> =
        results("differs").into_iter().filter(|row| !may_differ(row)).collect();
    assert_eq!(unexpected, DIFFERENT, "{result:#}");
    let left_out = checks.iter().filter(|row| row["result"] == "not tried");
    for row in left_out {
        let why = row["seen"].as_str().unwrap();
        assert!(["it needs --motors", "it needs --crash"].contains(&why), "{row:#}");
    }
    assert!(results("as the firmware does").len() > 20, "{result:#}");
    let pace = checks.iter().find(|row| row["check"] == "pace").unwrap();
    assert!(pace["values"]["median_ms"].as_f64().unwrap() > 0.0, "{pace:#}");
    assert_stopped(&txt);
    txt.with_machine(|machine| assert_eq!(machine.area(0).input.counter[0], 0, "M1 has turned"));
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn m1_is_measured_and_ctrl_c_stops_it() {
    let (txt, folder) = (txt(), tempfile::tempdir().unwrap());
    let file = folder.path().join("result.json");
    let host = txt.address().to_string();
    let mut command = selftest(&host, &["--motors", "--yes"], &file);
    let running = Running::start(command.stderr(Stdio::piped()));
    assert_eq!(running.line(), "Bench, firmware 4.7.0");
    for name in ["m1-turns", "m1-distance ", "m1-distance-half-duty", "counter-reset"] {
        let row = row(&running, name);
        assert!(row.contains("  as the firmware does: "), "{row}");
    }
    // Nobody is there, and M1 turns on.
    let is_left = |machine: &Machine| machine.area(0).output.duty[0] != 0 && !machine.online();
    assert!(txt.wait_until(is_left, LIMIT));
    running.signal("INT");
    fails(&running.end(), "interrupted");
    assert_stopped(&txt);
    txt.with_machine(|machine| {
        assert_eq!(machine.commands().next_back(), Some(CommandId::StopOnline));
    });
    let result = json(&fs::read(&file).unwrap());
    assert_eq!(result["ended_early"], "interrupted");
    assert_eq!(result["checks"][0]["check"], "query-status");
}

#[test]
fn m1_is_stopped_when_the_program_is_killed() {
    let (txt, folder) = (txt(), tempfile::tempdir().unwrap());
    let host = txt.address().to_string();
    let file = folder.path().join("result.json");
    let running = Running::start(&mut selftest(&host, &["--motors", "--yes"], &file));
    // What needs no motor comes first, and takes a minute.
    let turns = |machine: &Machine| machine.area(0).output.duty[0] != 0;
    assert!(txt.wait_until(turns, 3 * LIMIT));
    drop(running);
    // What it leaves behind connects anew.
    let is_left = |machine: &Machine| !machine.connected() && machine.area(0).output.duty == [0; 8];
    assert!(txt.wait_until(is_left, LIMIT));
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_pressed_button_keeps_m1_still() {
    let (txt, folder) = (txt(), tempfile::tempdir().unwrap());
    let file = folder.path().join("result.json");
    txt.with_machine(|machine| machine.world_mut().unwrap().press(0, Input::I1, true));
    let host = txt.address().to_string();
    let mut command = selftest(&host, &["--motors", "--yes"], &file);
    let running = Running::start(command.stderr(Stdio::piped()));
    for name in ["m1-turns", "m1-after-stop-online"] {
        let row = row(&running, name);
        assert!(row.ends_with("not tried: the button at I1 is pressed"), "{row}");
    }
    txt.with_machine(|machine| assert_eq!(machine.area(0).input.counter[0], 0, "M1 has turned"));
    running.signal("INT");
    fails(&running.end(), "interrupted");
    assert_stopped(&txt);
}

#[test]
fn a_controller_that_goes_away_is_reported() {
    // No other test's controller answers there later.
    let txt = at_free_ports(|port| SimulatedTxt::builder().port(port));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("result.json");
    let host = txt.address().to_string();
    let running = Running::start(selftest(&host, &[], &file).stderr(Stdio::piped()));
    row(&running, "query-status");
    drop(txt);
    fails(&running.end(), "does not answer any more, or another program is online on it");
    let result = json(&fs::read(&file).unwrap());
    let last =
        result["checks"].as_array().unwrap().iter().rfind(|row| row["check"] == "camera-late");
    assert_eq!(last.unwrap()["result"], "not tried");
}

#[test]
fn another_controller_that_takes_the_address_ends_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("result.json");
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("FIRST"));
    let (host, port) = (first.address().to_string(), first.port());
    let running = Running::start(selftest(&host, &[], &file).stderr(Stdio::piped()));
    row(&running, "query-status");
    drop(first);
    let _second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
    fails(&running.end(), "another controller has this address now: SECOND, firmware ");
    let result = json(&fs::read(&file).unwrap());
    assert_eq!(result["name"], "FIRST");
    assert!(result["ended_early"].as_str().unwrap().contains("SECOND"), "{result}");
}

#[test]
fn it_asks_before_a_motor_turns_and_keeps_a_file() {
    let (txt, folder) = (txt(), tempfile::tempdir().unwrap());
    let file = folder.path().join("result.json");
    let host = txt.address().to_string();
    let output = selftest(&host, &["--motors"], &file).output().unwrap();
    fails(&output, "--motors asks a question; --yes answers it");
    fs::write(&file, "kept").unwrap();
    fails(&selftest(&host, &[], &file).output().unwrap(), "it is there already; --force");
    assert_eq!(fs::read(&file).unwrap(), b"kept");
    txt.with_machine(|machine| assert_eq!(machine.connections(), 0));
}

#[test]
fn without_a_controller_that_is_free_there_is_no_file() {
    let (txt, folder) = (txt(), tempfile::tempdir().unwrap());
    let file = folder.path().join("result.json");
    let handler = TransferAreaComHandler::builder(txt.address().to_string()).build().unwrap();
    handler.begin_transfer().unwrap();
    // No program gets the other port by chance.
    for host in [txt.address().to_string(), "127.0.0.1:1".to_owned()] {
        fails(&selftest(&host, &[], &file).output().unwrap(), "is no other program online");
        assert!(!file.exists());
    }
    handler.end_transfer().unwrap();
}
