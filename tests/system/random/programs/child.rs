//! The process in which programs run: a fresh one for each batch, because threads and descriptors are counted,
//! and a program that hangs can't be ended in another way.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::mpsc::{channel, RecvTimeoutError, Sender};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::name::Name;
use super::run::Run;
use super::{logger, stalls};

/// How many programs run at the same time. Mostly they wait.
const AT_A_TIME: usize = 8;

/// Longer than any call takes; one that takes longer hangs.
const HANGS: Duration = Duration::from_secs(8);

/// How long threads and descriptors may take to disappear.
const LEFT_LIMIT: Duration = Duration::from_secs(10);

/// Runs the programs that standard input names, one a line, and prints a line for each: what was wrong, and all
/// that happened then.
pub(crate) fn main(blocks: bool) {
    // What panics here does so on purpose, or is reported.
    std::panic::set_hook(Box::new(|_| {}));
    logger::set_up(blocks);
    stalls::watch();
    let names = std::io::stdin().lock().lines().map_while(Result::ok);
    let mut names = names.filter_map(|line| line.parse::<Name>().ok());
    let (threads, descriptors) = (names_of_threads(), count_descriptors());
    let (sender, done) = channel();
    let mut running: BTreeMap<usize, (Name, Arc<Run>)> = BTreeMap::new();
    for number in 0.. {
        while running.len() >= AT_A_TIME {
            report(&mut running, done.recv_timeout(Duration::from_millis(500)));
        }
        let Some(name) = names.next() else { break };
        let run = Arc::new(Run::new(name.plan(), name.seed, blocks));
        running.insert(number, (name, Arc::clone(&run)));
        start(number, run, sender.clone());
    }
    while !running.is_empty() {
        report(&mut running, done.recv_timeout(Duration::from_millis(500)));
    }
    drop((sender, done));
    report_left(&threads, descriptors);
}

fn start(number: usize, run: Arc<Run>, sender: Sender<(usize, Vec<String>, String)>) {
    thread::spawn(move || {
        let result = catch_unwind(AssertUnwindSafe(|| run.carry_out()));
        let breaches = result.unwrap_or_else(|panic| {
            let text = panic.downcast_ref::<String>().map_or("?", String::as_str);
            vec![format!("a thread of the program panics: {text}")]
        });
        let timeline = if breaches.is_empty() { String::new() } else { run.timeline() };
        // Its threads have ended, but its memory may still have handles.
        drop(run);
        let _ = sender.send((number, breaches, timeline));
    });
}

type Done = Result<(usize, Vec<String>, String), RecvTimeoutError>;

fn report(running: &mut BTreeMap<usize, (Name, Arc<Run>)>, done: Done) {
    if let Ok((number, breaches, timeline)) = done {
        if let Some((name, _)) = running.remove(&number) {
            println!("done {name} {breaches:?}\t{timeline:?}");
        }
    }
    let now = Instant::now();
    let hangs = |(name, run): &&(Name, Arc<Run>)| {
        let blocked = if name.blocks() { 3 * logger::BLOCKED } else { Duration::ZERO };
        let since = run.record.longest_call();
        since.is_some_and(|since| now > since + HANGS + blocked + stalls::between(since, now))
    };
    let hanging: Vec<_> = running.values().filter(hangs).collect();
    for (name, run) in &hanging {
        let said = [format!("it hangs: {}", run.record.doing().join("; "))];
        println!("done {name} {said:?}\t{:?}", run.timeline());
    }
    if !hanging.is_empty() {
        // The others are run again.
        std::process::exit(0);
    }
}

/// Prints what all these programs have left over.
fn report_left(threads: &[String], descriptors: usize) {
    let begin = Instant::now();
    loop {
        let (now, open) = (names_of_threads(), count_descriptors());
        if now == threads && open == descriptors {
            println!("clean");
            return;
        }
        if begin.elapsed() > LEFT_LIMIT + stalls::between(begin, Instant::now()) {
            println!("left threads {now:?} instead of {threads:?}, {open} descriptors instead of {descriptors}");
            return;
        }
        thread::sleep(Duration::from_millis(2));
    }
}

fn names_of_threads() -> Vec<String> {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    // The thread that writes to a logger that blocks is still busy.
    let names = names.filter(|name| name.trim() != "ft/log");
    let mut names: Vec<String> = names.map(|name| name.trim().to_owned()).collect();
    names.sort();
    names
}

fn count_descriptors() -> usize {
    // Wine shows those of its own, which come and go.
    if cfg!(windows) {
        return 0;
    }
    std::fs::read_dir("/proc/self/fd").into_iter().flatten().count()
}
