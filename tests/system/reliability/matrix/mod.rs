//! The fault matrix: what a program sees of each fault, how soon, and what stops the motors.
//!
//! Each row of the table in `docs/reliability_matrix.md` is a test here, and the test checks the text of
//! the row. To write the table again with the figures of a run:
//!
//! ```text
//! WRITE_RELIABILITY=1 cargo test --workspace --test reliability
//! ```

mod beside;
mod child;
mod connecting;
mod controller;
mod document;
mod ends;
mod fake;
mod figures;
mod hook;
mod load;
mod logger;
mod network;
mod pairs;
mod panics;
mod process;
mod races;
mod reconnecting;
mod row;
mod services;
mod system;
mod values;
mod watchdog;
mod wire;

use std::process::ExitCode;
use std::sync::{Arc, RwLock};
use std::thread;
use std::time::{Duration, Instant};

use libtest_mimic::{Arguments, Completion, Trial};

use row::{Promise, Row, Skipped, Turn, DEADLINE};

/// How many rows run at the same time. Mostly they wait, but under Wine a system call takes long.
const AT_A_TIME: usize = if cfg!(windows) { 8 } else { 32 };

/// The threads of handlers, and the one for the logger.
const OURS: [&str; 4] = ["ft/transfer", "ft/camera", "ft/hook", "ft/log"];

pub(crate) fn main() -> ExitCode {
    if let Some(role) = child::role() {
        child::play(&role);
        return ExitCode::SUCCESS;
    }
    panics::be_quiet();
    logger::set();
    let mut args = Arguments::from_args();
    args.test_threads.get_or_insert(AT_A_TIME);
    let mut rows = rows();
    let gate = Arc::new(RwLock::new(()));
    let mut trials: Vec<Trial> = Vec::new();
    for turn in [Turn::First, Turn::WithOthers, Turn::Alone] {
        for row in rows.iter_mut().filter(|row| row.turn == turn) {
            trials.extend(trials_of(row, &gate));
        }
    }
    network::clean_up();
    let conclusion = libtest_mimic::run(&args, trials);
    network::clean_up();
    let is_whole = args.filter.is_none() && args.skip.is_empty() && !args.list;
    let checked = match std::env::var_os("WRITE_RELIABILITY") {
        Some(_) if is_whole => document::write(&rows).and_then(|()| document::check(&rows)),
        _ => document::check(&rows),
    };
    if let Err(mistakes) = checked {
        eprintln!("{mistakes}");
        return ExitCode::FAILURE;
    }
    if let Err(left) = check_nothing_left() {
        eprintln!("{left}");
        return ExitCode::FAILURE;
    }
    conclusion.exit_code()
}

/// Whether all threads of all handlers have ended.
fn check_nothing_left() -> Result<(), String> {
    let begin = Instant::now();
    loop {
        let left = threads().into_iter().filter(|name| OURS.contains(&name.as_str()));
        let left: Vec<String> = left.collect();
        if left.is_empty() {
            return Ok(());
        }
        if begin.elapsed() > DEADLINE {
            return Err(format!("threads are left: {left:?}"));
        }
        // The system removes a thread from its list shortly after it was joined.
        thread::sleep(Duration::from_millis(1));
    }
}

/// The names of this program's threads.
fn threads() -> Vec<String> {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    names.map(|name| name.trim().to_owned()).collect()
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    rows.extend(wire::rows());
    rows.extend(reconnecting::rows());
    rows.extend(connecting::rows());
    rows.extend(services::rows());
    rows.extend(panics::rows());
    rows.extend(hook::rows());
    rows.extend(values::rows());
    rows.extend(watchdog::rows());
    rows.extend(ends::rows());
    rows.extend(pairs::rows());
    rows.extend(races::rows());
    rows.extend(figures::rows());
    rows.extend(process::rows());
    rows.extend(load::rows());
    rows.extend(network::rows());
    rows
}

/// The tests of a row.
fn trials_of(row: &mut Row, gate: &Arc<RwLock<()>>) -> Vec<Trial> {
    let promise = Promise::from(&*row);
    let (turn, name) = (row.turn, row.name());
    let tests = std::mem::take(&mut row.tests);
    let trial = |(place, run): (String, row::Run)| {
        let name = if place.is_empty() { name.clone() } else { format!("{name}: {place}") };
        let (promise, gate, shown) = (promise.clone(), Arc::clone(gate), name.clone());
        Trial::ignorable_test(name, move || {
            let result = if turn == Turn::Alone {
                let _alone = gate.write();
                promise.check(run)
            } else {
                let _with_others = gate.read();
                promise.check(run)
            };
            match result? {
                Ok(()) => Ok(Completion::Completed),
                Err(Skipped(reason)) => {
                    eprintln!("skipped: {shown}: {reason}");
                    Ok(Completion::ignored_with(reason))
                }
            }
        })
    };
    tests.into_iter().map(trial).collect()
}
