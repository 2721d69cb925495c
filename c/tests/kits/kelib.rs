//! Programs with `KeLibTxtDl.h`.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};

use super::support::{
    command, compile, set_input, simulated, wait_duty, wait_offline, wait_stopped, wait_until,
    Running, SIGNALS,
};

fn program() -> Option<&'static PathBuf> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = include_str!("programs/kelib.cpp");
    PROGRAM.get_or_init(|| compile("txt", "c++11", source, "kelib")).as_ref()
}

/// The signal at which the program makes its next exchange.
#[cfg(unix)]
const ASK: i32 = libc::SIGUSR1;
#[cfg(not(unix))]
const ASK: i32 = libc::SIGINT;

/// Starts the program with what it should do, and waits until its motor turns.
fn started(txt: &SimulatedTxt, what: &str) -> Option<Running> {
    let mut running = Running::with(program()?, txt, &[what]);
    running.expect("started");
    Some(running)
}

#[test]
fn a_callback_answers_each_change_until_it_is_taken_away() {
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "follow") else { return };
    for _ in 0..3 {
        set_input(&txt, 0, 1);
        wait_duty(&txt, 0, 512);
        set_input(&txt, 0, 0);
        wait_duty(&txt, 0, 0);
    }
    set_input(&txt, 7, 1);
    wait_duty(&txt, 1, 77);
    set_input(&txt, 0, 1);
    set_input(&txt, 7, 0);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn a_motor_does_its_distance_and_a_sound_is_played() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["motor"]);
    running.expect("1");
    let counter = txt.with_machine(|machine| machine.controllers[0].counter[0]);
    assert!((100..110).contains(&counter), "{counter}");
    running.expect("sound");
    running.end().well();
    wait_offline(&txt);
}

/// Where a program ends so that it can send nothing, only a watchdog of the board stops its motors. It is not known
/// whether a real one has one.
fn with_watchdog(is_out_of_hand: bool) -> SimulatedTxtBuilder {
    match is_out_of_hand {
        true => simulated().board_watchdog(Duration::from_millis(500)),
        false => simulated(),
    }
}

#[test]
fn however_a_program_ends_its_motors_stop() {
    for what in ["return", "crash"] {
        let txt = with_watchdog(what == "crash").start().unwrap();
        let Some(mut running) = started(&txt, what) else { return };
        wait_duty(&txt, 0, 300);
        set_input(&txt, 0, 1);
        running.expect("input");
        let ended = running.end();
        assert_eq!(ended.code == Some(0), what == "return", "{}", ended.err);
        wait_offline(&txt);
    }
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "exit") else { return };
    assert_eq!(running.end().code, Some(3));
    wait_offline(&txt);
    let txt = with_watchdog(true).start().unwrap();
    let Some(mut running) = started(&txt, "wait") else { return };
    wait_duty(&txt, 0, 300);
    running.kill();
    wait_offline(&txt);
}

#[cfg_attr(windows, ignore = "Windows has no signals")]
#[test]
fn a_signal_ends_the_transfer_and_then_the_program() {
    for signal in SIGNALS {
        let txt = simulated().start().unwrap();
        let Some(running) = started(&txt, "turn") else { return };
        wait_duty(&txt, 0, 300);
        running.signal(signal);
        // A terminal and the one that has started the program both send it.
        running.signal(signal);
        let ended = running.end();
        assert_eq!(ended.signal, Some(signal), "{}", ended.err);
        wait_stopped(&txt);
    }
}

#[cfg_attr(windows, ignore = "Windows has no signals")]
#[test]
fn a_signal_that_the_program_handles_is_the_programs() {
    for what in ["handler first", "handler later"] {
        let txt = simulated().start().unwrap();
        let Some(mut running) = started(&txt, what) else { return };
        wait_duty(&txt, 0, 300);
        running.signal(SIGNALS[0]);
        running.expect("asked");
        wait_duty(&txt, 0, 200);
        set_input(&txt, 0, 1);
        assert_eq!(running.end().code, Some(5));
        wait_stopped(&txt);
    }
}

