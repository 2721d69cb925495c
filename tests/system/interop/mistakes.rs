//! Mistakes of ftrobopy: what it does, and that the simulated TXT goes on.
//!
//! Other tests have further mistakes: a counter that is reset in `motors.rs`, an extension that goes
//! away in `sessions.rs`.

use serde_json::json;

use super::ftrobopy::Ftrobopy;
use super::own::Own;
use super::{start, Exchange};

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopys_change_from_another_value_to_1_fails_its_own_checksum() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("inputs.toml", &[]);
    // ftrobopy sends the toggle code, which makes any value but 0 a 0, but the checksum is that of a
    // 1. A controller ends the connection, and so must the simulated TXT.
    assert_eq!(ftrobopy.run(&mut program, "toggle", Exchange::Compressed), false);
    // The next client is served.
    Own::begin(&program, Exchange::Compressed).end();
    let log = program.interrupt();
    assert!(log.contains("sound command 1: sound 3, repeat 2"), "{log}");
    assert!(!log.contains("sound command 2"), "{log}");
    let cut_off: Vec<&str> = log.lines().filter(|line| line.contains("is cut off")).collect();
    assert!(matches!(cut_off[..], [line] if line.contains("checksum")), "{log}");
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopys_pair_on_an_extension_is_the_injection_of_an_error() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("motors.toml", &[]);
    // It adds 4 to the numbers of an extension's motors. The right numbers are 1..=4, as on the
    // master; from 5 on they command an injected error, which has no end.
    let done = ftrobopy.run(&mut program, "injected_error", Exchange::Compressed);
    assert_eq!(done, json!([false, false]));
    let log = program.interrupt();
    for reported in
        ["M1 gets command 2: distance 20, master 6", "M2 gets command 2: distance 20, master 5"]
    {
        assert!(
            log.contains(&format!("extension 1: {reported}")),
            "{reported} is not reported in {log}"
        );
    }
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopys_eighth_command_of_a_motor_is_never_done_in_compressed_exchanges() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    for (exchange, echo) in [(Exchange::Simple, 0), (Exchange::Compressed, 1)] {
        let mut program = start("motors.toml", &[]);
        // After 7 its ids begin again with 0, and ftrobopy reads the toggle from 7 to 0 as 1.
        let mut expected: Vec<[u16; 2]> = (1..=7).map(|id| [id, id]).collect();
        expected.push([0, echo]);
        let ids = ftrobopy.run(&mut program, "eighth_command", exchange);
        assert_eq!(ids, json!(expected), "{}", exchange.name());
    }
}
