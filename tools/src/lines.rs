//! Lines for the person at the screen from a program that moves motors or simulates a TXT, written by a thread of their
//! own.
//!
//! A terminal that is paused (Ctrl-S), and a pipe that nobody reads, block whoever writes to them. Here this is only
//! that thread: everybody else leaves a line and goes on. What there is no room for is counted.

use std::collections::HashSet;
use std::io::{self, Write};
use std::panic;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use crossbeam_channel::{bounded, Sender};

use crate::interrupt;
use crate::print::clean;
use crate::queue::{queue, Put, Take};
use crate::zone;

/// How many bytes of lines wait at most.
const ROOM: usize = 256 << 10;

/// How long the end of the program waits for the last lines.
const LAST_LINES: Duration = Duration::from_millis(500);

const MINUTE: Duration = Duration::from_secs(60);

/// Where lines are left. Until there is one, they are written at once.
static QUEUE: OnceLock<Queue> = OnceLock::new();

struct Queue {
    entries: Put<Entry>,
    has_times: bool,
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
    begin(true)
}

/// The same without times: what a simulated TXT logs holds up no client and no page that looks at it, and a warning
/// holds up no recording.
pub(crate) fn never_wait_to_log() -> anyhow::Result<()> {
    begin(false)
}

fn begin(has_times: bool) -> anyhow::Result<()> {
    let (entries, to_write) = queue(ROOM);
    thread::Builder::new()
        .name("lines".to_owned())
        .spawn(move || write(&to_write, &mut io::stderr()))
        .context("the operating system could not start a thread")?;
    if QUEUE.set(Queue { entries, has_times, dropped: AtomicU64::new(0) }).is_ok() {
        panic::set_hook(Box::new(|panic| print(&panic.to_string())));
    }
    Ok(())
}