#[cfg_attr(windows, ignore = "Windows has no fork")]
#[test]
fn a_child_gets_errors_and_its_end_changes_nothing() {
    for (what, child) in [("fork", "7 1 300"), ("fork and signal", "15 1 300")] {
        let txt = simulated().start().unwrap();
        let Some(mut running) = started(&txt, what) else { return };
        running.expect(child);
        let ended = running.end();
        ended.well();
        assert_eq!(ended.err.matches("after fork").count(), 1, "{}", ended.err);
        wait_stopped(&txt);
        let commands = txt.with_machine(|machine| {
            machine.commands().filter(|command| *command == CommandId::StopOnline).count()
        });
        assert_eq!((commands, txt.with_machine(|machine| machine.connections())), (1, 1));
    }
}

/// Only Linux shows which threads are left.
#[cfg(target_os = "linux")]
#[test]
fn without_main_the_transfer_ends_with_the_programs_last_thread() {
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "leave") else { return };
    running.end().well();
    wait_stopped(&txt);

    // The threads of a program begin with its name.
    let Some(program) = program() else { return };
    let folder = tempfile::tempdir_in(program.parent().unwrap()).unwrap();
    for name in ["kelib", "camera", "transfer-area"] {
        let named = folder.path().join(name);
        std::fs::hard_link(program, &named).unwrap();
        let txt = simulated().start().unwrap();
        let mut running = Running::with(&named, &txt, &["leave a thread"]);
        running.expect("started");
        let before = txt.with_machine(|machine| machine.exchanges());
        wait_until(&txt, "exchanges", |machine| machine.exchanges() > before + 150);
        let duty = txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]);
        assert_eq!(duty, 300, "{name}");
        set_input(&txt, 0, 1);
        running.expect("worked");
        running.end().well();
        wait_stopped(&txt);
    }
}

#[test]
fn a_sound_with_repeat_0_is_played_once() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["sound"]);
    running.expect("0");
    running.end().well();
}

#[test]
fn a_callback_ends_the_transfer_by_false_and_by_the_call() {
    for what in ["stop", "end"] {
        let txt = simulated().start().unwrap();
        let Some(mut running) = started(&txt, what) else { return };
        running.expect("ended");
        wait_offline(&txt);
        running.end().well();
    }
}

#[test]
fn a_callback_takes_itself_away() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "away") else { return };
    wait_duty(&txt, 2, 1);
    let before = txt.with_machine(|machine| machine.exchanges());
    assert!(txt.wait_until(|machine| machine.exchanges() > before + 10, super::support::DEADLINE));
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[2]), 1);
    set_input(&txt, 0, 1);
    running.expect("input");
    running.end().well();
}

#[test]
fn a_callback_that_does_not_return_stops_the_motors_but_not_the_end() {
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "hang") else { return };
    wait_duty(&txt, 0, 300);
    set_input(&txt, 1, 1);
    wait_duty(&txt, 0, 0);
    assert!(txt.with_machine(|machine| machine.online()), "the program still runs");
    let ended = running.end();
    ended.well();
    let said = ["all outputs are off, because", "a callback of the program does not return"];
    assert!(said.iter().all(|part| ended.err.contains(part)), "{}", ended.err);
    let of_rust = ["guard", "watchdog"].map(|word| ended.err.contains(word));
    assert_eq!(of_rust, [false; 2], "{}", ended.err);
    wait_offline(&txt);
}

#[test]
fn after_a_callback_that_took_too_long_the_program_goes_on() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "block") else { return };
    wait_duty(&txt, 0, 300);
    set_input(&txt, 1, 1);
    wait_duty(&txt, 0, 0);
    wait_duty(&txt, 0, 300);
    wait_duty(&txt, 4, 100);
    set_input(&txt, 0, 1);
    running.expect("input");
    let ended = running.end();
    ended.well();
    assert!(ended.err.contains("a callback of the program took longer"), "{}", ended.err);
    assert!(ended.err.contains("the program did not return from a callback, or"), "{}", ended.err);
}

