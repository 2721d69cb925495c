//! The samples: what they print on their own simulated TXT and with `txt simulate`, what
//! they do with a controller on Ctrl-C, and what they say when something is missing.

use std::fs::File;
use std::io::Write;
#[cfg(unix)]
use std::os::fd::OwnedFd;
#[cfg(unix)]
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use std::{env, fs, thread};

use ft_transfer_area::tx::Input;
use ft_transfer_area::wire::{CommandId, ExchangeData};
use ft_transfer_area_simulator::world::{Remote, World};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::checks;
use super::run::{assert_in_order, Run};
use super::sample::{quick_sorting_line, Sample, SAMPLES};
use crate::program::{ended_in_time, example, Program, DEADLINE};

#[test]
fn without_an_address_each_sample_starts_a_simulated_txt_and_ends() {
    thread::scope(|scope| {
        for Sample { name, shows, check, .. } in SAMPLES {
            scope.spawn(move || {
                let lines = Run::start(name, &[]).finish();
                assert!(lines[0].starts_with("No address is given"), "{name}: {lines:#?}");
                assert_in_order(&lines, shows);
                check(&lines);
            });
        }
    });
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn each_sample_runs_with_the_simulated_txt_in_another_terminal() {
    thread::scope(|scope| {
        for sample in SAMPLES {
            scope.spawn(move || assert_plays_with_the_program(&sample));
        }
    });
}

fn assert_plays_with_the_program(Sample { name, shows, endless, check }: &Sample) {
    let folder = tempfile::tempdir().unwrap();
    let (world, pace) = match *name {
        "sorting_line" => {
            let file = folder.path().join("line.toml");
            fs::write(&file, quick_sorting_line()).unwrap();
            (file.to_str().unwrap().to_owned(), "10")
        }
        // It has to go far, and counts cycles.
        "warehouse" => (String::from("high_bay_warehouse"), "0"),
        _ => (String::from("default"), "10"),
    };
    let program = Program::start(&["--world", &world, "--pace", pace]);
    let mut run = Run::start(name, &[&format!("127.0.0.1:{}", program.ports[0])]);
    shows.iter().for_each(|part| run.wait_for(part));
    if *endless {
        run.interrupt();
    }
    let lines = run.finish();
    assert!(!lines[0].starts_with("No address is given"), "{name}: {lines:#?}");
    check(&lines);
    let log = program.interrupt();
    assert!(log.contains("the client sends StopOnline"), "{name}: {log}");
    assert!(!log.contains(" is odd: "), "{name}: {log}");
    if ["extension", "motor_on_off_switch"].contains(name) {
        for motor in ["the master: O1", "extension 1: O1"] {
            for reported in ["is set to 512", "is set to 0"].map(|end| format!("{motor} {end}")) {
                assert!(log.contains(&reported), "{name}: no {reported:?} in {log}");
            }
        }
    }
}

#[test]
fn the_camera_sample_saves_its_pictures_in_the_folder_that_is_named() {
    let program = Program::start(&["--camera-start-up", "100"]);
    let folder = env::temp_dir().join(format!("camera-test-{}", std::process::id()));
    let (address, path) = (format!("127.0.0.1:{}", program.ports[0]), folder.to_str().unwrap());
    let lines = Run::start("camera", &[&address, path]).finish();
    assert_in_order(&lines, &[path]);
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 40);
    checks::pictures(&lines);
}

/// What a test does with the simulated TXT, so that the sample has something to stop.
struct Table {
    name: &'static str,
    /// Presses buttons.
    user: fn(&mut Machine),
    /// The outputs of master and extension that must be on after that.
    on: &'static [(usize, usize)],
}

const TABLES: [Table; 11] = [
    Table { name: "c_program", user: press_i3, on: &[(0, 4)] },
    Table { name: "extended_motor_control", user: |_| {}, on: &[(0, 0)] },
    Table { name: "extension", user: press_i1, on: &[(0, 0), (1, 0)] },
    Table { name: "infrared_remote", user: drive, on: &[(0, 1), (0, 2)] },
    Table { name: "motor_on_off_switch", user: press_i1, on: &[(0, 0), (1, 0)] },
    Table { name: "slide_on_events", user: release_i3, on: &[(0, 4)] },
    // It waits for a disc, which a dark light barrier is.
    Table { name: "sorting_line", user: |_| {}, on: &[(0, 1)] },
    Table { name: "sound_and_lamps", user: release_i3, on: &[(0, 7)] },
    // The disc has come, and does not arrive.
    Table { name: "two_models", user: |_| {}, on: &[(0, 0)] },
    // Its fork looks for its switch, which is not there.
    Table { name: "warehouse", user: |_| {}, on: &[(0, 4)] },
    Table { name: "wifi", user: |_| {}, on: &[(0, 4)] },
];

fn press_i1(machine: &mut Machine) {
    for controller in 0..2 {
        machine.world_mut().unwrap().press(controller, Input::I1, true);
    }
}

