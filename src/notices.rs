//! Lines for the program's logger, written by a thread of their own.
//!
//! A logger may block, as when the terminal is paused or a pipe is full, and it may panic. Nothing that stops
//! motors must wait for it. So the threads of this crate, of the recorder and of a simulated TXT leave their lines here,
//! which never blocks. The thread that writes them is started for the first line, and ends when none is left.

use std::collections::VecDeque;
use std::fmt;
use std::io::{self, Write};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::time::{Duration, Instant};

use log::{Level, LevelFilter, Record};
use parking_lot::{Condvar, Mutex};

/// So many lines can wait for a logger that blocks. More are counted.
const MOST: usize = 256;
/// How long a line may be, in bytes. A program may give a thread any name.
const LONGEST: usize = 4096;

static QUEUE: Mutex<Queue> =
    Mutex::new(Queue { lines: VecDeque::new(), lost: 0, is_written: false });
static ALL_WRITTEN: Condvar = Condvar::new();

struct Queue {
    lines: VecDeque<Line>,
    /// Lines for which there was no place since the last one that had one.
    lost: u64,
    /// Whether there is a thread that writes.
    is_written: bool,
}

struct Line {
    level: Level,
    target: &'static str,
    text: String,
    to_logger: bool,
    /// How many are missing before it.
    missing: u64,
}

/// Leaves a line for the logger, with the level, as `log`'s macros do. Never blocks.
macro_rules! notice {
    ($level:ident, $($text:tt)+) => {
        $crate::notices::leave(log::Level::$level, module_path!(), format_args!($($text)+))
    };
}
pub(crate) use notice;

/// Leaves a line for the logger: a module and a text. Never blocks; without room the line is counted, and left out.
pub fn leave(level: Level, target: &'static str, text: fmt::Arguments<'_>) {
    if level <= log::max_level() {
        push(Line { level, target, text: text.to_string(), to_logger: true, missing: 0 });
    }
}

/// Leaves a warning that the program must see: without a logger it goes to the standard error.
pub(crate) fn warn_always(target: &'static str, text: fmt::Arguments<'_>) {
    let to_logger = log::max_level() != LevelFilter::Off;
    push(Line { level: Level::Warn, target, text: text.to_string(), to_logger, missing: 0 });
}

/// Waits until all lines are written, but not longer than `limit`.
pub fn flush(limit: Duration) {
    let deadline = Instant::now() + limit;
    let mut queue = QUEUE.lock();
    while queue.is_written && !ALL_WRITTEN.wait_until(&mut queue, deadline).timed_out() {}
}

fn push(mut line: Line) {
    let is_end = |end: &usize| line.text.is_char_boundary(*end);
    let end = (0..=line.text.len().min(LONGEST)).rev().find(is_end);
    line.text.truncate(end.unwrap_or(0));
    line.text.shrink_to_fit();
    let mut queue = QUEUE.lock();
    if queue.lines.len() >= MOST {
        queue.lost += 1;
        return;
    }
    line.missing = std::mem::take(&mut queue.lost);
    queue.lines.push_back(line);
    if std::mem::replace(&mut queue.is_written, true) {
        return;
    }
    drop(queue);
    let thread = std::thread::Builder::new().name("ft/log".to_owned()).spawn(write_all);
    if thread.is_err() {
        // Perhaps there is one for the next line.
        QUEUE.lock().is_written = false;
    }
}

fn write_all() {
    loop {
        let mut queue = QUEUE.lock();
        let line = queue.lines.pop_front();
        let missing = match &line {
            Some(line) => line.missing,
            None => std::mem::take(&mut queue.lost),
        };
        if line.is_none() && missing == 0 {
            queue.is_written = false;
            ALL_WRITTEN.notify_all();
            return;
        }
        drop(queue);
        if missing > 0 {
            write(&not_written(missing));
        }
        line.iter().for_each(write);
    }
}

fn not_written(lines: u64) -> Line {
    let text = format!("{lines} lines were not written, because the logger was too slow");
    Line { level: Level::Warn, target: module_path!(), text, to_logger: true, missing: 0 }
}

/// Writes a warning in one piece, so that nothing comes between.
fn write_warning(out: &mut impl Write, text: &str) -> io::Result<()> {
    out.write_all(format!("ft-transfer-area: warning: {text}\n").as_bytes())
}

fn write(line: &Line) {
    // The panic of a logger was printed by the panic hook, and the next lines may be written.
    let _ = catch_unwind(AssertUnwindSafe(|| {
        if line.to_logger {
            let mut record = Record::builder();
            record.level(line.level).target(line.target).module_path_static(Some(line.target));
            let logger = log::logger();
            if logger.enabled(record.build().metadata()) {
                logger.log(&record.args(format_args!("{}", line.text)).build());
            }
        } else {
            // A standard error that is closed is no reason to stop.
            let _ = write_warning(&mut std::io::stderr(), &line.text);
        }
    }));
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;

    /// Notes each write.
    struct Writes(Vec<Vec<u8>>);

    impl Write for Writes {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.push(bytes.to_vec());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_warning_is_written_in_one_piece() {
        let mut writes = Writes(Vec::new());
        write_warning(&mut writes, "a guard").unwrap();
        assert_eq!(writes.0, [b"ft-transfer-area: warning: a guard\n"]);
    }
}
