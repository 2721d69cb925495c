//! What one cycle costs: system calls, instructions, memory.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{ensure, Context, Result};
use clap::{Args, ValueEnum};
use ft_transfer_area::TransferAreaComHandler;

use crate::child::{self, Server};
use crate::clients::{Client, Direct, Load, Raw, Waiting};
use crate::process::Process;
use crate::report::{Report, Table};

/// What makes the cycles.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Kind {
    Raw,
    Direct,
    Waiting,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Raw, Self::Direct, Self::Waiting];

    fn name(self) -> &'static str {
        match self {
            Self::Raw => "ping-pong",
            Self::Direct => "`do_transfer`",
            Self::Waiting => "`wait_cycle`",
        }
    }
}

/// Makes a number of cycles.
#[derive(Args, Clone)]
pub(crate) struct Cycles {
    #[arg(long)]
    kind: Kind,
    #[arg(long)]
    port: u16,
    #[arg(long)]
    cycles: u32,
    #[command(flatten)]
    load: Load,
}

impl Cycles {
    pub(crate) fn run(&self) -> Result<()> {
        let (port, load) = (self.port, self.load);
        match self.kind {
            Kind::Raw => Raw::connect(port, load)?.cycles(self.cycles),
            Kind::Direct => Direct::connect(port, load)?.cycles(self.cycles),
            Kind::Waiting => Waiting::connect(port, load)?.cycles(self.cycles),
        }
    }
}

/// Makes handlers with a running transfer, and prints how much more memory the process has then, in KiB.
#[derive(Args, Clone)]
pub(crate) struct Memory {
    #[arg(long)]
    port: u16,
    #[arg(long)]
    handlers: u64,
    #[arg(long)]
    areas: usize,
}

impl Memory {
    pub(crate) fn run(&self) -> Result<()> {
        let begin = || -> Result<TransferAreaComHandler> {
            let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{}", self.port));
            let handler = builder.areas(self.areas).build()?;
            handler.begin_transfer()?;
            drop(handler.areas().wait_cycle()?);
            Ok(handler)
        };
        // The first one also takes what all of them share.
        let _first = begin()?;
        let before = Process::of(std::process::id())?.resident;
        let _handlers: Vec<_> = (0..self.handlers).map(|_| begin()).collect::<Result<_>>()?;
        let after = Process::of(std::process::id())?.resident;
        println!("{}", after.saturating_sub(before) as f64 / self.handlers as f64);
        Ok(())
    }
}

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut table = Table::new([
        "what",
        "exchange",
        "system calls per cycle",
        "the same at the controller's pace",
        "instructions per cycle",
    ]);
    for &kind in report.some(&Kind::ALL) {
        for areas in [1, 9] {
            let load = Load { areas, ..Load::IDLE };
            table.row([
                kind.name().to_owned(),
                if areas == 1 { "master alone, idle" } else { "master + 8, idle" }.to_owned(),
                show(system_calls(report, kind, load, 0)?),
                show(system_calls(report, kind, load, 10_000)?),
                show(instructions(report, kind, load)?),
            ]);
        }
    }
    report.table("cost", &table)?;
    let mut table = Table::new(["areas", "resident memory per handler, with its thread's stack"]);
    for areas in [1_usize, 9] {
        let mut arguments = child::arguments([&"peer", &"--areas", &areas]);
        arguments.extend(child::arguments([&"--pace", &10_000]));
        let mut peer = Server::start(&arguments)?;
        let mut memory = child::arguments([&"memory", &"--port", &peer.number()?]);
        let handlers = report.times(100, 10);
        memory.extend(child::arguments([&"--handlers", &handlers, &"--areas", &areas]));
        let size: f64 = child::run(&memory)?.trim().parse()?;
        table.row([areas.to_string(), format!("{size:.0} KiB")]);
    }
    report.table("memory", &table)
}

fn show(number: Option<f64>) -> String {
    number.map_or("not measured".to_owned(), |number| match number {
        few if few < 100.0 => format!("{few:.1}"),
        many => format!("{many:.0}"),
    })
}

/// Counts something in runs of few and of many cycles; returns the difference per cycle, so that begin and end do
/// not count.
fn difference(
    few: u32,
    many: u32,
    mut count: impl FnMut(u32) -> Result<Option<f64>>,
) -> Result<Option<f64>> {
    let Some((before, after)) = count(few)?.zip(count(many)?) else { return Ok(None) };
    Ok(Some((after - before) / f64::from(many - few)))
}

fn system_calls(report: &Report, kind: Kind, load: Load, pace: u64) -> Result<Option<f64>> {
    let cycles = if pace == 0 { report.times(1000, 100) } else { report.times(100, 20) } as u32;
    difference(cycles, 3 * cycles, |cycles| {
        let file = report.raw_folder().join("strace.txt");
        let strace = ["strace", "-f", "-c", "-o", text(&file)?].map(str::to_owned);
        if !under(&strace, kind, load, pace, cycles)? {
            return Ok(None);
        }
        let summary = std::fs::read_to_string(&file)?;
        let total = summary.lines().find(|line| line.ends_with("total")).context("no total")?;
        // % time, seconds, µs per call, calls, perhaps errors.
        let calls = total.split_whitespace().nth(3).context("no number of calls")?;
        Ok(Some(calls.parse()?))
    })
}

/// The median of several runs, because threads that meet at a lock need more of them.
fn instructions(report: &Report, kind: Kind, load: Load) -> Result<Option<f64>> {
    let runs = (0..report.times(5, 1)).map(|_| instructions_of_run(report, kind, load));
    let mut counts: Vec<_> = runs.collect::<Result<Option<_>>>()?.unwrap_or_default();
    counts.sort_by(f64::total_cmp);
    Ok(counts.get(counts.len() / 2).copied())
}

fn instructions_of_run(report: &Report, kind: Kind, load: Load) -> Result<Option<f64>> {
    let cycles = report.times(500, 50) as u32;
    difference(cycles, 3 * cycles, |cycles| {
        let file = report.raw_folder().join("callgrind.txt");
        let output = format!("--callgrind-out-file={}", text(&file)?);
        let callgrind = ["valgrind", "--tool=callgrind", "-q", &output].map(str::to_owned);
        if !under(&callgrind, kind, load, 0, cycles)? {
            return Ok(None);
        }
        let profile = std::fs::read_to_string(&file)?;
        let total = profile.lines().find_map(|line| {
            line.strip_prefix("totals: ").or_else(|| line.strip_prefix("summary: "))
        });
        Ok(Some(total.context("no total")?.trim().parse()?))
    })
}

fn text(path: &Path) -> Result<&str> {
    path.to_str().context("the folder's name is not text")
}

/// Makes cycles under a tool; returns whether the tool is there.
fn under(tool: &[String], kind: Kind, load: Load, pace: u64, cycles: u32) -> Result<bool> {
    let mut peer = child::arguments([&"peer", &"--pace", &pace]);
    peer.extend(load.arguments());
    let mut peer = Server::start(&peer)?;
    let kind = format!("{kind:?}").to_lowercase();
    let mut arguments = child::arguments([&"cycles", &"--kind", &kind]);
    arguments.extend(child::arguments([&"--port", &peer.number()?, &"--cycles", &cycles]));
    arguments.extend(load.arguments());
    let status = Command::new(&tool[0])
        .args(&tool[1..])
        .arg(std::env::current_exe()?)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .status();
    let Ok(status) = status else {
        eprintln!("{} is not here: not measured", tool[0]);
        return Ok(false);
    };
    ensure!(status.success(), "{} failed: {status}", tool[0]);
    Ok(true)
}
