//! What a cycle costs from end to end, beside packets of the same sizes that only go back and forth.

use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;

use crate::child::{self, Server};
use crate::clients::{Client as _, Direct, Load, Raw, Waiting};
use crate::ftrobopy::Ftrobopy;
use crate::place::{stay_on, Place};
use crate::report::{Report, Table};
use crate::stats::Sorted;

/// All loads of the table.
fn loads() -> impl Iterator<Item = Load> {
    let kinds = [(1, false), (2, false), (9, false), (1, true)];
    kinds
        .into_iter()
        .flat_map(|(areas, simple)| [false, true].map(|changing| Load { areas, changing, simple }))
}

fn name(load: Load) -> String {
    let what = match (load.simple, load.areas - 1) {
        (true, _) => "master alone, not compressed".to_owned(),
        (false, 0) => "master alone".to_owned(),
        (false, extensions) => format!("master + {extensions}"),
    };
    format!("{what}, {}", if load.changing { "all words change" } else { "idle" })
}

/// Makes cycles with each client in turn, and prints how long each took in ns.
#[derive(Args, Clone)]
pub(crate) struct Client {
    #[command(flatten)]
    load: Load,
    #[arg(long)]
    port: u16,
    #[arg(long)]
    rounds: usize,
    /// Cycles in each round
    #[arg(long)]
    cycles: u32,
    #[arg(long)]
    core: Option<usize>,
}

impl Client {
    pub(crate) fn run(&self) -> Result<()> {
        stay_on(self.core)?;
        let (port, load) = (self.port, self.load);
        let mut raw = Raw::connect(port, load)?;
        let mut direct = Direct::connect(port, load)?;
        for round in 0..self.rounds {
            // What went before may have kept the cores awake.
            let mut times = [Duration::ZERO; 3];
            for turn in 0..3 {
                let which = (round + turn) % 3;
                times[which] = match which {
                    0 => raw.time(self.cycles)?,
                    1 => direct.time(self.cycles)?,
                    _ => {
                        // A handler whose program does not wait goes on by itself, so it is there only for its turn.
                        let mut waiting = Waiting::connect(port, load)?;
                        waiting.cycles(self.cycles / 10)?;
                        waiting.time(self.cycles)?
                    }
                };
            }
            let times = times.map(|time| time.as_nanos().to_string());
            println!("{}", times.join(" "));
        }
        Ok(())
    }
}

/// The times of a round in µs: raw, `do_transfer`, `wait_cycle`.
type Round = [f64; 3];

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut raw = report.raw(
        "cycle",
        &["place", "load", "round", "ping-pong µs", "do_transfer µs", "wait_cycle µs"],
    )?;
    let mut table = Table::new([
        "where the threads run",
        "what is exchanged",
        "ping-pong, µs",
        "`do_transfer`, of it",
        "`wait_cycle`, of it",
        "quickest tenth: ping-pong, µs",
        "`do_transfer`, of it",
        "`wait_cycle`, of it",
    ]);
    for place in Place::ALL {
        for load in loads() {
            let rounds = rounds(report, place, load)?;
            for (number, round) in rounds.iter().enumerate() {
                let mut row = vec![place.name().to_owned(), name(load), number.to_string()];
                row.extend(round.map(|time| time.to_string()));
                raw.write_record(row)?;
            }
            let times = |which: usize| Sorted::of(rounds.iter().map(|round| round[which]));
            let of_raw =
                |which: usize| Sorted::of(rounds.iter().map(|round| round[which] / round[0]));
            let [quick, direct, waiting] = [0, 1, 2].map(|which| times(which).quantile(0.1));
            table.row([
                place.name().to_owned(),
                name(load),
                times(0).with_spread(1),
                of_raw(1).with_spread(2),
                of_raw(2).with_spread(2),
                format!("{quick:.1}"),
                format!("{:.2}", direct / quick),
                format!("{:.2}", waiting / quick),
            ]);
        }
    }
    raw.flush()?;
    report.table("cycle", &table)?;
    beside_ftrobopy(report)
}

/// ftrobopy does not compress, unless it has an extension.
fn beside_ftrobopy(report: &Report) -> Result<()> {
    let Some(ftrobopy) = Ftrobopy::find(report)? else { return Ok(()) };
    let load = Load { simple: true, ..Load::IDLE };
    let mut table =
        Table::new(["master alone, not compressed, placed by the system", "µs per cycle"]);
    let mut theirs = Vec::new();
    let mut ours = Vec::new();
    for _ in 0..report.times(3, 1) {
        ours.extend(rounds(report, Place::Free, load)?);
        let mut peer = vec!["peer".to_owned()];
        peer.extend(load.arguments());
        let mut peer = Server::start(&peer)?;
        let time = ftrobopy.run("cycles", peer.number()?, report.times(5000, 200))?;
        theirs.push(time.trim().parse::<f64>()? / 1000.0);
    }
    for (which, name) in ["ping-pong", "`do_transfer`", "`wait_cycle`"].into_iter().enumerate() {
        let times = Sorted::of(ours.iter().map(|round| round[which]));
        table.row([name.to_owned(), times.with_spread(1)]);
    }
    table.row(["ftrobopy".to_owned(), Sorted::of(theirs).with_spread(0)]);
    report.table("cycle_ftrobopy", &table)
}

fn rounds(report: &Report, place: Place, load: Load) -> Result<Vec<Round>> {
    let mut peer = vec!["peer".to_owned()];
    peer.extend(load.arguments());
    peer.extend(place.arguments(true));
    let mut peer = Server::start(&peer)?;
    let port = peer.number()?;
    let rounds = report.times(40, 1);
    let cycles = report.times(300, 100);
    let mut client = child::arguments([&"cycle-client", &"--port", &port]);
    client.extend(child::arguments([&"--rounds", &rounds, &"--cycles", &cycles]));
    client.extend(load.arguments());
    client.extend(place.arguments(false));
    child::run(&client)?.lines().map(parse).collect()
}

fn parse(line: &str) -> Result<Round> {
    let times: Vec<f64> =
        line.split(' ').map(|time| Ok(time.parse::<f64>()? / 1000.0)).collect::<Result<_>>()?;
    times.try_into().ok().with_context(|| format!("{line:?} has not three times"))
}
