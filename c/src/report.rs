//! What the library has to say, on the standard error output: programs in C have no logger of their own, and
//! most print only that something failed.

use std::collections::HashMap;
use std::env;
use std::fmt::Display;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use ft_transfer_area::Error;
use log::{Level, LevelFilter, Log, Metadata, Record};
use parking_lot::Mutex;

use crate::sentences;

/// `off`, `error`, `warn`, `info`, `debug` or `trace`.
const VARIABLE: &str = "FT_TXT_LOG";

/// Who warns a Rust program that it keeps the areas locked, which this package does for a program in C.
const HELD_LONG: &str = "ft_transfer_area::handler::long_guard";
/// Who warns of the watchdog, which a program in C does not set.
const NOT_ANSWERED: &str = "ft_transfer_area::handler::transfer::side";
const OFF_IN_CALLBACK: &str =
    "ft-transfer-area: all outputs are off, because for half a second the program did not return from a callback";
const OFF_BY_LOAD: &str =
    "ft-transfer-area: all outputs are off, because for half a second this computer was too busy";

/// How many callbacks of the program run in threads of transfers.
static CALLBACKS: AtomicUsize = AtomicUsize::new(0);

/// Runs a callback of the program in the thread of a transfer.
pub(crate) fn in_callback<R>(call: impl FnOnce() -> R) -> R {
    struct Running;
    impl Drop for Running {
        fn drop(&mut self) {
            CALLBACKS.fetch_sub(1, Ordering::Relaxed);
        }
    }
    CALLBACKS.fetch_add(1, Ordering::Relaxed);
    let _running = Running;
    call()
}

struct Stderr;

impl Log for Stderr {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= log::max_level()
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            match (record.level(), record.target()) {
                (Level::Warn, HELD_LONG) => {}
                (Level::Warn, NOT_ANSWERED) => {
                    let why = match CALLBACKS.load(Ordering::Relaxed) {
                        0 => OFF_BY_LOAD,
                        _ => OFF_IN_CALLBACK,
                    };
                    sentences::write(&format!("{why}\n"));
                }
                _ => sentences::write(&format!("ft-transfer-area: {}\n", record.args())),
            }
        }
    }

    fn flush(&self) {}
}

/// Shows warnings and errors from now on, or what the variable says. Does nothing the second time, and when
/// the program, in Rust, has a logger.
pub(crate) fn start() {
    let level = env::var(VARIABLE).ok().and_then(|level| level.parse().ok());
    if log::set_logger(&Stderr).is_ok() {
        log::set_max_level(level.unwrap_or(LevelFilter::Warn));
    }
}

/// What calls have said. A program may make each of them again and again.
static TOLD: LazyLock<Mutex<Repeated>> = LazyLock::new(Mutex::default);

/// Writes why a call has failed: at once, and then once a minute with its count.
pub(crate) fn failure(what: impl Display) {
    write(Level::Error, what);
}

/// The same for what a call does otherwise than the program may expect.
pub(crate) fn warning(what: impl Display) {
    write(Level::Warn, what);
}

fn write(level: Level, what: impl Display) {
    start();
    let line = TOLD.lock().line(&what.to_string(), Instant::now());
    if let Some(line) = line {
        log::log!(level, "{line}");
    }
}

/// Whether the code that the program gets says it all: a program may start twice, or stop what has ended.
pub(crate) fn is_told_by_code(error: &Error) -> bool {
    matches!(error, Error::AlreadyStarted | Error::NotStarted)
}

/// Sentences of calls that a program makes again and again: each is said at once, and after that once a minute
/// with how often it was true meanwhile.
#[derive(Default)]
pub(crate) struct Repeated(HashMap<String, Said>);

/// When a sentence was said last, and how often it was true since then.
struct Said {
    at: Instant,
    since: u32,
}

impl Repeated {
    /// How long a sentence is only counted.
    const PAUSE: Duration = Duration::from_secs(60);
    /// More different sentences are not remembered: one for each device of an I2C bus, read and written.
    const MOST: usize = 256;

    /// The line to write now, if there is one.
    pub(crate) fn line(&mut self, sentence: &str, now: Instant) -> Option<String> {
        let Some(said) = self.0.get_mut(sentence) else {
            if self.0.len() == Self::MOST {
                self.0.clear();
            }
            self.0.insert(sentence.to_owned(), Said { at: now, since: 0 });
            return Some(sentence.to_owned());
        };
        said.since += 1;
        let pause = now.saturating_duration_since(said.at);
        if pause < Self::PAUSE {
            return None;
        }
        let (since, seconds) = (said.since, pause.as_secs());
        *said = Said { at: now, since: 0 };
        Some(format!("{sentence} ({since} more in {seconds} s)"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_is_said_once_and_then_with_how_often_it_was_true() {
        let (mut repeated, begun) = (Repeated::default(), Instant::now());
        let mut line =
            |sentence, seconds| repeated.line(sentence, begun + Duration::from_secs(seconds));
        assert_eq!(line("no device", 0).as_deref(), Some("no device"));
        assert_eq!(line("another", 1).as_deref(), Some("another"));
        for second in 1..60 {
            assert_eq!(line("no device", second), None);
        }
        assert_eq!(line("no device", 90).as_deref(), Some("no device (60 more in 90 s)"));
        assert_eq!(line("no device", 91), None);
        assert_eq!(line("another", 91).as_deref(), Some("another (1 more in 90 s)"));
    }

    #[test]
    fn what_is_remembered_has_a_limit() {
        let (mut repeated, now) = (Repeated::default(), Instant::now());
        for number in 0..10_000 {
            assert!(repeated.line(&number.to_string(), now).is_some());
            assert!(repeated.0.len() <= Repeated::MOST);
        }
    }
}
