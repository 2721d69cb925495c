//! The logger of this program, which can block and panic.

use std::cell::Cell;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use log::{LevelFilter, Log, Metadata, Record};

/// How long a blocked logger takes for a line, as a terminal does after Ctrl-S.
pub(crate) const BLOCKED: Duration = Duration::from_secs(3);

static BLOCKS: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether the next line panics in this thread.
    static PANICS: Cell<bool> = const { Cell::new(false) };
}

struct Logger;

impl Log for Logger {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &Record<'_>) {
        if PANICS.replace(false) {
            resume_unwind(Box::new("in the logger"));
        }
        let warns = record.level() <= LevelFilter::Warn;
        let thread = std::thread::current();
        let simulated = thread.name().is_some_and(|name| name.starts_with("simulated"));
        if BLOCKS.load(Ordering::Relaxed) && warns && !simulated {
            std::thread::sleep(BLOCKED);
        }
    }

    fn flush(&self) {}
}

/// Whether warnings and errors block in this process, but for those of simulated TXTs.
pub(crate) fn set_up(blocks: bool) {
    BLOCKS.store(blocks, Ordering::Relaxed);
    log::set_logger(&Logger).expect("there is no other logger");
    log::set_max_level(LevelFilter::Trace);
}

/// Makes a call during which the next line in this thread panics.
pub(crate) fn panicking<R>(call: impl FnOnce() -> R) -> R {
    /// Not only when the call returns.
    struct Calm;
    impl Drop for Calm {
        fn drop(&mut self) {
            PANICS.set(false);
        }
    }
    let _calm = Calm;
    PANICS.set(true);
    call()
}
