//! ftrobopy through `txt watch`: it reads what it reads without it, and what passes is understood.

use serde_json::Value;

use super::ftrobopy::Ftrobopy;
use super::{start, Exchange};
use crate::program::Program;

/// What ftrobopy reads in a scenario without `txt watch` and through it..
fn both(
    ftrobopy: &Ftrobopy,
    scenario: &str,
    exchange: Exchange,
    start: impl Fn() -> Program,
) -> [Value; 2] {
    [false, true].map(|through_watch| {
        let mut program = if through_watch { start().watched() } else { start() };
        let read = ftrobopy.run(&mut program, scenario, exchange);
        if through_watch {
            assert_eq!(program.end_watch(), "", "all of {scenario} is understood");
        }
        program.interrupt();
        read
    })
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopy_reads_the_same_inputs() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    for exchange in [Exchange::Simple, Exchange::Compressed] {
        let [direct, watched] =
            both(&ftrobopy, "inputs", exchange, || start("inputs.toml", &["--pace", "0"]));
        assert_eq!(watched, direct);
    }
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopy_reads_the_same_from_sounds_remotes_camera_and_i2c() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let options = ["--name", "Scenario TXT", "--camera-start-up", "300"];
    let [mut direct, mut watched] =
        both(&ftrobopy, "services", Exchange::Compressed, || start("inputs.toml", &options));
    for read in [&mut direct, &mut watched] {
        // Each picture shows its own number.
        let pictures = read["pictures"].take();
        assert_eq!(pictures.as_array().map(Vec::len), Some(3));
    }
    assert_eq!(watched, direct);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn ftrobopy_goes_online_and_offline_a_hundred_times() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let [direct, watched] =
        both(&ftrobopy, "reconnect", Exchange::Compressed, || start("inputs.toml", &[]));
    assert_eq!(watched, direct);
}
