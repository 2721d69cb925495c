//! What ends the firmware's program.

use std::time::Duration;

use super::camera::{needs_camera, start_and_stop};
use super::{Check, Found, Needs};
use crate::print::seconds;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::outcome::{Outcome, Trouble};

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "camera-twice",
        "StartCameraOnline right after StopCameraOnline ends the firmware (seen under emulation only).",
        camera_twice,
    )
    .needs(Needs::Crash),
    Check::new(
        "restart-without-i2c",
        "StartOnline right after a session without I2C connection ends the firmware for 2 s.",
        restart,
    )
    .needs(Needs::Crash),
];

fn camera_twice(bench: &mut Bench) -> Found {
    needs_camera(bench)?;
    bench.begin(Holds::I2c)?;
    for _ in 0..2 {
        if !start_and_stop(bench)? {
            return Ok(Outcome::differs("the second start gives no picture"));
        }
    }
    bench.end()?;
    ends(bench)
}

fn restart(bench: &mut Bench) -> Found {
    bench.begin(Holds::Nothing)?.exchange()?;
    bench.end()?;
    ends(bench)
}

/// The firmware is expected to end in the next session.
fn ends(bench: &mut Bench) -> Found {
    match bench.dare_a_session() {
        Ok(()) => return Ok(Outcome::differs("it goes on")),
        Err(Trouble::Lost(_)) => {}
        Err(other) => return Err(other),
    }
    Ok(match bench.comes_back()? {
        Some(time) => {
            let is_same = time < Duration::from_secs(5);
            Outcome::same_if(is_same, format!("back after {}", seconds(time))).with_time("ms", time)
        }
        None => Outcome::differs("it does not come back"),
    })
}
