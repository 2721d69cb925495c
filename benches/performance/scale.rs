//! Many controllers: how exactly they are kept at their pace, and what they take.

use std::io::BufRead;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::Args;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::child::{self, Server};
use crate::machine::allow_many_files;
use crate::plot::{Picture, SeriesLabelPosition};
use crate::process::{Process, Usage};
use crate::report::{Report, Table};
use crate::stats::Sorted;

/// The time between two responses of a controller.
const PACE: Duration = Duration::from_millis(10);

/// Simulated controllers in one process. Prints a line with their ports, and serves until its input ends.
#[derive(Args, Clone)]
pub(crate) struct Simulated {
    #[arg(long)]
    count: usize,
}

impl Simulated {
    pub(crate) fn serve(&self) -> Result<()> {
        allow_many_files()?;
        let controllers: Vec<SimulatedTxt> = (0..self.count)
            .map(|_| SimulatedTxt::builder().pace(PACE).start())
            .collect::<Result<_, _>>()?;
        let ports: Vec<String> = controllers.iter().map(|txt| txt.port().to_string()).collect();
        println!("{}", ports.join(" "));
        std::io::stdin().lock().lines().for_each(drop);
        Ok(())
    }
}

/// Handlers in one process, each with a program that answers each response. Prints when it begins to measure,
/// what the process takes, and for each handler the times between its responses in ns.
#[derive(Args, Clone)]
pub(crate) struct Handlers {
    #[arg(long, value_delimiter = ' ')]
    ports: Vec<u16>,
    #[arg(long)]
    seconds: f64,
}

impl Handlers {
    pub(crate) fn run(&self) -> Result<()> {
        let handlers: Vec<_> =
            self.ports.iter().map(|port| handler(*port)).collect::<Result<_>>()?;
        let measures = AtomicBool::new(false);
        let over = AtomicBool::new(false);
        let results = thread::scope(|scope| {
            let programs: Vec<_> = handlers
                .iter()
                .map(|handler| scope.spawn(|| answer(handler, &measures, &over)))
                .collect();
            // Until all have begun and go on at their pace.
            thread::sleep(Duration::from_secs(1));
            let begin = Usage::now()?;
            println!("begun");
            measures.store(true, Ordering::Relaxed);
            thread::sleep(Duration::from_secs_f64(self.seconds));
            measures.store(false, Ordering::Relaxed);
            let used = Usage::now()?.processor - begin.processor;
            let own = Process::of(std::process::id())?;
            println!("{used} {} {}", own.threads, own.resident);
            over.store(true, Ordering::Relaxed);
            let results: Vec<Result<Vec<Duration>, Error>> =
                programs.into_iter().map(|program| program.join().unwrap_or(Ok(vec![]))).collect();
            Ok::<_, anyhow::Error>(results)
        })?;
        for periods in results {
            let words: Vec<String> =
                periods?.iter().map(|period| period.as_nanos().to_string()).collect();
            println!("{}", words.join(" "));
        }
        Ok(())
    }
}

fn handler(port: u16) -> Result<TransferAreaComHandler> {
    let handler = TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).build()?;
    handler.begin_transfer()?;
    Ok(handler)
}

/// Answers each response; returns the times between them while it `measures`.
fn answer(
    handler: &TransferAreaComHandler,
    measures: &AtomicBool,
    over: &AtomicBool,
) -> Result<Vec<Duration>, Error> {
    let mut periods = Vec::with_capacity(4000);
    let mut last: Option<Instant> = None;
    while !over.load(Ordering::Relaxed) {
        let mut areas = handler.areas().wait_cycle()?;
        areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
        let arrived = areas.arrived();
        drop(areas);
        if measures.load(Ordering::Relaxed) {
            periods.extend(last.map(|last| arrived - last));
        }
        last = Some(arrived);
    }
    Ok(periods)
}

/// Who answers the handlers.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Other {
    Canned,
    Simulated,
}

