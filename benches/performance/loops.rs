//! One loop for two controllers: how many reactions are late with each way of waiting. And how fast time passes in
//! lock-step.

use std::time::{Duration, Instant};

use anyhow::Result;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::reaction::load;
use crate::report::{Report, Table};
use crate::stats::Sorted;

/// Whether all cores have other work, and how the table calls it.
const MACHINES: [(bool, &str); 2] = [(false, "idle"), (true, "busy")];

/// A loop's body, for two controllers.
type Turn = fn(&[TransferAreas; 2]) -> Result<(), Error>;

const LOOPS: [(&str, Turn); 2] = [
    ("waits for each controller, and holds both guards", |[one, other]| {
        let (mut first, mut second) = (one.wait_cycle()?, other.wait_cycle()?);
        first[LOCAL_IO].output.duty[0] ^= 1;
        second[LOCAL_IO].output.duty[0] ^= 1;
        Ok(())
    }),
    ("waits for each controller, one after the other", |[one, other]| {
        one.wait_cycle()?[LOCAL_IO].output.duty[0] ^= 1;
        other.wait_cycle()?[LOCAL_IO].output.duty[0] ^= 1;
        Ok(())
    }),
];

/// The cycles of a loop, and its late reactions.
#[derive(Clone, Copy, Default)]
struct Reactions {
    cycles: u64,
    late: u64,
}

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut raw =
        report.raw("loops", &["machine", "loop", "round", "controller", "cycles", "late"])?;
    let mut steps = report.raw("lock_step", &["machine", "round", "cycles per second"])?;
    let mut all = [[Reactions::default(); MACHINES.len()]; LOOPS.len()];
    let mut lock_steps = Table::new(["the machine is", "cycles per second in lock-step"]);
    for (machine, (busy, machine_name)) in MACHINES.into_iter().enumerate() {
        let _load = load(busy)?;
        let mut rates = Vec::new();
        for round in 0..report.times(3, 1) {
            for ((name, turn), all) in LOOPS.into_iter().zip(&mut all) {
                // In 100 cycles the second controller goes ahead by one.
                let reactions = two_controllers(turn, report.times(100, 15) as u64)?;
                for (controller, Reactions { cycles, late }) in reactions.into_iter().enumerate() {
                    raw.serialize((machine_name, name, round, controller, cycles, late))?;
                    all[machine].cycles += cycles;
                    all[machine].late += late;
                }
            }
            let rate = lock_step(report.times(5000, 500))?;
            steps.serialize((machine_name, round, rate))?;
            rates.push(rate);
        }
        lock_steps.row([machine_name.to_owned(), Sorted::of(rates).with_spread(0)]);
    }
    raw.flush()?;
    steps.flush()?;
    let mut table = Table::new(["the loop", "late on an idle machine", "late on a busy machine"]);
    for ((name, _), all) in LOOPS.into_iter().zip(all) {
        let [idle, busy] = all.map(|Reactions { cycles, late }| format!("{late} of {cycles}"));
        table.row([name.to_owned(), idle, busy]);
    }
    report.table("loops", &table)?;
    report.table("lock_step", &lock_steps)
}

/// Runs a loop until the first controller has made this many cycles.
fn two_controllers(turn: Turn, cycles: u64) -> Result<[Reactions; 2]> {
    let start = |pace| -> Result<_> {
        let txt = SimulatedTxt::builder().pace(Duration::from_micros(pace)).start()?;
        let handler = TransferAreaComHandler::builder(txt.address()).build()?;
        handler.begin_transfer()?;
        Ok((txt, handler))
    };
    // Their clocks differ, so each comes before and after the other in turn.
    let controllers = [start(10_000)?, start(9_900)?];
    let areas = controllers.each_ref().map(|(_, handler)| handler.areas().clone());
    while areas[0].statistics().cycles < cycles {
        turn(&areas)?;
    }
    let statistics = areas.map(|area| area.statistics());
    for (_, handler) in &controllers {
        handler.end_transfer()?;
    }
    Ok(statistics.map(|of| Reactions { cycles: of.cycles, late: of.late_reactions }))
}

/// Cycles per second.
fn lock_step(cycles: usize) -> Result<f64> {
    let txt = SimulatedTxt::builder().lock_step().start()?;
    let builder = TransferAreaComHandler::builder(txt.address());
    let handler = builder.lock_step().build()?;
    handler.begin_transfer()?;
    let begin = Instant::now();
    for _ in 0..cycles {
        handler.areas().wait_cycle()?[LOCAL_IO].output.duty[0] ^= 1;
    }
    let rate = cycles as f64 / begin.elapsed().as_secs_f64();
    handler.end_transfer()?;
    Ok(rate)
}
