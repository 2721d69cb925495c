//! What the hooks do.

use super::support::{has_compiler, run_on, txt};

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
fn an_error_of_i2c_is_not_said_again_and_again() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let ended = run_on(&txt, "i2c_missing.c", "").end();
    ended.well();
    assert_eq!(ended.err.matches("I2C: ").count(), 1, "{}", ended.err);
}

#[test]
fn bluetooth_is_off() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    run_on(&txt, "bluetooth.c", "").end().well();
}
