//! Measures the library, and what a user would take instead, side by side in one run.
//!
//! ```text
//! cargo bench --bench performance                     # everything: docs/measurements.md and its pictures
//! cargo bench --bench performance -- --short          # the same with few repetitions, into target/performance/short
//! cargo bench --bench performance -- cycle reaction   # only these parts
//! ```
//!
//! The results of each single measurement are CSV files in target/performance.

mod camera;
mod child;
mod clients;
mod cost;
mod crowd;
mod cycle;
mod examiner;
mod first_motor;
mod ftrobopy;
mod loops;
mod machine;
mod micro;
mod peer;
mod pictures;
mod place;
mod plot;
mod process;
mod programs;
mod reaction;
mod report;
mod rounds;
mod scale;
mod stats;

use std::time::Instant;

use anyhow::Result;
use clap::{Parser, Subcommand};

use report::{Report, Table};

#[derive(Parser)]
#[command(about = "Measures the library, and writes docs/measurements.md")]
struct Options {
    /// Few repetitions, to see that everything works; writes into target/performance/short
    #[arg(long)]
    short: bool,
    /// The parts to measure; all if none is named
    #[arg(value_parser = part_named)]
    parts: Vec<Part>,
    /// What Cargo adds
    #[arg(long, hide = true)]
    bench: bool,
    #[command(subcommand)]
    role: Option<Role>,
}

/// What another process of this program does.
#[derive(Clone, Subcommand)]
enum Role {
    #[command(hide = true)]
    Peer(peer::Peer),
    #[command(hide = true)]
    CycleClient(cycle::Client),
    #[command(hide = true)]
    Examiner(examiner::Examiner),
    #[command(hide = true)]
    Program(programs::Program),
    #[command(hide = true)]
    Busy,
    #[command(hide = true)]
    Cycles(cost::Cycles),
    #[command(hide = true)]
    Memory(cost::Memory),
    #[command(hide = true)]
    Simulated(scale::Simulated),
    #[command(hide = true)]
    Handlers(scale::Handlers),
    #[command(hide = true)]
    CameraPeer(camera::CameraPeer),
}

/// A part of the document.
#[derive(Clone, Copy)]
struct Part {
    name: &'static str,
    measure: fn(&Report) -> Result<()>,
}

const PARTS: [Part; 9] = [
    Part { name: "cycle", measure: cycle::measure },
    Part { name: "cost", measure: cost::measure },
    Part { name: "reaction", measure: reaction::measure },
    Part { name: "crowd", measure: crowd::measure },
    Part { name: "loops", measure: loops::measure },
    Part { name: "scale", measure: scale::measure },
    Part { name: "micro", measure: micro::measure },
    Part { name: "camera", measure: camera::measure },
    Part { name: "first_motor", measure: first_motor::measure },
];

fn part_named(name: &str) -> Result<Part, String> {
    PARTS
        .into_iter()
        .find(|part| part.name == name)
        .ok_or_else(|| format!("there are only {}", PARTS.map(|part| part.name).join(", ")))
}

fn main() -> Result<()> {
    let options = Options::parse();
    match &options.role {
        Some(Role::Peer(peer)) => return peer.serve(),
        Some(Role::CycleClient(client)) => return client.run(),
        Some(Role::Examiner(examiner)) => return examiner.serve(),
        Some(Role::Program(program)) => return program.run(),
        Some(Role::Simulated(simulated)) => return simulated.serve(),
        Some(Role::Handlers(handlers)) => return handlers.run(),
        Some(Role::Cycles(cycles)) => return cycles.run(),
        Some(Role::Memory(memory)) => return memory.run(),
        Some(Role::Busy) => return programs::be_busy(),
        Some(Role::CameraPeer(peer)) => return peer.serve(),
        None => {}
    }
    // `cargo test --benches` only asks whether it compiles.
    if !options.bench {
        return Ok(());
    }
    let report = Report::new(options.short)?;
    machine::describe(&report)?;
    let parts = if options.parts.is_empty() { PARTS.to_vec() } else { options.parts };
    for part in parts {
        let (begin, stolen) = (Instant::now(), machine::Stolen::so_far()?);
        eprintln!("{} ...", part.name);
        (part.measure)(&report)?;
        let (took, stolen) = (begin.elapsed().as_secs(), stolen.share()?);
        eprintln!("{} took {took} s", part.name);
        let mut noise = Table::new(["this part took", "the host took away of the processors"]);
        noise.row([format!("{took} s"), format!("{stolen:.1} %")]);
        report.table(&format!("{} noise", part.name), &noise)?;
    }
    println!("{}", report.document().display());
    Ok(())
}