impl Other {
    fn name(self) -> &'static str {
        match self {
            Self::Canned => "canned responses",
            Self::Simulated => "simulated TXTs",
        }
    }

    /// Starts it; returns it with the ports for this number of handlers.
    fn start(self, count: usize) -> Result<(Server, String)> {
        match self {
            Self::Canned => {
                let pace = PACE.as_micros();
                let mut peer = Server::start(&child::arguments([&"peer", &"--pace", &pace]))?;
                let port = peer.number()?;
                Ok((peer, vec![port.to_string(); count].join(" ")))
            }
            Self::Simulated => {
                let mut simulated =
                    Server::start(&child::arguments([&"simulated", &"--count", &count]))?;
                let ports = simulated.line()?;
                Ok((simulated, ports))
            }
        }
    }
}

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut raw = report.raw("scale", &["answered by", "handlers", "handler", "period µs"])?;
    let mut table = Table::new([
        "answered by",
        "handlers",
        "cycles/s of each",
        "late in ms: median",
        "99 %",
        "99.9 %",
        "handlers: cores",
        "µs per cycle",
        "MiB",
        "threads",
        "other side: cores",
        "µs per cycle",
        "MiB",
        "threads",
    ]);
    let counts = [1, 4, 16, 64, 256];
    let mut lines = Vec::new();
    for other in [Other::Canned, Other::Simulated] {
        let [mut half, mut most] = [const { Vec::new() }; 2];
        for count in &counts[..report.times(5, 2)] {
            let (row, late) = run(report, &mut raw, other, *count)?;
            table.row(row);
            half.push((*count as f64, late.median()));
            most.push((*count as f64, late.quantile(0.99)));
        }
        lines.push((format!("{}: median", other.name()), half));
        lines.push((format!("{}: 99 %", other.name()), most));
    }
    raw.flush()?;
    let picture = Picture {
        title: "How late responses come that are due each 10 ms",
        across: "handlers, and controllers in another process",
        up: "ms",
        columns: &[1.0, 4.0, 16.0, 64.0, 256.0],
        rows: &[0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0],
        lines,
        marked: true,
        names: SeriesLabelPosition::UpperLeft,
    };
    picture.write(&report.picture("scale"))?;
    report.table("scale", &table)
}

fn run(
    report: &Report,
    raw: &mut csv::Writer<std::fs::File>,
    other: Other,
    count: usize,
) -> Result<([String; 14], Sorted)> {
    let seconds = report.times(10, 1) as f64;
    let (server, ports) = other.start(count)?;
    let arguments = child::arguments([&"handlers", &"--ports", &ports, &"--seconds", &seconds]);
    let mut handlers = Server::start(&arguments)?;
    handlers.line()?;
    let begun = server.process()?;
    let line = handlers.line()?;
    let ended = server.process()?;
    let own: Vec<f64> = line.split(' ').map(|word| Ok(word.parse()?)).collect::<Result<_>>()?;
    let [used, threads, resident] = own[..] else {
        anyhow::bail!("{line:?} has not three numbers")
    };
    let mut periods = Vec::new();
    for (handler, line) in handlers.rest()?.lines().enumerate() {
        for period in line.split_whitespace() {
            let period = period.parse::<f64>().context("a period is a number")? / 1e6;
            periods.push(period);
            raw.write_record([
                other.name(),
                &count.to_string(),
                &handler.to_string(),
                &(period * 1000.0).to_string(),
            ])?;
        }
    }
    let cycles = periods.len() as f64;
    let late = Sorted::of(periods.iter().map(|period| (period - 10.0).max(0.0)));
    let theirs = ended.processor - begun.processor;
    let row = [
        other.name().to_owned(),
        count.to_string(),
        format!("{:.1}", cycles / count as f64 / seconds),
        format!("{:.2}", late.median()),
        format!("{:.2}", late.quantile(0.99)),
        format!("{:.2}", late.quantile(0.999)),
        format!("{:.2}", used / 1e9 / seconds),
        format!("{:.0}", used / 1000.0 / cycles),
        format!("{:.1}", resident / 1024.0),
        format!("{threads}"),
        format!("{:.2}", theirs / seconds),
        format!("{:.0}", theirs * 1e6 / cycles),
        format!("{:.1}", ended.resident as f64 / 1024.0),
        ended.threads.to_string(),
    ];
    Ok((row, late))
}