/// Prints a text, without control characters that came from others. Its lines stay lines.
pub(crate) fn print(text: &str) {
    match QUEUE.get() {
        Some(queue) if queue.has_times => {
            let now = zone::now().strftime("%Y-%m-%d %H:%M:%S%.3f").to_string();
            text.lines().for_each(|line| queue.leave(format!("{now} {}", clean(line))));
        }
        Some(queue) => text.lines().for_each(|line| queue.leave(clean(line).into_owned())),
        // A terminal that has been closed is no reason to stop.
        None => {
            let text: String = text.lines().map(|line| format!("{}\n", clean(line))).collect();
            interrupt::say(move || drop(io::stderr().write_all(text.as_bytes())));
        }
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

/// How many lines of what comes and goes are printed in a minute.
const CHANGES_A_MINUTE: u32 = 40;

/// For what comes and goes: each change is printed, unless there are so many that they would fill a disk.
#[derive(Default)]
pub(crate) struct Changes {
    /// When the minute has begun.
    since: Option<Instant>,
    printed: u32,
    left_out: u64,
}

impl Changes {
    /// The lines that are printed for this change now.
    pub(crate) fn printed_now(&mut self, line: &str, now: Instant) -> Vec<String> {
        let is_over = |since| now.saturating_duration_since(since) >= MINUTE;
        let mut lines = Vec::new();
        if self.since.is_none_or(is_over) {
            if self.left_out > 0 {
                lines.push(format!("{} further changes were left out", self.left_out));
            }
            *self = Self { since: Some(now), ..Self::default() };
        }
        match self.printed {
            CHANGES_A_MINUTE => {
                if self.left_out == 0 {
                    lines.push(
                        "too many changes: further ones of this minute are only counted".to_owned(),
                    );
                }
                self.left_out += 1;
            }
            _ => {
                self.printed += 1;
                lines.push(line.to_owned());
            }
        }
        lines
    }
}

/// How many bytes of messages of the logger are printed in a minute, of errors as many more. What causes them may come
/// again and again, and each time with another number in its message.
const ROOM_A_MINUTE: usize = 16 << 10;

/// Where the logger writes to.
pub(crate) struct Log {
    errors: Repeated,
    others: Repeated,
}

impl Log {
    /// The same message is printed once a minute, and there is a limit for all of them. `all` is for who has asked for
    /// more than warnings: then a message is only left out where it follows itself.
    pub(crate) fn new(all: bool) -> Self {
        let room = (!all).then_some(ROOM_A_MINUTE);
        Self { errors: Repeated::with_room(room), others: Repeated::with_room(room) }
    }
}

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let of_kind =
            if bytes.starts_with(b"[ERROR") { &mut self.errors } else { &mut self.others };
        if let Some(text) = of_kind.printed_now(&String::from_utf8_lossy(bytes), Instant::now()) {
            print(&text);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The messages of the last minute.
pub(crate) struct Repeated {
    /// `None` without a limit. Then only the last message is known.
    room: Option<usize>,
    messages: HashSet<String>,
    bytes: usize,
    /// When the minute has begun.
    since: Option<Instant>,
    /// How often they came again since then.
    again: u64,
    /// How many others came without room for them.
    left_out: u64,
}

impl Default for Repeated {
    fn default() -> Self {
        Self::with_room(Some(ROOM_A_MINUTE))
    }
}

impl Repeated {
    fn with_room(room: Option<usize>) -> Self {
        let messages = HashSet::new();
        Self { room, messages, bytes: 0, since: None, again: 0, left_out: 0 }
    }

    /// What is printed for this message now.
    pub(crate) fn printed_now(&mut self, message: &str, now: Instant) -> Option<String> {
        let is_over = |since| now.saturating_duration_since(since) >= MINUTE;
        let is_other = self.room.is_none() && !self.messages.contains(message);
        let mut text = String::new();
        if is_other || self.since.is_none_or(is_over) {
            text = self.begin(now);
        }
        if self.messages.contains(message) {
            self.again += 1;
        } else if self.room.is_none_or(|room| self.bytes + message.len() <= room) {
            self.bytes += message.len();
            self.messages.insert(message.to_owned());
            text += message;
        } else {
            if self.left_out == 0 {
                text +=
                    "too many different messages: further ones of this minute are only counted\n";
            }
            self.left_out += 1;
        }
        (!text.is_empty()).then_some(text)
    }

    /// Begins another minute; says what was not printed in the last one.
    fn begin(&mut self, now: Instant) -> String {
        let mut text = match (self.again, self.messages.len()) {
            (0, _) => String::new(),
            (again, 1) => format!("the last message came {again} times more\n"),
            (again, _) => format!("messages of the last minute came {again} times more\n"),
        };
        if self.left_out > 0 {
            text += &format!("{} further messages were left out\n", self.left_out);
        }
        *self = Self { since: Some(now), ..Self::with_room(self.room) };
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_that_is_repeated_is_printed_once_a_minute_with_how_often_it_came() {
        let begin = Instant::now();
        let again = "the last message came 2 times more\na".to_owned();
        for (room, last) in [(Some(9), None), (None, Some("a".to_owned()))] {
            let mut repeated = Repeated::with_room(room);
            let mut printed = |seconds, message| {
                repeated.printed_now(message, begin + Duration::from_secs(seconds))
            };
            assert_eq!(printed(0, "a"), Some("a".to_owned()));
            assert_eq!((printed(1, "a"), printed(59, "a")), (None, None));
            assert_eq!(printed(60, "a").as_ref(), Some(&again));
            assert_eq!(printed(61, "b"), Some("b".to_owned()));
            assert_eq!(printed(62, "a"), last, "{room:?}");
        }
    }

    #[test]
    fn messages_that_always_differ_take_no_more_than_their_room_a_minute() {
        let (mut repeated, begin) = (Repeated::with_room(Some(1000)), Instant::now());
        let mut printed = |minute: u64, message: &str| {
            repeated.printed_now(message, begin + MINUTE * u32::try_from(minute).unwrap())
        };
        let texts = (0..10_000).filter_map(|number| printed(0, &format!("message {number}\n")));
        let bytes: usize = texts.map(|text| text.len()).sum();
        assert!((900..1100).contains(&bytes), "{bytes}");
        let next = printed(1, "b").unwrap();
        assert!(next.contains(" further messages were left out\nb"), "{next}");
        assert_eq!(printed(2, "b"), Some("b".to_owned()));
    }

    #[test]
    fn of_what_comes_and_goes_only_so_much_is_printed_in_a_minute() {
        let (mut changes, begin) = (Changes::default(), Instant::now());
        let mut printed = |seconds| changes.printed_now("a", begin + Duration::from_secs(seconds));
        (0..40).for_each(|second| assert_eq!(printed(second), ["a"]));
        assert_eq!(printed(41), ["too many changes: further ones of this minute are only counted"]);
        assert!(printed(42).is_empty());
        assert_eq!(printed(60), ["2 further changes were left out", "a"]);
        assert_eq!(printed(120), ["a"]);
    }

    #[test]
    fn lines_without_room_are_counted_where_they_are_missing() {
        let (entries, to_write) = queue(1000);
        let queue = Queue { entries, has_times: false, dropped: AtomicU64::new(0) };
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
