//! Programs with the classes of kit 4.6.6.

use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, UniConfig};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};

use super::support::{
    compile, set_input, simulated, wait_duty, wait_offline, wait_stopped, wait_until, Running,
};

fn program() -> Option<&'static PathBuf> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = include_str!("programs/kit466.cpp");
    // As the documents say it for a program with folders before the names.
    PROGRAM.get_or_init(|| compile("kit466/Common", "c++11", source, "kit466")).as_ref()
}

fn begun(txt: &SimulatedTxt, what: &str) -> Option<Running> {
    let mut running = Running::with(program()?, txt, &[what]);
    running.expect("begun");
    Some(running)
}

#[test]
fn a_loop_answers_inputs_in_either_exchange() {
    for what in ["loop", "simple"] {
        let txt = simulated().start().unwrap();
        let Some(mut running) = begun(&txt, what) else { return };
        let config = txt.with_machine(|machine| machine.controllers[0].config);
        assert_eq!(config.uni[1], UniConfig::analog(InputMode::Voltage));
        set_input(&txt, 0, 1);
        wait_duty(&txt, 0, 512);
        set_input(&txt, 0, 0);
        wait_duty(&txt, 0, 0);
        set_input(&txt, 7, 1);
        running.expect_area("Transfer ID=0 I=0 0 0 0 0 0 0 1 C=", " O=0-0 0-0 0-0 0-0");
        running.end().well();
        wait_offline(&txt);
    }
}

#[test]
fn a_thread_exchanges_while_the_program_reads_and_writes_the_areas() {
    let txt = simulated().extensions(1).start().unwrap();
    let Some(mut running) = begun(&txt, "") else { return };
    for _ in 0..2 {
        set_input(&txt, 0, 1);
        wait_duty(&txt, 0, 512);
        set_input(&txt, 0, 0);
        wait_duty(&txt, 0, 0);
    }
    txt.with_machine(|machine| machine.controllers[1].uni[0] = 1);
    wait_until(&txt, "the extension's motor", |machine| {
        machine.controllers[1].outputs.duty[1] == 256
    });
    set_input(&txt, 6, 1);
    wait_until(&txt, "the new configuration", |machine| {
        machine.controllers[0].config.motor == [1, 1, 1, 0]
    });
    set_input(&txt, 7, 1);
    running.expect("runs");
    // The destructor has ended it.
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn flags_that_a_program_sets_back_stay_so_until_the_command_is_done() {
    let txt = simulated().start().unwrap();
    // The controller remembers the ids of the program before.
    for _ in 0..2 {
        let Some(mut running) = begun(&txt, "commands") else { return };
        running.expect("commands");
        set_input(&txt, 7, 1);
        running.expect("runs");
        running.end().well();
        wait_offline(&txt);
        set_input(&txt, 7, 0);
    }
}

#[test]
fn frames_of_the_camera_come_in_beside_the_thread() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = begun(&txt, "camera") else { return };
    (0..3).for_each(|_| running.expect("frame"));
    set_input(&txt, 7, 1);
    running.expect("runs");
    running.end().well();
}

#[test]
fn the_thread_begins_again_in_the_other_mode() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = begun(&txt, "again") else { return };
    set_input(&txt, 7, 1);
    running.expect("runs");
    running.expect("again");
    set_input(&txt, 5, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn a_program_that_ends_while_the_thread_runs_leaves_no_motor_on() {
    let txt = simulated().start().unwrap();
    let Some(running) = begun(&txt, "leave") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 0, 512);
    set_input(&txt, 7, 1);
    running.end().well();
    wait_offline(&txt);
}

#[test]
fn a_program_that_ends_while_configurations_are_on_their_way_leaves_no_motor_on() {
    let late =
        |response| Fault::at_response(response, FaultKind::Delay(Duration::from_millis(1200)));
    let txt = (6..40).map(late).fold(simulated(), SimulatedTxtBuilder::fault).start().unwrap();
    let Some(running) = begun(&txt, "configure") else { return };
    set_input(&txt, 0, 1);
    wait_duty(&txt, 0, 512);
    set_input(&txt, 7, 1);
    running.end().well();
    wait_stopped(&txt);
}

#[test]
fn a_controller_that_is_not_there_or_goes_away_is_told() {
    let Some(program) = program() else { return };
    let ended = Running::start(program, "127.0.0.1:1", &[]).end();
    assert_eq!(ended.code, Some(7), "{}", ended.err);
    assert!(ended.err.contains("127.0.0.1:1"), "{}", ended.err);

    let txt =
        simulated().fault(Fault::at_response(40, FaultKind::Close { after: 0 })).start().unwrap();
    let Some(mut running) = begun(&txt, "") else { return };
    running.expect("ended");
    let ended = running.end();
    ended.well();
    let who = format!("ft-transfer-area: {}: ", txt.address());
    assert!(ended.err.contains(&who), "{}", ended.err);
}
