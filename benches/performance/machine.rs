//! Which machine it is.

use std::fs;
use std::process::Command;
use std::thread::available_parallelism;

use anyhow::{Context, Result};
use nix::sys::resource::{getrlimit, setrlimit, Resource};

use crate::report::{Report, Table};

pub(crate) fn describe(report: &Report) -> Result<()> {
    let processor = fs::read_to_string("/proc/cpuinfo")?;
    let model = processor.lines().find_map(|line| line.strip_prefix("model name"));
    let model = model.map_or("unknown", |line| line.trim_start_matches([' ', '\t', ':']));
    let is_virtual = processor.contains(" hypervisor ");
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease")?;
    let compiler = Command::new("rustc").arg("--version").output()?.stdout;
    let mut table = Table::new(["the machine", ""]);
    let mut row = |name: &str, value: String| table.row([name.to_owned(), value]);
    row("processor", model.to_owned());
    row("processors", available_parallelism()?.to_string());
    row("virtual machine", if is_virtual { "yes" } else { "no" }.to_owned());
    row("system", format!("Linux {}", kernel.trim()));
    row("compiler", String::from_utf8_lossy(&compiler).trim().to_owned());
    report.table("machine", &table)
}

/// How much processor time the host of a virtual machine has taken away so far, and all that has passed.
#[derive(Clone, Copy)]
pub(crate) struct Stolen {
    stolen: f64,
    passed: f64,
}

impl Stolen {
    pub(crate) fn so_far() -> Result<Self> {
        let stat = fs::read_to_string("/proc/stat")?;
        let line = stat.lines().next().context("no processors")?;
        let words = line.split_whitespace().skip(1).take(8);
        let times: Vec<f64> = words.map(|time| Ok(time.parse()?)).collect::<Result<_>>()?;
        // The eighth time of proc(5).
        let stolen = *times.get(7).context("no stolen time")?;
        Ok(Self { stolen, passed: times.iter().sum() })
    }

    /// The share since then, in %.
    pub(crate) fn share(self) -> Result<f64> {
        let now = Self::so_far()?;
        Ok(100.0 * (now.stolen - self.stolen) / (now.passed - self.passed))
    }
}

/// Lets this process have as many open files as the system allows: each connection is one, and a simulated TXT has some
/// more.
pub(crate) fn allow_many_files() -> Result<()> {
    let (_, most) = getrlimit(Resource::RLIMIT_NOFILE)?;
    Ok(setrlimit(Resource::RLIMIT_NOFILE, most, most)?)
}
