//! How soon a program answers an input, and what it costs to wait for it.

use anyhow::{Context, Result};

use crate::child::{self, Server};
use crate::ftrobopy::Ftrobopy;
use crate::plot::{Picture, SeriesLabelPosition};
use crate::programs::Way;
use crate::report::{Report, Table};
use crate::stats::Sorted;

/// What a controller saw of a program.
struct Seen {
    /// For each request: how many requests the answer took (0: never), after how many µs, and how many µs late the
    /// exchange was.
    requests: Vec<[f64; 3]>,
    /// µs of processor time, and how often a thread waited, in each cycle.
    cost: [f64; 2],
}

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut raw = report.raw(
        "reaction",
        &["machine", "program", "request", "requests until the answer", "latency µs", "late µs"],
    )?;
    let mut table = Table::new([
        "the machine is",
        "the program",
        "answered in the next request",
        "latest answer",
        "response to request in µs: median",
        "99 %",
        "99.9 %",
        "longest",
        "cycles per 10 ms",
        "processor time per cycle",
        "waits per cycle",
    ]);
    let ftrobopy = Ftrobopy::find(report)?;
    let mut lines = Vec::new();
    for busy in [false, true] {
        let machine = if busy { "busy" } else { "idle" };
        let _load = load(busy)?;
        let cycles = report.times(1200, 50);
        for program in Way::ALL.map(Some).into_iter().chain([None]) {
            let (name, seen) = match (program, &ftrobopy) {
                (Some(way), _) => (way.name(), run(way, cycles)?),
                (None, Some(ftrobopy)) => {
                    ("ftrobopy, looks each millisecond", run_python(ftrobopy, cycles)?)
                }
                (None, None) => continue,
            };
            for (number, [age, latency, late]) in seen.requests.iter().enumerate() {
                let numbers =
                    [number.to_string(), age.to_string(), latency.to_string(), late.to_string()];
                raw.write_record(
                    [machine, name].into_iter().chain(numbers.iter().map(String::as_str)),
                )?;
            }
            table.row(row(machine, name, &seen));
            if program.is_none_or(|way| matches!(way, Way::Waiting | Way::Polling)) {
                lines.push((format!("{name}, {machine}").replace('`', ""), later(&seen)));
            }
        }
    }
    raw.flush()?;
    let picture = Picture {
        title: "Time from a response to the request that follows it",
        across: "µs",
        up: "% of all requests that take longer",
        columns: &[10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10_000.0, 30_000.0],
        rows: &[0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0],
        lines,
        marked: false,
        names: SeriesLabelPosition::LowerLeft,
    };
    picture.write(&report.picture("reaction"))?;
    report.table("reaction", &table)
}

/// Each latency with the share of requests, in %, that have a longer one.
fn later(seen: &Seen) -> Vec<(f64, f64)> {
    let latency = Sorted::of(seen.requests.iter().map(|request| request[1]));
    let count = seen.requests.len();
    let share = |index: usize| index as f64 / count as f64;
    (0..count).map(|index| (latency.quantile(share(index)), 100.0 * (1.0 - share(index)))).collect()
}

fn row(machine: &str, name: &str, seen: &Seen) -> [String; 11] {
    let count = seen.requests.len() as f64;
    let next = seen.requests.iter().filter(|request| request[0] == 1.0).count() as f64;
    let latest = seen.requests.iter().map(|request| request[0]).fold(0.0, f64::max);
    let latency = Sorted::of(seen.requests.iter().map(|request| request[1]));
    let late: f64 = seen.requests.iter().map(|request| request[2]).sum();
    let [processor, waits] = seen.cost;
    let us = |share: f64| format!("{:.0}", latency.quantile(share));
    [
        machine.to_owned(),
        name.to_owned(),
        format!("{:.1} %", 100.0 * next / count),
        format!("request {latest}"),
        us(0.5),
        us(0.99),
        us(0.999),
        us(1.0),
        format!("{:.3}", count / (count + late / 10_000.0)),
        format!("{processor:.0} µs"),
        format!("{waits:.1}"),
    ]
}

/// On a busy machine, a process for each core that keeps it busy until it is dropped.
pub(crate) fn load(busy: bool) -> Result<Vec<Server>> {
    let cores = std::thread::available_parallelism()?.get();
    (0..if busy { cores } else { 0 }).map(|_| start_load()).collect()
}

fn start_load() -> Result<Server> {
    let mut load = Server::start(&child::arguments([&"busy"]))?;
    load.line()?;
    Ok(load)
}

fn run(way: Way, cycles: usize) -> Result<Seen> {
    let mut examiner = Server::start(&child::arguments([&"examiner"]))?;
    let port = examiner.number()?;
    let way = format!("{way:?}").to_lowercase();
    let arguments = child::arguments([&"program", &"--way", &way, &"--port", &port]);
    let cost = child::run(&[arguments, child::arguments([&"--cycles", &cycles])].concat())?;
    seen(examiner, &cost)
}

fn run_python(ftrobopy: &Ftrobopy, cycles: usize) -> Result<Seen> {
    let mut examiner = Server::start(&child::arguments([&"examiner"]))?;
    let port = examiner.number()?;
    let cost = ftrobopy.run("answer", port, cycles)?;
    seen(examiner, &cost)
}

fn seen(examiner: Server, cost: &str) -> Result<Seen> {
    let [processor, waits] = numbers(cost)?;
    let requests: Vec<[f64; 3]> = examiner.rest()?.lines().map(numbers).collect::<Result<_>>()?;
    // Before its first cycles a program is not yet there.
    let begun = requests.into_iter().skip_while(|request| request[0] == 0.0);
    let in_us = |[age, latency, late]: [f64; 3]| [age, latency / 1000.0, late / 1000.0];
    let mut requests: Vec<_> = begun.map(in_us).skip(2).collect();
    // The last request stops the motors.
    requests.pop();
    Ok(Seen { requests, cost: [processor / 1000.0, waits] })
}

fn numbers<const N: usize>(line: &str) -> Result<[f64; N]> {
    let numbers: Vec<f64> =
        line.split_whitespace().map(|word| Ok(word.parse()?)).collect::<Result<_>>()?;
    numbers.try_into().ok().with_context(|| format!("{line:?} has not {N} numbers"))
}
