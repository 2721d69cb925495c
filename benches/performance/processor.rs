//! The processor time of this process.

use std::time::Duration;

use anyhow::Result;

/// What all threads of this process have taken so far.
#[cfg(unix)]
pub(crate) fn time() -> Result<Duration> {
    use nix::sys::resource::{getrusage, UsageWho};

    let usage = getrusage(UsageWho::RUSAGE_SELF)?;
    let times = [usage.user_time(), usage.system_time()];
    let micros = times.map(|time| time.tv_sec() as u64 * 1_000_000 + time.tv_usec() as u64);
    Ok(Duration::from_micros(micros.iter().sum()))
}

/// What all threads of this process have taken so far.
#[cfg(not(unix))]
pub(crate) fn time() -> Result<Duration> {
    anyhow::bail!("processor time can only be measured on Unix")
}
