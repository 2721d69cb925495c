//! Texts for the error output, written by a thread of their own: where nobody reads it, as at a paused terminal, a call of
//! the program returns all the same, because motors may turn.

use std::collections::VecDeque;
use std::io::Write;
use std::process;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use crate::inside;

/// So many texts can wait, of so many bytes in all, or one that is longer. More are counted.
const MOST: usize = 256;
const MOST_BYTES: usize = 64 << 10;

/// How long who has left a text waits until it is written, so that it usually stands before what the program prints next.
const WAIT: Duration = Duration::from_millis(100);
/// How long the end of a program waits for what is left, when nothing moves.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The newest one. A child after `fork` has it, but not its thread.
static WRITER: AtomicPtr<Writer> = AtomicPtr::new(null_mut());

struct Writer {
    process: u32,
    queue: Mutex<Queue>,
    has_text: Condvar,
    is_written: Condvar,
}

#[derive(Default)]
struct Queue {
    texts: VecDeque<String>,
    /// Of these, and of the text that is being written.
    bytes: usize,
    /// How many have been put in, and written.
    left: u64,
    written: u64,
    /// How many had no room since the last one that had.
    missing: u64,
    /// Somebody has waited in vain, and nothing was written since: others need not wait, too.
    is_stuck: bool,
}

/// To be called before a motor can turn: a signal handler that has something to say may find no memory for a thread.
pub(crate) fn begin() {
    if Writer::of_this_process().is_some() {
        return;
    }
    // The thread holds signals back, too.
    let _inside = inside::enter();
    let (queue, has_text, is_written) = Default::default();
    let new = Box::leak(Box::new(Writer { process: process::id(), queue, has_text, is_written }));
    let new: &Writer = new;
    // Without a thread each text is written by who has it. One of two that begin at once has nothing to do.
    if thread::Builder::new().name("ft/sentences".into()).spawn(|| new.run()).is_ok() {
        WRITER.store(std::ptr::from_ref(new).cast_mut(), Ordering::Release);
    }
}

/// Writes a text. Once a motor can turn, this waits only for a moment.
pub(crate) fn write(text: &str) {
    match Writer::of_this_process() {
        Some(writer) => writer.leave(text),
        None => write_now(text),
    }
}

/// Writes a text behind all others, as soon as somebody reads them: nothing moves any more.
pub(crate) fn write_last(text: &str) {
    if let Some(writer) = Writer::of_this_process() {
        writer.wait_for_all(None);
    }
    write_now(text);
}

/// At the end of the program, when nothing moves.
pub(crate) fn flush() {
    if let Some(writer) = Writer::of_this_process() {
        writer.wait_for_all(Some(Instant::now() + LAST_WORDS));
    }
}

impl Writer {
    fn of_this_process() -> Option<&'static Self> {
        // SAFETY: it is null, or leads to one that is never freed.
        let writer = unsafe { WRITER.load(Ordering::Acquire).as_ref() };
        writer.filter(|it| it.process == process::id())
    }

    fn leave(&self, text: &str) {
        let mut queue = self.queue.lock();
        if !queue.put(text) {
            return;
        }
        self.has_text.notify_one();
        let (own, deadline) = (queue.left, Instant::now() + WAIT);
        while queue.written < own && !queue.is_stuck {
            let waited = self.is_written.wait_until(&mut queue, deadline);
            queue.is_stuck |= waited.timed_out() && queue.written < own;
        }
    }

    fn wait_for_all(&self, deadline: Option<Instant>) {
        let mut queue = self.queue.lock();
        while queue.written < queue.left {
            match deadline {
                None => self.is_written.wait(&mut queue),
                Some(at) if self.is_written.wait_until(&mut queue, at).timed_out() => return,
                Some(_) => {}
            }
        }
    }

    fn run(&self) {
        let mut queue = self.queue.lock();
        loop {
            let Some(text) = queue.texts.pop_front() else {
                self.has_text.wait(&mut queue);
                continue;
            };
            MutexGuard::unlocked(&mut queue, || write_now(&text));
            queue.bytes -= text.len();
            queue.written += 1;
            queue.is_stuck = false;
            self.is_written.notify_all();
        }
    }
}

impl Queue {
    /// Whether there is room for this text.
    fn put(&mut self, text: &str) -> bool {
        if self.texts.len() >= MOST || (self.bytes > 0 && self.bytes + text.len() > MOST_BYTES) {
            self.missing += 1;
            return false;
        }
        let text = match std::mem::take(&mut self.missing) {
            0 => text.to_owned(),
            missing => format!("ft-transfer-area: {missing} lines are missing here, because nobody has read this output\n{text}"),
        };
        self.bytes += text.len();
        self.left += 1;
        self.texts.push_back(text);
        true
    }
}

/// Writes a text. A program goes on without one that nobody can read.
fn write_now(text: &str) {
    // A child after `fork` may have the lock of the usual output as a thread of its parent had it.
    #[cfg(unix)]
    let mut output = {
        use std::os::fd::FromRawFd;
        // SAFETY: the file is not closed here, and nothing but a plain write is done with it.
        std::mem::ManuallyDrop::new(unsafe { std::fs::File::from_raw_fd(libc::STDERR_FILENO) })
    };
    #[cfg(not(unix))]
    let mut output = std::io::stderr();
    let _ = output.write_all(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_has_a_limit_in_texts_and_bytes_and_the_next_one_says_how_many_are_missing() {
        let mut queue = Queue::default();
        assert_eq!((0..300).filter(|_| queue.put("a sentence\n")).count(), MOST);
        queue.texts.pop_front();
        assert!(queue.put("the next one\n"));
        let last = queue.texts.back().unwrap();
        assert!(last.contains(": 44 lines are missing here") && last.ends_with("\nthe next one\n"));
        let (mut queue, long) = (Queue::default(), "x".repeat(MOST_BYTES / 2));
        assert_eq!([(); 3].map(|()| queue.put(&long)), [true, true, false]);
        // One alone may be longer.
        assert!(Queue::default().put(&"x".repeat(2 * MOST_BYTES)));
    }
}
