//! What the library has to say, on the standard error output: programs in C have no logger of their own, and
//! most print only that something failed.

use std::env;
use std::fmt::Display;

use ft_transfer_area::Error;
use log::{LevelFilter, Log, Metadata, Record};

/// `off`, `error`, `warn`, `info`, `debug` or `trace`.
const VARIABLE: &str = "FT_TXT_LOG";

struct Stderr;

impl Log for Stderr {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.level() <= log::max_level()
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            eprintln!("ft-transfer-area: {}", record.args());
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

/// Writes why a call has failed.
pub(crate) fn failure(what: impl Display) {
    start();
    log::error!("{what}");
}

/// Whether the code that the program gets says it all: a program may start twice, or stop what has ended.
pub(crate) fn is_told_by_code(error: &Error) -> bool {
    matches!(error, Error::AlreadyStarted | Error::NotStarted)
}
