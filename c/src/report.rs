//! What the library has to say, on the standard error output: programs in C have no logger of their own, and
//! most print only that something failed.

use std::collections::HashMap;
use std::env;
use std::fmt::Display;
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
/// Which of them it was is said later: a callback may not return.
const OFF: &str =
    "all outputs are off, because for half a second the program did not return from a callback, or this computer was \
     too busy";

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
                    // It begins with the controller.
                    let line = record.args().to_string();
                    let peer = line.split_once(": ").map(|(peer, _)| format!("{peer}: "));
                    let peer = peer.unwrap_or_default();
                    write_line(format_args!("{peer}{OFF}"));
                }
                // What a call says was counted already.
                (Level::Error | Level::Warn, target) if target != module_path!() => {
                    let line = LOGGED.lock().line(&record.args().to_string(), Instant::now());
                    line.iter().for_each(write_line);
                }
                _ => write_line(record.args()),
            }
        }
    }

    fn flush(&self) {}
}

fn write_line(line: impl Display) {
    sentences::write(&format!("ft-transfer-area: {line}\n"));
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
/// The same for what the library logs.
static LOGGED: LazyLock<Mutex<Repeated>> = LazyLock::new(Mutex::default);

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
pub(crate) struct Repeated {
    said: HashMap<String, Said>,
    /// When the present minute began.
    minute: Option<Instant>,
    /// How many lines it has.
    lines: usize,
    /// How many were not said, because their minute had too many, or will not be said with a count any more.
    left_out: u64,
}

/// When a sentence was said last, and how often it was true since then.
struct Said {
    at: Instant,
    since: u64,
}

impl Repeated {
    /// How long a sentence is only counted.
    const PAUSE: Duration = Duration::from_secs(60);
    /// So many lines in a minute, and so many sentences: one for each device of an I2C bus, read and written.
    const MOST: usize = 256;
    /// How many bytes of a sentence are said and remembered: a program may give a host any name.
    const LONGEST: usize = 1024;

    /// The line to write now, if there is one.
    pub(crate) fn line(&mut self, sentence: &str, now: Instant) -> Option<String> {
        let is_end = |end: &usize| sentence.is_char_boundary(*end);
        let end = (0..=sentence.len().min(Self::LONGEST)).rev().find(is_end);
        let sentence = &sentence[..end.unwrap_or(0)];
        let pause = |at: Instant| now.saturating_duration_since(at);
        if self.minute.is_none_or(|begun| pause(begun) >= Self::PAUSE) {
            (self.minute, self.lines) = (Some(now), 0);
            // Others have their turn.
            if self.said.len() == Self::MOST {
                self.left_out += self.said.drain().map(|(_, said)| said.since).sum::<u64>();
            }
        }
        if let Some(said) = self.said.get_mut(sentence) {
            said.since += 1;
            if pause(said.at) < Self::PAUSE {
                return None;
            }
        }
        let is_known = self.said.contains_key(sentence);
        if self.lines == Self::MOST || (!is_known && self.said.len() == Self::MOST) {
            self.left_out += u64::from(!is_known);
            return None;
        }
        self.lines += 1;
        let mut line = sentence.to_owned();
        if let Some(before) = self.said.insert(sentence.to_owned(), Said { at: now, since: 0 }) {
            let (since, seconds) = (before.since, pause(before.at).as_secs());
            line += &format!(" ({since} more in {seconds} s)");
        }
        match std::mem::take(&mut self.left_out) {
            0 => {}
            others => line += &format!(" ({others} lines before were too many)"),
        }
        Some(line)
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
    fn of_a_sentence_so_many_bytes_are_said_and_remembered() {
        let (mut repeated, now) = (Repeated::default(), Instant::now());
        let sentence = |number| format!("{number}{}: refused", "ä".repeat(10_000));
        for number in 1..=2 {
            let line = repeated.line(&sentence(number), now).unwrap();
            assert_eq!(line, format!("{number}{}", "ä".repeat(511)));
        }
        assert_eq!(repeated.line(&sentence(1), now), None);
        assert!(repeated.said.keys().all(|sentence| sentence.capacity() <= Repeated::LONGEST));
    }

    #[test]
    fn no_more_than_so_many_are_said_in_a_minute_and_others_have_their_turn() {
        let (mut repeated, begun) = (Repeated::default(), Instant::now());
        let mut said = 0;
        for minute in 0..10 {
            let now = begun + minute * Repeated::PAUSE;
            let before = said;
            // A program that looks for its controller.
            for number in (0..300).cycle().take(900) {
                said += usize::from(repeated.line(&number.to_string(), now).is_some());
            }
            assert!(said - before <= Repeated::MOST && said > before, "{minute}: {said}");
        }
        let line = repeated.line("later", begun + 10 * Repeated::PAUSE).unwrap();
        assert!(
            line.starts_with("later (") && line.ends_with(" lines before were too many)"),
            "{line}"
        );
    }
}
