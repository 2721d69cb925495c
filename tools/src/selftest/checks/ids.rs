//! Configurations, their ids, and those of commands. No output is on: a motor with a distance has the duty 0.

use std::time::Duration;

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig};

use super::{Check, Found};
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::outcome::{Outcome, Trouble};
use crate::selftest::session::Session;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "counter-reset-id",
        "A counter reset is reported as done.",
        counter_reset,
    ),
    Check::new(
        "motor-id-without-distance",
        "A motor command without a distance is reported as done.",
        motor_without_distance,
    ),
    Check::new(
        "eighth-motor-command",
        "The eighth motor command after one that is done is reported as done at once, whatever the ids are.",
        eighth_command,
    ),
    Check::new(
        "config-id-0",
        "A first configuration with the id 0 has no effect.",
        config_0,
    ),
    Check::new(
        "config-id-low-byte",
        "The low byte of a configuration's id counts: 258 after 2 has no effect.",
        low_byte,
    ),
    Check::new(
        "input-15k",
        "An input of 15 kΩ reads the voltage.",
        input_15k,
    ),
    Check::new(
        "input-digital-ultrasonic",
        "A digital ultrasonic input reads a distance, not 0 or 1.",
        digital_ultrasonic,
    ),
];

/// How many exchanges a configuration or a command may need.
const SOON: usize = 10;

const UNKNOWN: &str = "the inputs read the same in two modes";

fn counter_reset(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.outputs.counter_reset_id[0] += 1;
    let id = session.outputs.counter_reset_id[0];
    Ok(back(session.until(Duration::from_secs(1), |inputs| inputs.c1_reset_id() == id)?))
}

fn motor_without_distance(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.outputs.motor_command_id[0] += 1;
    let id = session.outputs.motor_command_id[0];
    Ok(back(session.until(Duration::from_secs(1), |inputs| inputs.m1_id() == id)?))
}

fn back(back: Option<(Duration, usize)>) -> Outcome {
    match back {
        Some((_, count)) => {
            Outcome::same_if(true, format!("with answer {count}")).with("answers", count)
        }
        None => Outcome::differs("not within 1 s"),
    }
}

fn eighth_command(bench: &mut Bench) -> Found {
    let session = bench.begin(Holds::I2c)?;
    session.exchange()?;
    session.outputs.distance[0] = 100;
    // Ids from 11: bits of the id itself would count otherwise.
    for id in 11..18 {
        session.outputs.motor_command_id[0] = id;
        session.exchanges(2)?;
        if session.inputs.m1_id() == id {
            return Err(Trouble::NotTried("a distance with duty 0 is reported as done"));
        }
    }
    session.outputs.motor_command_id[0] = 18;
    session.exchanges(2)?;
    let is_done = session.inputs.m1_id() == 18;
    Ok(Outcome::same_if(is_done, if is_done { "" } else { "it does not" }))
}

/// All inputs in two ways that read differently, where something is plugged in or nothing.
fn modes() -> [Config; 2] {
    let all = |uni| Config { uni: [uni; 8].into(), ..Config::default() };
    [all(UniConfig::digital(InputMode::Resistance)), all(UniConfig::analog(InputMode::Resistance))]
}

/// What the inputs read with this configuration.
fn read_with(session: &mut Session, id: i16, config: Config) -> Result<Vec<u16>, Trouble> {
    session.configure(id, config)?;
    session.exchanges(SOON)?;
    Ok(session.inputs.universal().to_vec())
}

fn config_0(bench: &mut Bench) -> Found {
    let session = bench.begin(Holds::I2c)?;
    session.exchanges(SOON)?;
    let before = session.inputs.universal().to_vec();
    // One of both modes is another one than that after StartOnline.
    let mut changed = false;
    for config in modes() {
        changed |= read_with(session, 0, config)? != before;
    }
    let mut would_change = false;
    for (id, config) in (1..).zip(modes()) {
        would_change |= read_with(session, id, config)? != before;
    }
    if !would_change {
        return Err(Trouble::NotTried(UNKNOWN));
    }
    Ok(Outcome::same_if(!changed, if changed { "it has an effect" } else { "" }))
}

fn low_byte(bench: &mut Bench) -> Found {
    let session = bench.begin(Holds::I2c)?;
    let [first, second] = modes();
    let with_first = read_with(session, 2, first)?;
    let with_258 = read_with(session, 258, second)?;
    let with_second = read_with(session, 3, second)?;
    if with_first == with_second {
        return Err(Trouble::NotTried(UNKNOWN));
    }
    let is_same = with_258 == with_first;
    Ok(Outcome::same_if(is_same, if is_same { "" } else { "it has an effect" }))
}

/// What I8 reads in this mode. The other inputs keep theirs.
fn i8_with(session: &mut Session, id: i16, uni: UniConfig) -> Result<u16, Trouble> {
    let mut config = Config::default();
    config.uni[7] = uni;
    Ok(read_with(session, id, config)?[7])
}

fn input_15k(bench: &mut Bench) -> Found {
    /// A voltage is never quite the same. In Ω an open input would read 15000, and a closed switch 30 at least.
    const NEAR: u16 = 25;

    let session = bench.begin(Holds::I2c)?;
    let voltage = i8_with(session, 1, UniConfig::analog(InputMode::Voltage))?;
    let read = i8_with(session, 2, UniConfig::analog(InputMode::Resistance15k))?;
    let seen = format!("I8 reads {read}, in the mode for voltages {voltage}");
    Ok(Outcome::same_if(read.abs_diff(voltage) < NEAR, seen))
}

fn digital_ultrasonic(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    let read = i8_with(session, 3, UniConfig::digital(InputMode::Ultrasonic))?;
    Ok(Outcome::same_if(read > 1, format!("I8 reads {read}")))
}
