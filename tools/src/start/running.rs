//! What was started on the page: another process of this program, which ends when its standard input does, however this
//! process ends.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{bail, Context};
use crossbeam_channel::{bounded, Receiver, RecvTimeoutError};
use serde_json::{json, Value};

use super::page::{Kind, Wanted};
use crate::guardian::this_program;
use crate::{print, WITH_INPUT};

/// How long a command may take to print the address of its page.
const START_LIMIT: Duration = Duration::from_secs(10);
/// How long to read why one has ended, where another process has its standard error, too.
const WORDS_LIMIT: Duration = Duration::from_secs(1);
/// How long the commands may take to end, all together. A panel waits for its controllers.
const END_LIMIT: Duration = Duration::from_secs(8);
const LOOK: Duration = Duration::from_millis(10);
/// How long a line may be, in bytes.
const LINE: u64 = 4096;

static NEXT: AtomicU64 = AtomicU64::new(0);

pub(super) struct Running {
    pub(super) id: u64,
    wanted: Wanted,
    pub(super) url: String,
    /// Where programs connect to, if it is for programs.
    address: Option<String>,
    child: Child,
    /// Closed, it asks the command to end.
    input: Option<ChildStdin>,
}

impl Running {
    pub(super) fn start(wanted: Wanted) -> anyhow::Result<Self> {
        let mut child = this_program()?
            .arg(WITH_INPUT)
            .args(wanted.words()?)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        let input = child.stdin.take();
        let lines = read(child.stdout.take().context("it has no standard output")?)?;
        let errors = read(child.stderr.take().context("it has no standard error")?)?;
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let mut running = Self { id, wanted, url: String::new(), address: None, child, input };
        let begun = running.wait_for_page(&lines);
        if matches!(begun, Ok(true)) {
            return Ok(running);
        }
        end(vec![running]);
        begun?;
        let deadline = Instant::now() + WORDS_LIMIT;
        let words = std::iter::from_fn(|| errors.recv_deadline(deadline).ok()).last();
        bail!("{}", words.context("it has ended without a word")?)
    }

    /// Reads the first lines, up to the address of the page; `false` if it ends before.
    fn wait_for_page(&mut self, lines: &Receiver<String>) -> anyhow::Result<bool> {
        let deadline = Instant::now() + START_LIMIT;
        loop {
            let line = match lines.recv_deadline(deadline) {
                Ok(line) => line,
                Err(RecvTimeoutError::Disconnected) => return Ok(false),
                Err(RecvTimeoutError::Timeout) => bail!("it has not started in time"),
            };
            let last = line.rsplit(' ').next().unwrap_or_default();
            if last.starts_with("http://") {
                last.clone_into(&mut self.url);
                return Ok(true);
            }
            if line.starts_with("main ") || line.starts_with("program ") {
                self.address = Some(last.to_owned());
            }
        }
    }

    pub(super) fn is(&self, wanted: &Wanted) -> bool {
        self.wanted == *wanted
    }

    /// Whether the other one can't run beside this one. A page of lessons goes on to any lesson.
    pub(super) fn excludes(&self, wanted: &Wanted) -> bool {
        self.is(wanted) || [self.wanted.kind, wanted.kind] == [Kind::Lesson; 2]
    }

    /// It was asked to end. Until it has, it keeps its ports and its controller.
    pub(super) fn ends(&self) -> bool {
        self.input.is_none()
    }

    pub(super) fn json(&self) -> Value {
        let Wanted { kind, name } = &self.wanted;
        json!({ "id": self.id, "kind": kind, "name": name, "url": self.url, "address": self.address })
    }

    pub(super) fn ask_to_end(&mut self) {
        drop(self.input.take());
    }

    pub(super) fn has_ended(&mut self) -> bool {
        !matches!(self.child.try_wait(), Ok(None))
    }
}

/// Asks all to end, and waits for them. One that hangs ends by its own limit.
pub(super) fn end(mut all: Vec<Running>) {
    all.iter_mut().for_each(Running::ask_to_end);
    wait(|| all.iter_mut().all(Running::has_ended));
}

/// Waits for the end of commands that were asked to end, but not forever.
pub(super) fn wait(mut have_ended: impl FnMut() -> bool) {
    let deadline = Instant::now() + END_LIMIT;
    while Instant::now() < deadline && !have_ended() {
        thread::sleep(LOOK);
    }
}

/// Reads lines to the end, so that the command never waits for a reader. The first ones come.
fn read(from: impl Read + Send + 'static) -> anyhow::Result<Receiver<String>> {
    let (sender, lines) = bounded(64);
    let read = move || {
        let mut from = BufReader::new(from);
        let mut line = Vec::new();
        while from.by_ref().take(LINE).read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
            let text = String::from_utf8_lossy(&line);
            // Without room, it is thrown away.
            let _ = sender.try_send(print::clean(text.trim_end()).into_owned());
            line.clear();
        }
    };
    thread::Builder::new().name("output".to_owned()).spawn(read)?;
    Ok(lines)
}