fn press_i3(machine: &mut Machine) {
    machine.world_mut().unwrap().press(0, Input::I3, true);
}

fn release_i3(machine: &mut Machine) {
    machine.world_mut().unwrap().press(0, Input::I3, false);
}

fn drive(machine: &mut Machine) {
    let remote = Remote { dip1: true, left_y: -15, right_y: 15, on: true, ..Remote::default() };
    machine.world_mut().unwrap().set_remote(remote);
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn ctrl_c_stops_the_motors_of_the_controller_that_is_named_and_goes_offline() {
    thread::scope(|scope| {
        for table in TABLES {
            scope.spawn(|| assert_stopped_by("INT", table));
        }
    });
}

#[cfg_attr(not(unix), ignore = "signals are those of Unix")]
#[test]
fn a_closed_terminal_and_sigterm_stop_the_motors_too() {
    thread::scope(|scope| {
        for (signal, table) in ["HUP", "TERM"].into_iter().zip(TABLES) {
            scope.spawn(|| assert_stopped_by(signal, table));
        }
    });
}

fn assert_stopped_by(signal: &str, Table { name, user, on }: Table) {
    let last: Arc<Mutex<Vec<ExchangeData>>> = Arc::default();
    let record = Arc::clone(&last);
    let txt = SimulatedTxt::builder()
        .world(World::default())
        .on_exchange(move |machine| {
            user(machine);
            let outputs = machine.controllers.iter().map(|controller| controller.outputs);
            *record.lock().unwrap() = outputs.collect();
        })
        .start()
        .unwrap();
    let run = Run::start(name, &[&txt.address().to_string()]);
    let is_on = |machine: &Machine, &(controller, output): &(usize, usize)| {
        machine.controllers[controller].outputs.duty[output] > 0
    };
    let all_on = |machine: &Machine| on.iter().all(|output| is_on(machine, output));
    assert!(txt.wait_until(all_on, DEADLINE), "{name} does nothing");
    run.signal(signal);
    let lines = run.finish();
    if ["c_program", "extended_motor_control", "two_models"].contains(&name) {
        assert_eq!(lines.last().unwrap(), "Stopped by Ctrl-C.", "{name} was not interrupted");
    }

    assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE), "{name}");
    let last = last.lock().unwrap();
    assert!(last.iter().all(|outputs| outputs.duty == [0; 8]), "{name}: {last:?}");
    if name == "sound_and_lamps" {
        assert_eq!(last[0].sound_index, 0, "silence");
    }
    txt.with_machine(|machine| {
        assert_eq!(machine.commands().last(), Some(CommandId::StopOnline), "{name}");
        assert_eq!(machine.oddities().next(), None, "{name}");
    });
}

/// As in a terminal that is paused by Ctrl-S. Here what it prints has room until it drives.
#[cfg(unix)]
#[test]
fn ctrl_c_stops_the_motors_while_nobody_reads_what_is_printed() {
    thread::scope(|scope| {
        for table in TABLES {
            scope.spawn(|| assert_stopped_unread(table));
        }
    });
}

#[cfg(unix)]
fn assert_stopped_unread(Table { name, user, on }: Table) {
    let world = SimulatedTxt::builder().world(World::default()).on_exchange(user);
    let txt = world.start().unwrap();
    let (unread, mut full) = UnixStream::pair().unwrap();
    let mut sample = example(name);
    sample.arg(txt.address().to_string()).stderr(Stdio::null());
    let mut sample = sample.stdout(OwnedFd::from(full.try_clone().unwrap())).spawn().unwrap();
    let all_on = |machine: &Machine| {
        let duty = |&(controller, output): &(usize, usize)| {
            machine.controllers[controller].outputs.duty[output]
        };
        on.iter().all(|place| duty(place) > 0)
    };
    let drives = txt.wait_until(all_on, DEADLINE);
    let fills = thread::spawn(move || while full.write(&[b'\n'; 4096]).is_ok() {});
    // Meanwhile it has something to print.
    let then = txt.with_machine(|machine| machine.exchanges()) + 60;
    txt.wait_until(|machine| machine.exchanges() >= then, DEADLINE);
    let goes_on = txt.with_machine(|machine| machine.online());
    let is_sent = Command::new("kill").args(["-s", "INT", &sample.id().to_string()]).status();
    let is_left = |machine: &Machine| machine.commands().last() == Some(CommandId::StopOnline);
    let is_stopped = txt.wait_until(is_left, DEADLINE);
    drop(unread);
    sample.kill().unwrap();
    sample.wait().unwrap();
    fills.join().unwrap();
    assert!(drives && goes_on && is_sent.unwrap().success(), "{name}: {drives} {goes_on}");
    assert!(is_stopped, "{name}");
}

