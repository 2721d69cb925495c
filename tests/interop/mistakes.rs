//! Where ftrobopy is wrong: what it does then, and that the simulated TXT goes on.
//!
//! Further mistakes are told where they are met: a counter that is reset in `motors.rs`, an
//! extension that goes away in `sessions.rs`.

use serde_json::json;

use crate::ftrobopy::Ftrobopy;
use crate::own::Own;
use crate::{start, Exchange};

#[test]
fn ftrobopys_change_from_another_value_to_1_fails_its_own_checksum() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("inputs.toml", &[]);
    // ftrobopy sends the toggle for it, which makes 0 of anything but 0, along with the checksum
    // of a 1. A controller ends the connection, and so must the simulated one.
    assert_eq!(ftrobopy.run(&mut program, "toggle", Exchange::Compressed), false);
    // The next client is served.
    Own::begin(&program, Exchange::Compressed).end();
    let log = program.interrupt();
    assert!(log.contains("sound command 1: sound 3, repeat 2"), "{log}");
    assert!(!log.contains("sound command 2"), "{log}");
    let cut_off: Vec<&str> = log.lines().filter(|line| line.contains("is cut off")).collect();
    assert!(matches!(cut_off[..], [line] if line.contains("checksum")), "{log}");
}

#[test]
fn ftrobopys_pair_on_an_extension_is_the_injection_of_an_error() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("motors.toml", &[]);
    // It adds 4 to the numbers of an extension's motors, which are 1..=4 as the master's are. From
    // 5 on they order an error, which has no end.
    let done = ftrobopy.run(&mut program, "injected_error", Exchange::Compressed);
    assert_eq!(done, json!([false, false]));
    let log = program.interrupt();
    for told in
        ["M1 gets command 2: distance 20, master 6", "M2 gets command 2: distance 20, master 5"]
    {
        assert!(log.contains(&format!("extension 1: {told}")), "{told} is not told in {log}");
    }
}

#[test]
fn ftrobopys_eighth_command_of_a_motor_is_never_done_in_compressed_exchanges() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    for (exchange, echo) in [(Exchange::Simple, 0), (Exchange::Compressed, 1)] {
        let mut program = start("motors.toml", &[]);
        // After 7 its ids go on with 0, and the toggle from 7 to 0 reads 1 there.
        let mut expected: Vec<[u16; 2]> = (1..=7).map(|id| [id, id]).collect();
        expected.push([0, echo]);
        let ids = ftrobopy.run(&mut program, "eighth_command", exchange);
        assert_eq!(ids, json!(expected), "{}", exchange.name());
    }
}
