//! Runs many programs at the same time.

use std::path::Path;
use std::process::ExitCode;
use std::sync::mpsc::channel;
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use super::batch::{self, Outcome};
use super::name::Name;
use super::options::{Options, What};
use super::program::locked;
use super::shrink::{repeat, shrink, REPEATS};

/// How many processes run at the same time.
const PROCESSES: usize = 2;
/// How many programs a process runs.
const BATCH: usize = 40;
/// How long a failing program is made smaller.
const SHRINK_LIMIT: Duration = Duration::from_secs(120);

/// Names of programs in batches: those of one batch have the same kind of logger.
struct Batches {
    next: u64,
    left: u64,
    /// Those that wait for others of their kind.
    waiting: [Vec<Name>; 2],
}

impl Batches {
    fn new(from: u64, runs: u64) -> Self {
        Self { next: from, left: runs, waiting: Default::default() }
    }

    fn next(&mut self) -> Option<Vec<Name>> {
        while self.left > 0 && self.waiting.iter().all(|waiting| waiting.len() < BATCH) {
            let name = Name::new(self.next);
            self.next += 1;
            self.left -= 1;
            self.waiting[usize::from(name.blocks())].push(name);
        }
        let fullest = self.waiting.iter_mut().max_by_key(|waiting| waiting.len())?;
        Some(std::mem::take(fullest)).filter(|batch| !batch.is_empty())
    }
}

/// What came of many runs.
struct Summary {
    runs: u64,
    failures: Vec<Outcome>,
    took: Duration,
}

/// Runs programs until one of these limits; `tell` gets each failure.
fn run_many(
    from: u64,
    runs: u64,
    limit: Duration,
    until_failure: bool,
    tell: &dyn Fn(u64, &Outcome),
) -> Summary {
    let begin = Instant::now();
    let batches = Mutex::new(Batches::new(from, runs));
    let (mut count, mut failures) = (0, Vec::new());
    let stop = std::sync::atomic::AtomicBool::new(false);
    thread::scope(|scope| {
        let (sender, outcomes) = channel();
        for _ in 0..PROCESSES {
            let sender = sender.clone();
            let (batches, stop) = (&batches, &stop);
            scope.spawn(move || {
                while begin.elapsed() < limit && !stop.load(std::sync::atomic::Ordering::SeqCst) {
                    let Some(names) = locked(batches).next() else { return };
                    batch::run(&names, &mut |outcome| {
                        let _ = sender.send(outcome);
                    });
                }
            });
        }
        drop(sender);
        for outcome in outcomes {
            count += 1;
            if outcome.failed() {
                tell(count, &outcome);
                failures.push(outcome);
                if until_failure {
                    stop.store(true, std::sync::atomic::Ordering::SeqCst);
                }
            }
        }
    });
    Summary { runs: count, failures, took: begin.elapsed() }
}

/// Keeps a failing run in a file, because it may not fail again soon.
fn keep(outcome: &Outcome) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("random");
    let file = folder.join(outcome.name.to_string().replace('/', "_"));
    let kept =
        std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, describe(outcome)));
    if let Err(error) = kept {
        println!("{} is not written: {error}", file.display());
    }
}

/// What is printed of a program that fails.
fn describe(outcome: &Outcome) -> String {
    let Outcome { name, said, timeline } = outcome;
    format!("{name} fails: {said}\n{:#?}\n{timeline}", name.plan())
}

/// Fails with the first program that fails, made smaller.
pub(crate) fn in_tests(runs: u64) -> Result<(), String> {
    let summary = run_many(1, runs, Duration::MAX, false, &|_, _| {});
    let Some(first) = summary.failures.first() else { return Ok(()) };
    let smallest = shrink(first.clone(), SHRINK_LIMIT);
    Err(format!(
        "{} of {} programs fail; the first one is\n{}: {}\nand the smallest one found from it:\n{}",
        summary.failures.len(),
        summary.runs,
        first.name,
        first.said,
        describe(&smallest),
    ))
}

/// Does what the command line says.
pub(crate) fn for_hours(options: &Options) -> ExitCode {
    match &options.what {
        What::Repeat(name) => {
            let (first, failures) = repeat(name, REPEATS);
            match first {
                Some(first) => println!("{}", describe(&first)),
                None => println!("{:#?}", name.plan()),
            }
            println!("{failures} of {REPEATS} runs of {name} fail");
            ExitCode::from(u8::from(failures > 0))
        }
        What::Shrink(name) => {
            let (first, failures) = repeat(name, REPEATS);
            println!("{failures} of {REPEATS} runs of {name} fail");
            let Some(first) = first else { return ExitCode::SUCCESS };
            println!("{}", describe(&shrink(first, SHRINK_LIMIT)));
            ExitCode::FAILURE
        }
        What::Run { runs, limit } => {
            let tell = |count: u64, outcome: &Outcome| {
                println!("run {count}: {} fails: {}", outcome.name, outcome.said);
                keep(outcome);
            };
            let until_failure = options.until_failure;
            let summary = run_many(options.from, *runs, *limit, until_failure, &tell);
            let Summary { runs, failures, took } = summary;
            println!("{runs} programs in {took:.0?}, {} failures", failures.len());
            if let Some(first) = failures.first().filter(|_| !until_failure) {
                println!("{}", describe(&shrink(first.clone(), SHRINK_LIMIT)));
            }
            ExitCode::from(u8::from(!failures.is_empty()))
        }
    }
}