#[test]
fn a_distance_goes_on_after_a_callback_that_took_too_long() {
    // What C1 had counted when a command reset it: a busy machine may stop the motors once more.
    let (parts, mut last) = (Arc::new(Mutex::new(Vec::new())), 0);
    let counted = Arc::clone(&parts);
    let txt = simulated().on_exchange(move |machine| {
        let now = machine.controllers[0].counter[0];
        if now < last {
            counted.lock().unwrap().push(last);
        }
        last = now;
    });
    let txt = txt.start().unwrap();
    let Some(mut running) = started(&txt, "block in a distance") else { return };
    wait_until(&txt, "some pulses", |machine| machine.controllers[0].counter[0] > 20);
    set_input(&txt, 1, 1);
    wait_duty(&txt, 0, 0);
    let before = txt.with_machine(|machine| machine.controllers[0].counter);
    running.expect("1 1");
    let after = txt.with_machine(|machine| machine.controllers[0].counter);
    assert!(before[0] > 20 && before[0] < 1000, "{before:?}");
    let parts: i16 = parts.lock().unwrap().iter().sum();
    assert_eq!((parts + after[0], before[1], after[1]), (1000, 20, 20));
    set_input(&txt, 1, 0);
    running.end().well();
}

#[test]
fn duties_are_limited_and_both_outputs_of_a_motor_may_be_on() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["odd duties"]);
    running.expect("set");
    wait_until(&txt, "the duties", |machine| {
        machine.controllers[0].outputs.duty == [512, 0, 512, 0, 0, 0, 300, 200]
    });
    set_input(&txt, 7, 1);
    running.end().well();
}

#[test]
fn a_counter_that_is_reset_in_a_distance_moves_its_end() {
    let Some(program) = program() else { return };
    let turned = Arc::new(Mutex::new((0, 0)));
    let all = Arc::clone(&turned);
    let txt = simulated().on_exchange(move |machine| {
        let (now, mut turned) = (machine.controllers[0].counter[0], all.lock().unwrap());
        // After a reset it has begun at 0.
        turned.0 += if now < turned.1 { now } else { now - turned.1 };
        turned.1 = now;
    });
    let txt = txt.start().unwrap();
    let mut running = Running::with(program, &txt, &["reset in a distance"]);
    running.expect("0 1");
    running.end().well();
    assert!(turned.lock().unwrap().0 >= 250, "{turned:?}");
}

#[test]
fn nothing_stays_from_one_start_to_the_next() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["again"]);
    running.expect("1 0 1 0");
    running.expect("1 1");
    running.end().well();
    wait_stopped(&txt);
}

#[test]
fn a_start_while_it_runs_makes_all_areas_0() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["twice"]);
    running.expect("0 1 0 1");
    wait_duty(&txt, 0, 0);
    let mode = txt.with_machine(|machine| machine.controllers[0].config.uni[0].mode);
    assert_eq!(mode, 1, "a configuration goes out when its number is another");
    set_input(&txt, 7, 1);
    running.expect("1 0");
    let before = txt.with_machine(|machine| machine.controllers[0].counter[0]);
    wait_until(&txt, "turns", |machine| machine.controllers[0].counter[0] > before + 50);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.distance[0]), 0);
    set_input(&txt, 7, 0);
    running.expect("1 1");
    running.end().well();
    wait_stopped(&txt);
}

#[test]
fn a_configuration_is_sent_when_its_number_is_another() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["config"]);
    let uni = |index: usize| {
        let config = txt.with_machine(|machine| machine.controllers[0].config.uni[index]);
        (config.mode, config.digital)
    };
    let wait_mode = |mode| {
        wait_until(&txt, "the mode", |machine| machine.controllers[0].config.uni[0].mode == mode);
    };
    running.expect("not sent");
    let before = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "exchanges", |machine| machine.exchanges() > before + 3);
    assert_eq!(uni(0), (0, 0), "a voltage");
    set_input(&txt, 7, 1);
    running.expect("1");
    wait_mode(3);
    set_input(&txt, 7, 0);
    running.expect("2");
    wait_mode(1);
    assert_eq!((uni(0), uni(1), uni(2)), ((1, 1), (3, 0), (0, 0)));
    set_input(&txt, 7, 1);
    let ended = running.end();
    ended.well();
    assert!(ended.err.contains("I3 measures a voltage"), "{}", ended.err);
}

#[test]
fn a_flag_stays_until_the_program_sets_it_back() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = Running::with(program, &txt, &["flags"]);
    running.expect("stayed");
    running.end().well();
}

