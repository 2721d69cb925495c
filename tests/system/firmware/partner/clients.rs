//! ftrobopy, another client, with the scenarios of the tests with the simulated TXT.

use std::env;
use std::path::Path;
use std::process::Command;

use ft_transfer_area_simulator::world::World;
use serde_json::{json, Value};

use super::{check, Check};
use crate::controller::Controller;
use crate::program::output_in_time;

pub(super) fn checks() -> Vec<(String, Check)> {
    vec![
        check("ftrobopy, motors in the simple exchange", |controller| motors(controller, "simple")),
        check("ftrobopy, motors in the compressed exchange", |controller| {
            motors(controller, "compressed")
        }),
    ]
}

/// Runs a scenario of the script; returns what it read.
fn run(scenario: &str, exchange: &str) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("interop/ftrobopy_scenarios.py");
    let python = env::var_os("FTROBOPY_PYTHON").expect(".ci/firmware names a Python with ftrobopy");
    let mut python = Command::new(python);
    python.args(["-u", "-B", "-W", "ignore::DeprecationWarning"]).arg(script);
    let output = output_in_time(python.args(["65000", scenario, exchange]));
    let said = String::from_utf8(output.stdout).unwrap();
    let result = said.lines().find_map(|line| line.strip_prefix("RESULT "));
    let result = result.unwrap_or_else(|| {
        panic!("{scenario} has no result: {said}{}", String::from_utf8_lossy(&output.stderr))
    });
    serde_json::from_str(result).unwrap()
}

/// Distances end within a few pulses, alone and synchronised, and the slide is at its end in between.
fn motors(controller: &Controller, exchange: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("interop/motors.toml");
    controller.plug_in_unpaced(World::load(file).unwrap());
    let read = run("motors", exchange);
    assert_eq!(read["slide"][1], json!([0, 1, 25]), "{read}");
    near(&read["slide"][3], 400);
    let controllers = if exchange == "compressed" { 2 } else { 1 };
    for controller in 0..controllers {
        near(&read["alone"][controller][0], 150);
        near(&read["alone"][controller][1], 90);
        near(&read["paired"][controller], 200);
        assert_eq!(read["left"][controller], json!([true, [0], true]), "{read}");
    }
}

/// A motor may turn a little too far, but never stops early, and its command is reported as done in time.
fn near(driven: &Value, distance: i64) {
    for count in driven[0].as_array().unwrap() {
        let count = count.as_i64().unwrap();
        assert!((distance..distance + 4).contains(&count), "{count} pulses, not {distance}");
    }
    assert_eq!(driven[1], true, "the command was done early or late");
}
