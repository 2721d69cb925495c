//! What the hooks do.

use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxtBuilder};

use super::support::{has_compiler, program, run_on, tx_run, txt, wait_for, Run};

#[test]
fn the_c_library_is_there() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    run_on(&txt, "strings.c", "").end().well();
}

#[test]
fn messages_are_lines_with_the_name_of_the_controller() {
    if !has_compiler() {
        return;
    }
    let txt = txt().device_name("Robo").extensions(2).start().unwrap();
    let ended = run_on(&txt, "messages.c", "").end();
    ended.well();
    let long = "x".repeat(98);
    let expected = format!(
        "Robo: first\nRobo: line\nRobo: next line\nRobo, extension 2: 20 °C\nRobo: {long}\nRobo: by hand\n"
    );
    assert_eq!(ended.out, expected);
}

#[test]
fn i2c_answers_between_two_tics() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[5..7].copy_from_slice(&[0x12, 0x34]));
    run_on(&txt, "i2c.c", "").end().well();
    let registers = txt.with_machine(|machine| machine.i2c_device(0x18)[5..7].to_vec());
    assert_eq!(registers, [0x56, 0x78]);
}

#[test]
fn i2c_is_connected_before_a_program_asks_for_it() {
    if !has_compiler() {
        return;
    }
    // It refuses clients that come later than the firmware waits.
    let txt = txt().strict(true).start().unwrap();
    let run = run_on(&txt, "motor.c", "");
    wait_for(&txt, "the connection", |machine| machine.i2c_connected());
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    run.end().well();
}

#[test]
fn an_error_of_i2c_is_not_said_again_and_again() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    for program in ["i2c_missing.c", "i2c_reopened.c"] {
        let ended = run_on(&txt, program, "").end();
        ended.well();
        let who = format!("{}, I2C: ", txt.address());
        assert_eq!(ended.err.matches(&who).count(), 1, "{program}: {}", ended.err);
    }
    // Nor by the simulated TXT in its place.
    let mut command = tx_run(&["--world", "none"]);
    let ended = Run::start(command.arg(program("i2c_missing.c")).env_remove("RUST_LOG")).end();
    ended.well();
    let lines = ended.err.lines().filter(|line| line.contains("I2C"));
    assert_eq!(lines.count(), 1, "{}", ended.err);
}

#[test]
fn a_transfer_that_is_lost_again_and_again_is_told_once() {
    if !has_compiler() {
        return;
    }
    let close = |exchange| Fault::at_exchange(exchange, FaultKind::Close { after: 0 });
    let txt = [20, 40, 60].map(close).into_iter().fold(txt(), SimulatedTxtBuilder::fault);
    let txt = txt.start().unwrap();
    let ended = run_on(&txt, "reopened.c", "").end();
    ended.well();
    assert_eq!(ended.err.matches("has ended: ").count(), 1, "{}", ended.err);
}

#[test]
fn bluetooth_is_off() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    run_on(&txt, "bluetooth.c", "").end().well();
}
