//! Short pieces of work that are timed in turn, round after round.

use std::hint::black_box;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::report::Report;
use crate::stats::Sorted;

/// How long a round of one piece of work takes at least, so that looking at the clock costs nothing beside it.
const ROUND: Duration = Duration::from_millis(1);

/// A piece of work.
pub(crate) struct Work {
    pub(crate) name: String,
    /// Does it this number of times.
    run: Box<dyn FnMut(u32)>,
}

impl Work {
    pub(crate) fn new<R>(name: impl Into<String>, mut once: impl FnMut() -> R + 'static) -> Self {
        let run = move |count| {
            for _ in 0..count {
                black_box(once());
            }
        };
        Self { name: name.into(), run: Box::new(run) }
    }

    fn time(&mut self, count: u32) -> Duration {
        let begin = Instant::now();
        (self.run)(count);
        begin.elapsed()
    }

    /// How often it is done in a round.
    fn count(&mut self) -> u32 {
        let mut count = 1;
        while self.time(count) < ROUND {
            count *= 2;
        }
        count
    }
}

/// Times all of them in turn. Returns how long each took in each round, in ns, and writes this into a CSV file.
pub(crate) fn alternate(
    report: &Report,
    name: &str,
    rounds: usize,
    works: &mut [Work],
) -> Result<Vec<Vec<f64>>> {
    let mut raw = report.raw(name, &["what", "round", "ns"])?;
    let counts: Vec<u32> = works.iter_mut().map(Work::count).collect();
    let mut times = vec![Vec::with_capacity(rounds); works.len()];
    for round in 0..rounds {
        for ((work, &count), times) in works.iter_mut().zip(&counts).zip(&mut times) {
            let nanos = work.time(count).as_nanos() as f64 / f64::from(count);
            raw.write_record([&work.name, &round.to_string(), &nanos.to_string()])?;
            times.push(nanos);
        }
    }
    raw.flush()?;
    Ok(times)
}

/// Times in ns as they stand in a table, in ns or in µs.
pub(crate) fn shown(times: &[f64]) -> String {
    let sorted = Sorted::of(times.iter().copied());
    match sorted.median() {
        ..1000.0 => format!("{} ns", sorted.with_spread(0)),
        ..1e5 => format!("{} µs", in_micros(times).with_spread(2)),
        _ => format!("{} µs", in_micros(times).with_spread(0)),
    }
}

/// The shortest of these times, in which nothing else disturbed the work.
pub(crate) fn quickest(times: &[f64]) -> String {
    match times.iter().copied().fold(f64::INFINITY, f64::min) {
        nanos @ ..1000.0 => format!("{nanos:.0} ns"),
        nanos => format!("{:.2} µs", nanos / 1000.0),
    }
}

fn in_micros(times: &[f64]) -> Sorted {
    Sorted::of(times.iter().map(|nanos| nanos / 1000.0))
}

/// The quotients of two works, round by round.
pub(crate) fn ratio(times: &[f64], of: &[f64]) -> Sorted {
    Sorted::of(times.iter().zip(of).map(|(time, of)| time / of))
}
