//! Programs with FtTxtLib's class.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

use ft_transfer_area::wire::IrRemote;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use super::support::{
    compile, set_input, simulated, wait_duty, wait_offline, wait_stopped, wait_until, Running,
    SIGNALS,
};

fn program() -> Option<&'static PathBuf> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = include_str!("programs/ex2.cpp");
    PROGRAM.get_or_init(|| compile("fttxtlib", "c++11", source, "ex2")).as_ref()
}

fn started(txt: &SimulatedTxt, what: &str) -> Option<Running> {
    let mut running = Running::with(program()?, txt, &[what]);
    running.expect("started");
    Some(running)
}

#[test]
fn callbacks_of_each_form_are_called_once_per_change_and_write_outputs() {
    for what in ["", "simple"] {
        let txt = simulated().start().unwrap();
        let Some(mut running) = started(&txt, what) else { return };
        for input in 0..3 {
            set_input(&txt, input, 1);
            running.expect(&format!("input 0:{input} 1"));
            wait_duty(&txt, 6, 100);
            set_input(&txt, input, 0);
            running.expect(&format!("input 0:{input} 0"));
            wait_duty(&txt, 7, 100);
        }
        set_input(&txt, 3, 1);
        running.expect("lambda 1");
        set_input(&txt, 7, 1);
        running.expect("input 0:7 1");
        running.expect("active");
        running.expect_area("Transfer ID=0 I=0 0 0 1 0 0 0 1 C=", " O=0-0 0-0 0-0 100-0");
        running.end().well();
        wait_offline(&txt);
    }
}

#[cfg_attr(windows, ignore = "Windows has no signals")]
#[test]
fn a_signal_ends_the_transfer_and_then_the_program() {
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 6, 100);
    running.signal(SIGNALS[1]);
    assert_eq!(running.end().signal, Some(SIGNALS[1]));
    wait_stopped(&txt);
}

#[test]
fn a_joystick_drives_two_motors() {
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "") else { return };
    let left = IrRemote { left_x: 15, left_y: -5, ..IrRemote::default() };
    txt.with_machine(|machine| machine.controllers[0].ir[3] = left);
    wait_duty(&txt, 0, 145);
    let both = IrRemote { right_x: -10, ..left };
    txt.with_machine(|machine| machine.controllers[0].ir[3] = both);
    wait_duty(&txt, 3, 100);
    set_input(&txt, 7, 1);
    running.end().well();
}

#[test]
fn calls_do_what_they_say_and_refuse_what_they_can_not() {
    let txt = simulated().start().unwrap();
    set_input(&txt, 6, 4096);
    let Some(mut running) = started(&txt, "calls") else { return };
    running.expect("reached 0 1 1");
    running.expect("reset 2 1");
    running.expect("calls");
    wait_duty(&txt, 0, 200);
    wait_duty(&txt, 4, 300);
    // What it waits for itself, I7 may have shown before.
    wait_until(&txt, "the configuration", |machine| {
        let config = &machine.controllers[0].config;
        (*config.motor, config.uni[6].mode) == ([1, 1, 0, 1], 3)
    });
    set_input(&txt, 7, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn a_distance_that_is_reached_is_told_however_soon_the_program_goes_on() {
    let source = include_str!("programs/ex2_callbacks.cpp");
    let Some(program) = compile("fttxtlib", "c++11", source, "ex2_callbacks") else { return };
    let output = Command::new(program).output().unwrap();
    assert!(output.status.success(), "{output:?}");
}

#[test]
fn frames_of_the_camera_come_in_while_the_transfer_runs() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "camera") else { return };
    (0..3).for_each(|_| running.expect("frame"));
    set_input(&txt, 7, 1);
    running.end().well();
}

#[test]
fn a_frame_of_before_a_loss_is_none_of_the_next_transfer() {
    let loss = Fault::at_response(300, FaultKind::Close { after: 0 });
    let txt = simulated().fault(loss).start().unwrap();
    let Some(running) = started(&txt, "picture") else { return };
    running.end().well();
}

#[test]
fn a_program_that_ends_without_a_stop_leaves_no_motor_on() {
    let txt = simulated().extensions(1).start().unwrap();
    let Some(running) = started(&txt, "leave") else { return };
    wait_duty(&txt, 0, 512);
    wait_until(&txt, "the extension's motor", |machine| {
        machine.controllers[1].outputs.duty[1] == 256
    });
    set_input(&txt, 4, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn a_transfer_begins_again_in_the_other_mode_with_the_same_configuration() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "again") else { return };
    set_input(&txt, 7, 1);
    running.expect("input 0:7 1");
    running.expect("active");
    while running.line() != "again" {}
    set_input(&txt, 7, 0);
    running.expect("input 0:7 0");
    let config = txt.with_machine(|machine| machine.controllers[0].config);
    assert_eq!((config.uni[5].mode, config.uni[5].digital), (0, 1));
    set_input(&txt, 7, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn an_extension_is_counted() {
    let txt = simulated().extensions(1).start().unwrap();
    let Some(running) = started(&txt, "slave") else { return };
    set_input(&txt, 7, 1);
    running.end().well();
}

#[test]
fn a_callback_may_throw_or_delete_its_handler() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "throw") else { return };
    set_input(&txt, 4, 1);
    running.expect("ended");
    wait_offline(&txt);
    let ended = running.end();
    // A transfer that has ended can't be stopped.
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let thrown = format!("{}: a callback has thrown: as a test", txt.address());
    assert!(ended.err.contains(&thrown), "{}", ended.err);

    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "delete") else { return };
    set_input(&txt, 4, 1);
    running.end().well();
    wait_offline(&txt);
}

#[cfg(unix)]
#[test]
fn the_end_by_what_a_callback_throws_waits_for_nobody_who_reads_errors() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "throw unread") else { return };
    set_input(&txt, 4, 1);
    running.expect("ended");
    wait_offline(&txt);
    assert_eq!(running.end().code, Some(0));
}

#[test]
fn after_a_callback_that_took_too_long_the_program_goes_on() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "block") else { return };
    wait_duty(&txt, 0, 300);
    set_input(&txt, 4, 1);
    wait_duty(&txt, 0, 0);
    wait_duty(&txt, 0, 300);
    set_input(&txt, 7, 1);
    running.expect("input 0:7 1");
    running.expect("active");
    let ended = running.end();
    assert!(ended.err.contains("a callback of the program took longer"), "{}", ended.err);
    ended.well();
}

#[test]
fn failures_are_codes_with_the_reason_on_the_standard_error() {
    let Some(program) = program() else { return };
    let ended = Running::start(program, "127.0.0.1:1", &[]).end();
    assert_eq!(ended.code, Some(7));
    assert!(ended.out.starts_with("e0001906\nTransfer ID=0"), "{}", ended.out);
    assert!(ended.err.contains("127.0.0.1:1"), "{}", ended.err);

    let txt =
        simulated().fault(Fault::at_response(40, FaultKind::Close { after: 0 })).start().unwrap();
    let Some(mut running) = started(&txt, "stay") else { return };
    running.expect("ended");
    running.expect_error(&format!("the transfer with {} has ended", txt.address()));
    running.kill();
}
