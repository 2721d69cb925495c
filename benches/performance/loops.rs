//! One loop for two controllers: how many reactions are late with each way of waiting. And how fast
//! time passes in lock-step.
//!
//! `cargo bench --bench control_loops`

use std::time::{Duration, Instant};

use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferArea, TransferAreaComHandler};

/// Three seconds at the controllers' pace.
const CYCLES: u64 = 300;
const STEPS: u64 = 20_000;

type Round = fn(&[TransferArea; 2]) -> Result<(), Error>;

fn main() -> Result<(), Error> {
    let ways: [(&str, Round); 3] = [
        ("waits for each, holds both guards", |[one, other]| {
            let (mut first, mut second) = (one.wait_cycle()?, other.wait_cycle()?);
            first[LOCAL_IO].output.duty[0] ^= 1;
            second[LOCAL_IO].output.duty[0] ^= 1;
            Ok(())
        }),
        ("waits for each, one after the other", |[one, other]| {
            one.wait_cycle()?[LOCAL_IO].output.duty[0] ^= 1;
            other.wait_cycle()?[LOCAL_IO].output.duty[0] ^= 1;
            Ok(())
        }),
        ("wait_any, locks the other one", |areas| {
            let (which, guard) = TransferArea::wait_any(&[&areas[0], &areas[1]]);
            let mut guard = guard?;
            let input = areas[1 - which].lock()[LOCAL_IO].input.uni[0];
            guard[LOCAL_IO].output.duty[0] ^= 1 + input;
            Ok(())
        }),
    ];
    println!("{:<40} cycles  reactions late  by controller", "way");
    for (name, round) in ways {
        two_controllers(name, round)?;
    }
    lock_step()
}

fn two_controllers(name: &str, round: Round) -> Result<(), Error> {
    let start = |pace| -> Result<_, Error> {
        let txt = SimulatedTxt::builder().pace(Duration::from_micros(pace)).start()?;
        let handler = TransferAreaComHandler::builder("127.0.0.1").port(txt.port()).build()?;
        handler.begin_transfer()?;
        Ok((txt, handler))
    };
    // Their clocks differ, so each comes before and after the other in turn.
    let controllers = [start(10_000)?, start(9_900)?];
    let areas = controllers.each_ref().map(|(_, handler)| handler.transfer_area());
    while areas[0].statistics().cycles < CYCLES {
        round(&areas)?;
    }
    let [one, other] = areas.map(|area| area.statistics());
    let (cycles, late) = (one.cycles + other.cycles, [one.late_reactions, other.late_reactions]);
    println!("{name:<40} {cycles:>6}  {:>14}  {late:?}", late[0] + late[1]);
    Ok(())
}

fn lock_step() -> Result<(), Error> {
    let txt = SimulatedTxt::builder().lock_step().start()?;
    let builder = TransferAreaComHandler::builder("127.0.0.1").port(txt.port());
    let handler = builder.lock_step().build()?;
    handler.begin_transfer()?;
    let begin = Instant::now();
    for _ in 0..STEPS {
        handler.wait_cycle()?[LOCAL_IO].output.duty[0] ^= 1;
    }
    let rate = STEPS as f64 / begin.elapsed().as_secs_f64();
    println!("lock-step: {rate:.0} cycles a second");
    handler.end_transfer()
}
