//! What is logged, written by a thread of its own: the simulated TXT, which logs, answers also where nobody reads it.

use std::io::{self, Write};
use std::sync::mpsc::{sync_channel, SyncSender};
use std::thread;
use std::time::Duration;

use env_logger::{Builder, Env, Target};

/// What is logged unless `RUST_LOG` says more: what a program does that a TXT accepts, but no correct program does. That
/// no I2C device answers is said to the program, or by it.
const LEVELS: &str = "warn,ft_transfer_area_simulator::i2c=error";

/// How many lines wait, and how long one is at most, in bytes.
const MOST: usize = 256;
const LONGEST: usize = 4096;

/// How long the end waits for the last lines.
const LAST_LINES: Duration = Duration::from_millis(500);

enum Entry {
    Line(Vec<u8>),
    /// All before it is written.
    Flush(SyncSender<()>),
}

/// Leaves lines for the thread.
struct Lines {
    entries: SyncSender<Entry>,
    /// Lines for which there was no room.
    missing: u64,
}

/// The end of the log.
pub(crate) struct Log(Option<SyncSender<Entry>>);

/// Begins to log.
pub(crate) fn begin() -> Log {
    let mut log = Builder::from_env(Env::default().default_filter_or(LEVELS));
    let (entries, to_write) = sync_channel(MOST);
    let write = move || {
        for entry in to_write {
            match entry {
                // Nobody reads it when the terminal is gone.
                Entry::Line(line) => drop(io::stderr().lock().write_all(&line)),
                Entry::Flush(done) => drop(done.send(())),
            }
        }
    };
    // Without a thread, who logs writes.
    let started = thread::Builder::new().name("log".to_owned()).spawn(write).ok();
    let log_to = started.map(|_| entries);
    if let Some(entries) = log_to.clone() {
        log.target(Target::Pipe(Box::new(Lines { entries, missing: 0 })));
    }
    log.init();
    Log(log_to)
}

impl Log {
    /// Waits for the last lines, if somebody reads them.
    pub(crate) fn finish(&self) {
        let Some(entries) = &self.0 else { return };
        let (done, written) = sync_channel(1);
        if entries.try_send(Entry::Flush(done)).is_ok() {
            let _ = written.recv_timeout(LAST_LINES);
        }
    }
}

impl Write for Lines {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let mut text = match self.missing {
            0 => Vec::new(),
            missing => {
                format!("tx_run: {missing} lines are missing here: nobody read them in time\n")
                    .into_bytes()
            }
        };
        text.extend_from_slice(&line[..line.len().min(LONGEST)]);
        let has_room = self.entries.try_send(Entry::Line(text)).is_ok();
        self.missing = if has_room { 0 } else { self.missing + 1 };
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