#[test]
fn the_battery_is_full_or_what_the_environment_says() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let host = txt.address().to_string();
    for (power, line) in [("", "8400"), ("6500", "6500"), ("9 V", "8400")] {
        let output = command(program, &host).arg("supply").env("FT_TXT_POWER", power).output();
        let output = output.unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let told = String::from_utf8_lossy(&output.stdout);
        assert_eq!(told.trim_end(), format!("{line} 40 3300 84"));
        assert_eq!(said.contains("FT_TXT_POWER"), power == "9 V", "{said}");
    }
}

#[test]
fn i2c_devices_are_read_and_written() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[0x10] = 7);
    let running = Running::with(program, &txt, &["i2c"]);
    let ended = running.end();
    ended.well();
    let lines: Vec<_> = ended.out.lines().collect();
    let expected = [
        "1703 0 0 0 0 0",
        "0",
        "0 55",
        "170F",
        "170F",
        "0 0 0 55 66",
        "170E",
        "1050",
        "0 0 0 170F",
        "1704 1703",
        "0 0",
    ];
    assert_eq!(lines, expected, "{}", ended.err);
    assert_eq!(ended.err.lines().count(), 2, "the same sentence again and again: {}", ended.err);
}

#[test]
fn the_first_start_makes_i2c_possible() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[0] = 7);
    let ended = Running::with(program, &txt, &["i2c at once"]).end();
    ended.well();
    assert_eq!(ended.out, "0\n1703\n0 0\n", "{}", ended.err);
}

/// A simulated TXT at ports whose last one may not have let them go yet.
fn back(builder: impl Fn() -> SimulatedTxtBuilder) -> SimulatedTxt {
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        match builder().start() {
            Ok(txt) => return txt,
            Err(error) => assert!(Instant::now() < deadline, "{error}"),
        }
        thread::sleep(Duration::from_millis(20));
    }
}

#[cfg_attr(windows, ignore = "Windows has no signals")]
#[test]
fn an_exchange_begins_also_without_i2c_which_goes_on_when_it_is_there() {
    let Some(program) = program() else { return };
    // Systems give these ports to nobody by themselves, so one is still free when the TXT is back.
    let mut ports = (30_000..32_000).step_by(3);
    let txt = ports.find_map(|port| simulated().port(port).start().ok()).unwrap();
    let port = txt.address().port();
    let mut running = Running::with(program, &txt, &["start after I2C"]);
    running.expect("0");
    drop(txt);
    // Nobody is at the port where the program looks for I2C.
    let without_i2c = back(|| simulated().port(port).camera_port(0).i2c_port(0));
    running.signal(ASK);
    running.expect("0 1 1703");
    drop(without_i2c);
    running.signal(ASK);
    running.expect("1C04 0 1703");
    let txt = back(|| simulated().port(port));
    running.signal(ASK);
    // The device is missing, as an I2C port has said.
    running.expect("0 1 170F");
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn to_end_a_sound_is_answered_only_if_one_plays() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let running = Running::with(program, &txt, &["end sounds"]);
    let ended = running.end();
    ended.well();
    assert_eq!(ended.out, "0 0 3 3 3 3 7 8 \n");
}

#[test]
fn a_controller_that_is_not_there_is_an_error() {
    let Some(program) = program() else { return };
    for host in ["127.0.0.1:1", "127.0.0.1:no", "nowhere.invalid"] {
        let ended = Running::start(program, host, &[]).end();
        ended.well();
        assert_eq!(ended.out, "1C04\n");
        assert!(ended.err.starts_with("ft-transfer-area: "), "{}", ended.err);
    }
}

/// What can't be written is lost, and nothing else.
#[cfg(target_os = "linux")]
#[test]
fn an_error_output_that_takes_nothing_changes_nothing() {
    let Some(program) = program() else { return };
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output = command(program, "127.0.0.1:1").stderr(full).output().unwrap();
    assert_eq!((output.status.code(), &*output.stdout), (Some(0), &b"1C04\n"[..]));
}

#[test]
fn a_controller_that_goes_away_ends_the_transfer() {
    let txt =
        simulated().fault(Fault::at_response(60, FaultKind::Close { after: 0 })).start().unwrap();
    let Some(mut running) = started(&txt, "stay") else { return };
    running.expect("ended");
    running.expect_error(&format!("the transfer with {} has ended", txt.address()));
    running.kill();
}
