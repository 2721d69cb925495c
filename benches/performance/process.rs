//! What a process takes.

use std::fs;
use std::time::Duration;

use anyhow::{Context, Result};
use nix::sys::resource::{getrusage, UsageWho};
use nix::sys::time::TimeValLike;

/// What this process has used.
#[derive(Clone, Copy)]
pub(crate) struct Usage {
    /// Processor time in ns.
    pub(crate) processor: i64,
    /// How often a thread has waited.
    switches: i64,
}

/// What a cycle costs: ns of processor time, and how often a thread waits.
pub(crate) struct Cost {
    pub(crate) processor: f64,
    pub(crate) switches: f64,
}

impl Usage {
    pub(crate) fn now() -> Result<Self> {
        let usage = getrusage(UsageWho::RUSAGE_SELF)?;
        let processor = (usage.user_time() + usage.system_time()).num_nanoseconds();
        Ok(Self { processor, switches: usage.voluntary_context_switches() })
    }

    /// The processor time.
    pub(crate) fn time(self) -> Duration {
        Duration::from_nanos(self.processor.unsigned_abs())
    }

    /// What was used since then, for each of these cycles.
    pub(crate) fn per_cycle(self, cycles: u64) -> Result<Cost> {
        let now = Self::now()?;
        let of = |used: i64| used as f64 / cycles as f64;
        Ok(Cost {
            processor: of(now.processor - self.processor),
            switches: of(now.switches - self.switches),
        })
    }
}

/// What a process of this machine takes, as Linux reports it.
pub(crate) struct Process {
    /// Processor time in s, in steps of 10 ms.
    pub(crate) processor: f64,
    /// Memory in KiB.
    pub(crate) resident: u64,
    pub(crate) threads: u64,
}

impl Process {
    pub(crate) fn of(id: u32) -> Result<Self> {
        let stat = fs::read_to_string(format!("/proc/{id}/stat"))?;
        // The name may have blanks; the state follows it.
        let (_, fields) = stat.rsplit_once(") ").context("no name")?;
        let fields: Vec<&str> = fields.split(' ').collect();
        let field = |number: usize| -> Result<u64> {
            let text = fields.get(number).context("too few fields")?;
            Ok(text.parse()?)
        };
        let status = fs::read_to_string(format!("/proc/{id}/status"))?;
        let resident = status
            .lines()
            .find_map(|line| line.strip_prefix("VmRSS:"))
            .and_then(|rest| rest.split_whitespace().next())
            .context("no memory")?
            .parse()?;
        // Fields 14, 15 and 20 of proc(5); the state is the third.
        let ticks = field(11)? + field(12)?;
        Ok(Self { processor: ticks as f64 / 100.0, resident, threads: field(17)? })
    }
}