/// A pipe to a program that has ended. On Windows a file that is only read: there a thread of this program takes what
/// comes for a pipe of Rust's.
fn unread() -> Stdio {
    if cfg!(windows) {
        return File::open(env::current_exe().unwrap()).unwrap().into();
    }
    let mut reader = Command::new(env::current_exe().unwrap());
    reader.arg("--list").stdin(Stdio::piped()).stdout(Stdio::null());
    let mut reader = reader.spawn().unwrap();
    let mut pipe = reader.stdin.take().unwrap();
    reader.wait().unwrap();
    // A program that another test starts just now has the other end, too, until it runs.
    while pipe.write_all(b"\n").is_ok() {
        thread::sleep(Duration::from_millis(1));
    }
    pipe.into()
}

/// Nobody but `main` has the handler, so a panic drops it. Here nobody reads what is printed.
#[test]
fn a_panic_in_main_stops_the_motors_too() {
    for name in ["motor_on_off_switch", "slide_on_events", "extension"] {
        let txt = SimulatedTxt::builder().start().unwrap();
        let mut sample = example(name);
        sample.arg(txt.address().to_string()).stdout(unread()).stderr(Stdio::null());
        assert!(!ended_in_time(&mut sample).wait().unwrap().success(), "{name}");
        let is_left = |machine: &Machine| machine.commands().last() == Some(CommandId::StopOnline);
        assert!(txt.wait_until(is_left, DEADLINE), "{name}");
    }
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_remote_with_other_switches_drives_nothing() {
    let txt = SimulatedTxt::builder()
        .world(World::from_toml("[[remotes]]\ndip2 = true").unwrap())
        .on_exchange(|machine| {
            let remote = Remote { dip2: true, left_y: 15, on: true, ..Remote::default() };
            machine.world_mut().unwrap().set_remote(remote);
        })
        .start()
        .unwrap();
    let run = Run::start("infrared_remote", &[&txt.address().to_string()]);
    assert!(txt.wait_until(|machine| machine.exchanges() > 50, DEADLINE));
    txt.with_machine(|machine| assert_eq!(machine.controllers[0].outputs.duty, [0; 8]));
    run.interrupt();
    let lines = run.finish();
    assert_in_order(&lines, &["left   0, right   0   OFF"]);
}

/// A world with nothing but a pressed button.
const BARE: &str = "[master.inputs]\nI1 = { button = { pressed = true } }";

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_sample_says_what_is_not_plugged_in() {
    thread::scope(|scope| {
        for (name, said, good) in [
            ("motor_on_off_switch", "pressed  none    no count    0 │ not plugged in", true),
            ("extension", "extension: not plugged in", true),
            (
                "slide_on_events",
                "The slide stands still at 0 pulses. Are M3, C3, I4 and I5 plugged in?",
                true,
            ),
            ("extended_motor_control", "Are M1 with C1 and M2 with C2 plugged in", false),
            ("wifi", "The slide does not arrive. Are M3, C3 and I4 plugged in?", false),
        ] {
            scope.spawn(move || assert_says(name, said, good));
        }
    });
}

/// Runs a sample in the bare world until it prints this. `ends_well`: it then ends without an error.
fn assert_says(name: &str, said: &str, ends_well: bool) {
    let world = World::from_toml(BARE).unwrap();
    let txt = SimulatedTxt::builder().world(world).start().unwrap();
    let mut run = Run::start(name, &[&txt.address().to_string()]);
    run.wait_for(said);
    if ends_well {
        if name != "slide_on_events" {
            run.interrupt();
        }
        run.finish();
    } else {
        run.fail();
    }
}

#[test]
fn the_i2c_sample_says_that_no_device_answers() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let output = example("i2c").arg(txt.address().to_string()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.starts_with("Error: no I2C device answers at the address 0x18"), "{message}");
}

#[test]
fn the_camera_sample_says_that_there_are_no_pictures() {
    // The sample looks for the camera at the port after the main one.
    let txt = SimulatedTxt::builder().camera_port(0).start().unwrap();
    assert_ne!(txt.camera_port(), txt.port() + 1);
    let output = example("camera").arg(txt.address().to_string()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("Is the camera plugged into the TXT's USB socket?"), "{said}");
}

#[test]
fn what_can_not_be_done_ends_in_a_sentence_and_status_1() {
    // No part of a name has more than 63 characters, so no server is asked for this name.
    let nowhere = "x".repeat(64);
    for Sample { name, .. } in SAMPLES {
        for (address, part) in [(nowhere.as_str(), "there is no host"), ("127.0.0.1:x", "port")] {
            let output = example(name).arg(address).output().unwrap();
            assert_eq!(output.status.code(), Some(1), "{name} {address}");
            let message = String::from_utf8(output.stderr).unwrap();
            assert!(message.starts_with("Error: ") && message.contains(part), "{name}: {message}");
            // A derived `Debug` would print braces.
            assert!(!message.contains('{'), "{name}: {message}");
            assert_eq!(message.lines().count(), 1, "{name} {address}: {message}");
        }
    }
}
