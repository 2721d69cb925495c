//! Says how programs did, in a thread of its own: a terminal that is paused holds up no program that is being played to.

use std::thread::{self, JoinHandle};

use anyhow::Context;

use crate::queue::{queue, Put};
use crate::{interrupt, print};

/// How many bytes of lines wait at most.
const ROOM: usize = 64 << 10;

pub(super) struct Printer {
    lines: Put<String>,
    /// Lines for which there was no room.
    missing: u64,
    thread: JoinHandle<anyhow::Result<()>>,
}

impl Printer {
    pub(super) fn start() -> anyhow::Result<Self> {
        let (lines, to_print) = queue::<String>(ROOM);
        let print = move || -> anyhow::Result<()> {
            while let Ok(line) = to_print.wait() {
                print::line(line)?;
            }
            Ok(())
        };
        let thread = thread::Builder::new().name("printer".to_owned()).spawn(print);
        let thread = thread.context("the operating system could not start a thread")?;
        Ok(Self { lines, missing: 0, thread })
    }

    pub(super) fn leave(&mut self, line: String) {
        let line = match self.missing {
            0 => line,
            missing => {
                format!("{missing} lines are missing here: nobody read them in time\n{line}")
            }
        };
        let bytes = line.capacity();
        self.missing = if self.lines.put(line, bytes) { 0 } else { self.missing + 1 };
    }

    /// Whether nothing can be printed any more.
    pub(super) fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits until all is printed, after Ctrl-C only for a moment.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        let Self { lines, thread, .. } = self;
        drop(lines);
        let ended = interrupt::say(move || thread.join());
        ended.and_then(Result::ok).unwrap_or(Ok(()))
    }
}
