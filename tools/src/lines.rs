//! Lines for the person at the screen from a program that moves motors, written by a thread of their own.
//!
//! A terminal that is paused (Ctrl-S), and a pipe that nobody reads, block whoever writes to them. Here this is only
//! that thread: everybody else leaves a line and goes on. What there is no room for is counted.

use std::io::{self, Write};
use std::panic;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use crossbeam_channel::{bounded, Sender};
use jiff::Zoned;

use crate::print::clean;
use crate::queue::{queue, Put, Take};

/// How many bytes of lines wait at most.
const ROOM: usize = 256 << 10;

/// How long the end of the program waits for the last lines.
const LAST_LINES: Duration = Duration::from_millis(500);

const MINUTE: Duration = Duration::from_secs(60);

/// Where lines are left. Until there is one, they are written at once.
static QUEUE: OnceLock<Queue> = OnceLock::new();

struct Queue {
    entries: Put<Entry>,
    /// Lines for which there was no room.
    dropped: AtomicU64,
}

enum Entry {
    Line(String),
    /// Everything before it is written.
    Flush(Sender<()>),
}

/// From now on nobody waits for the terminal, and each line has its time. Also for messages of panics.
pub(crate) fn never_wait() -> anyhow::Result<()> {
    let (entries, to_write) = queue(ROOM);
    thread::Builder::new()
        .name("lines".to_owned())
        .spawn(move || write(&to_write, &mut io::stderr()))
        .context("the operating system could not start a thread")?;
    if QUEUE.set(Queue { entries, dropped: AtomicU64::new(0) }).is_ok() {
        panic::set_hook(Box::new(|panic| print(&panic.to_string())));
    }
    Ok(())
}

/// Prints a text, without control characters that came from others. Its lines stay lines.
pub(crate) fn print(text: &str) {
    match QUEUE.get() {
        Some(queue) => {
            let now = Zoned::now().strftime("%Y-%m-%d %H:%M:%S%.3f").to_string();
            text.lines().for_each(|line| queue.leave(format!("{now} {}", clean(line))));
        }
        // A terminal that has been closed is no reason to stop.
        None => text.lines().for_each(|line| drop(writeln!(io::stderr(), "{}", clean(line)))),
    }
}

/// Waits for the last lines, but not for a terminal that is paused.
pub(crate) fn flush() {
    let Some(queue) = QUEUE.get() else { return };
    let (done, written) = bounded(1);
    if queue.entries.put(Entry::Flush(done), 0) {
        let _ = written.recv_timeout(LAST_LINES);
    }
}

impl Queue {
    fn leave(&self, line: String) {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        if dropped > 0 {
            let note = format!("{dropped} lines are missing here: nobody read them in time");
            if !self.put(note) {
                self.dropped.fetch_add(dropped, Ordering::Relaxed);
            }
        }
        if !self.put(line) {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn put(&self, line: String) -> bool {
        let bytes = line.capacity();
        self.entries.put(Entry::Line(line), bytes)
    }
}

/// Writes until the program ends.
fn write(entries: &Take<Entry>, to: &mut impl Write) {
    while let Ok(entry) = entries.wait() {
        match entry {
            Entry::Line(line) => drop(writeln!(to, "{line}")),
            Entry::Flush(done) => drop(done.send(())),
        }
    }
}

/// For what would be printed again and again.
#[derive(Default)]
pub(crate) struct Rarely(Option<Instant>);

impl Rarely {
    /// Whether to print it now: once a minute.
    pub(crate) fn is_due(&mut self) -> bool {
        let now = Instant::now();
        let is_due = self.0.is_none_or(|last| now.saturating_duration_since(last) >= MINUTE);
        if is_due {
            self.0 = Some(now);
        }
        is_due
    }
}

/// Where the logger writes to.
#[derive(Default)]
pub(crate) struct Log(Repeated);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(text) = self.0.printed_now(&String::from_utf8_lossy(bytes), Instant::now()) {
            print(&text);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The last message. The same one again and again, as of a program that connects in a loop, is printed once a minute.
#[derive(Default)]
struct Repeated {
    message: String,
    printed: Option<Instant>,
    /// How often it came since then.
    more: u64,
}

impl Repeated {
    /// What is printed for this message now.
    fn printed_now(&mut self, message: &str, now: Instant) -> Option<String> {
        let is_new = |last| now.saturating_duration_since(last) >= MINUTE;
        if self.message == message && !self.printed.is_none_or(is_new) {
            self.more += 1;
            return None;
        }
        let more = match self.more {
            0 => String::new(),
            more => format!("the last message came {more} times more\n"),
        };
        *self = Self { message: message.to_owned(), printed: Some(now), more: 0 };
        Some(more + message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_that_is_repeated_is_printed_once_a_minute_with_how_often_it_came() {
        let (mut repeated, begin) = (Repeated::default(), Instant::now());
        let mut printed =
            |seconds, message| repeated.printed_now(message, begin + Duration::from_secs(seconds));
        assert_eq!(printed(0, "a"), Some("a".to_owned()));
        assert_eq!((printed(1, "a"), printed(59, "a")), (None, None));
        let again = "the last message came 2 times more\na".to_owned();
        assert_eq!(printed(60, "a"), Some(again));
        assert_eq!(printed(61, "b"), Some("b".to_owned()));
        assert_eq!(printed(62, "a"), Some("a".to_owned()));
    }

    #[test]
    fn lines_without_room_are_counted_where_they_are_missing() {
        let (entries, to_write) = queue(1000);
        let queue = Queue { entries, dropped: AtomicU64::new(0) };
        let long = "x".repeat(400);
        (0..5).for_each(|line| queue.leave(format!("{line} {long}")));
        for expected in 0..2 {
            let Some(Entry::Line(line)) = to_write.next() else { panic!("a line") };
            assert_eq!(line, format!("{expected} {long}"));
        }
        let mut written = Vec::new();
        queue.leave("line 5".to_owned());
        drop(queue);
        write(&to_write, &mut written);
        let text = String::from_utf8(written).unwrap();
        assert_eq!(text, "3 lines are missing here: nobody read them in time\nline 5\n");
    }
}
