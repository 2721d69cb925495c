//! The end of a session, and the next one.

use std::time::Duration;

use super::commands::outside;
use super::{Check, Found};
use crate::print::seconds;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::outcome::Outcome;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "stop-online",
        "StopOnline is answered at once when the I2C connection was closed before.",
        stop_online,
    ),
    Check::new(
        "commands-after-stop",
        "After StopOnline, UpdateConfig, both exchanges and StopOnline are answered.",
        after_stop,
    ),
    Check::new(
        "restart-within-5-s",
        "StartOnline works at once when the session before had an I2C connection that it has closed.",
        restart,
    ),
    Check::new(
        "restart-after-a-close",
        "StartOnline works 100 ms after the main and the I2C connection were closed together.",
        restart_after_a_close,
    ),
    Check::new(
        "stop-online-without-i2c",
        "StopOnline takes a second or more while the I2C port waits for its connection.",
        stop_without_i2c,
    ),
];

/// StopOnline is quick.
const AT_ONCE: Duration = Duration::from_millis(400);

fn stop_online(bench: &mut Bench) -> Found {
    bench.online()?;
    let took = bench.end()?.map(|(took, _)| took).unwrap_or_default();
    Ok(Outcome::same_if(took < AT_ONCE, seconds(took)).with_time("ms", took))
}

fn after_stop(bench: &mut Bench) -> Found {
    bench.online()?;
    if let Some((_, mut line)) = bench.end()? {
        outside(&mut line)?;
    }
    Ok(Outcome::same_if(true, ""))
}

fn restart(bench: &mut Bench) -> Found {
    const TIMES: usize = 3;

    for number in 1..=TIMES {
        bench.online()?.exchange()?;
        bench.end()?;
        let again = bench.online().map(drop);
        again.map_err(|trouble| trouble.during(&format!("restart {number}")))?;
    }
    Ok(Outcome::same_if(true, format!("{TIMES} of {TIMES}")))
}

fn restart_after_a_close(bench: &mut Bench) -> Found {
    bench.online()?.exchange()?;
    bench.drop_session();
    bench.online()?.exchange()?;
    Ok(Outcome::same_if(true, ""))
}

fn stop_without_i2c(bench: &mut Bench) -> Found {
    bench.needs_i2c()?;
    bench.begin(Holds::Nothing)?.exchange()?;
    let took = bench.end()?.map(|(took, _)| took).unwrap_or_default();
    let is_same = (0.8..3.5).contains(&took.as_secs_f64());
    Ok(Outcome::same_if(is_same, seconds(took)).with_time("ms", took))
}
