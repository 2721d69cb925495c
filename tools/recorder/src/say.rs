//! Lines for the program's logger, which may block, as on a paused terminal: the thread that records does not wait for it.

use std::collections::VecDeque;
use std::panic::catch_unwind;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use log::Level;

/// So many lines can wait. More are left out.
const MOST: usize = 16;

/// The lines that wait; `None` while there is no thread that logs them.
static WAITING: Mutex<Option<VecDeque<(Level, String)>>> = Mutex::new(None);
static ALL_LOGGED: Condvar = Condvar::new();

/// Leaves a line for the logger.
pub(crate) fn say(level: Level, text: String) {
    let mut waiting = waiting();
    if let Some(lines) = &mut *waiting {
        if lines.len() < MOST {
            lines.push_back((level, text));
        }
        return;
    }
    let started = thread::Builder::new().name("recorder-log".to_owned()).spawn(log_all);
    *waiting = started.ok().map(|_| VecDeque::from([(level, text)]));
}

/// Waits until all lines are logged, but not for a logger that blocks.
pub(crate) fn finish() {
    const LIMIT: Duration = Duration::from_millis(100);
    let logs = |waiting: &mut Option<_>| waiting.is_some();
    // In both cases it goes on.
    drop(ALL_LOGGED.wait_timeout_while(waiting(), LIMIT, logs));
}

fn log_all() {
    while let Some((level, text)) = next() {
        // A logger that panics logs nothing.
        let _ = catch_unwind(|| log::log!(level, "{text}"));
    }
}

fn next() -> Option<(Level, String)> {
    let mut waiting = waiting();
    let line = waiting.as_mut()?.pop_front();
    if line.is_none() {
        *waiting = None;
        ALL_LOGGED.notify_all();
    }
    line
}

fn waiting() -> MutexGuard<'static, Option<VecDeque<(Level, String)>>> {
    WAITING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{sync_channel, Receiver, SyncSender};

    use super::*;

    /// Logs only after it was allowed to.
    struct Slow {
        allowed: Mutex<Receiver<()>>,
        logged: SyncSender<String>,
    }

    impl log::Log for Slow {
        fn enabled(&self, _: &log::Metadata<'_>) -> bool {
            true
        }

        fn log(&self, record: &log::Record<'_>) {
            let text = record.args().to_string();
            // Not those of other tests.
            if text.starts_with("line ") {
                self.allowed.lock().unwrap().recv().unwrap();
                self.logged.send(text).unwrap();
            }
        }

        fn flush(&self) {}
    }

    #[test]
    fn a_logger_that_blocks_holds_up_nobody_and_gets_the_first_lines_later() {
        let (allow, allowed) = sync_channel(100);
        let (logged, lines) = sync_channel(100);
        let slow = Slow { allowed: Mutex::new(allowed), logged };
        log::set_logger(Box::leak(Box::new(slow))).unwrap();
        log::set_max_level(log::LevelFilter::Warn);
        (0..100).for_each(|number| say(Level::Warn, format!("line {number}")));
        finish();
        assert!(lines.try_recv().is_err());
        (0..100).for_each(|_| allow.send(()).unwrap());
        let limit = Duration::from_secs(30);
        // Other tests may have lines, too.
        for number in 0..MOST / 2 {
            assert_eq!(lines.recv_timeout(limit).unwrap(), format!("line {number}"));
        }
    }
}
