//! How late this process was woken: what a limit is longer by on a busy machine.

use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

use super::program::locked;

const STEP: Duration = Duration::from_millis(5);

/// When this process was late, and by how much.
static LATE: Mutex<Vec<(Instant, Duration)>> = Mutex::new(Vec::new());

/// Watches from now on, until the process ends.
pub(crate) fn watch() {
    thread::spawn(|| loop {
        let begin = Instant::now();
        thread::sleep(STEP);
        let late = begin.elapsed().saturating_sub(STEP);
        if late > STEP {
            locked(&LATE).push((begin, late));
        }
    });
}

/// What the machine may have added to what lasted from one time to another. Several threads may have waited
/// for each other, each of them late.
pub(crate) fn between(from: Instant, to: Instant) -> Duration {
    let late = locked(&LATE);
    let concerned = late.iter().filter(|(at, late)| *at + STEP + *late >= from && *at <= to);
    3 * concerned.map(|(_, late)| *late).sum::<Duration>()
}
