//! The program's logger, which can panic and block.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ft_transfer_area::Error;

use super::panics::ON_PURPOSE;
use super::row::DEADLINE;

/// It panics when it gets the message that a watchdog with this limit has expired.
pub(crate) const PANICS_AT: Duration = Duration::from_millis(313);

/// What all lines about guards contain that are held for long.
const LONG_GUARD: &str = "has held a guard";

static LOGGER: Logger = Logger {
    state: Mutex::new(State { blocks: false, blocked: false, panicked: false, lines: Vec::new() }),
    changed: Condvar::new(),
};

struct Logger {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// Whether it blocks.
    blocks: bool,
    /// Whether a thread is blocked in it.
    blocked: bool,
    panicked: bool,
    /// The lines about guards.
    lines: Vec<String>,
}

pub(crate) fn set() {
    log::set_logger(&LOGGER).unwrap();
    log::set_max_level(log::LevelFilter::Warn);
}

impl Logger {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait(&self, what: &str, mut happened: impl FnMut(&State) -> bool) {
        let waits = |state: &mut State| !happened(state);
        let waited = self.changed.wait_timeout_while(self.state(), DEADLINE, waits);
        let (_state, result) = waited.unwrap_or_else(PoisonError::into_inner);
        assert!(!result.timed_out(), "waited in vain for {what}");
    }
}

impl log::Log for Logger {
    fn enabled(&self, line: &log::Metadata<'_>) -> bool {
        // A real controller does not share the program's logger.
        !line.target().starts_with("ft_transfer_area_simulator")
    }

    fn log(&self, record: &log::Record<'_>) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let line = record.args().to_string();
        let expired = Error::WatchdogExpired { limit: PANICS_AT }.to_string();
        // Behind the name of the controller.
        let panics = line.ends_with(&expired);
        let mut state = self.state();
        state.panicked |= panics;
        if line.contains(LONG_GUARD) {
            state.lines.push(line);
        }
        state.blocked = state.blocks;
        self.changed.notify_all();
        while state.blocks {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.blocked = false;
        drop(state);
        if panics {
            panic!("{ON_PURPOSE}");
        }
    }

    fn flush(&self) {}
}

/// Waits until the logger is about to panic.
pub(crate) fn wait_for_panic() {
    LOGGER.wait("the logger's panic", |state| state.panicked);
}

/// Waits until the logger gets the message that this thread has held a guard for long, and returns the lines about it.
pub(crate) fn wait_for_guard_of(thread: &str) -> Vec<String> {
    let name = format!("{thread:?}");
    LOGGER.wait("the warning", |state| state.lines.iter().any(|line| line.contains(&name)));
    LOGGER.state().lines.iter().filter(|line| line.contains(&name)).cloned().collect()
}

/// The logger blocks until this is dropped. Disturbs other tests.
pub(crate) struct Blocked(());

impl Blocked {
    pub(crate) fn begin() -> Self {
        LOGGER.state().blocks = true;
        Self(())
    }

    /// Waits until a thread is blocked.
    pub(crate) fn wait(&self) {
        LOGGER.wait("a line for the logger", |state| state.blocked);
    }
}

impl Drop for Blocked {
    fn drop(&mut self) {
        LOGGER.state().blocks = false;
        LOGGER.changed.notify_all();
    }
}
