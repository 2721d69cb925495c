//! Tells `tx_run` which controllers may have motors on: a line in a file when a transfer has begun, and another one when
//! its last exchange has switched all outputs off. Without the second one `tx_run` sends that exchange.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use parking_lot::Mutex;

use crate::host;

/// The environment variable with the file.
const VARIABLE: &str = "FT_TXT_TRANSFERS";

/// The file, and the process that has opened it: a child after `fork` opens it anew.
static NOTES: Mutex<Option<(u32, File)>> = Mutex::new(None);

/// A transfer whose motors may be on.
pub(crate) struct Online {
    /// The line for its end. Made before, because the end may come where nothing can be allocated.
    end: String,
    is_over: AtomicBool,
}

impl Online {
    /// The transfer with this host has begun. Before the program's outputs are sent.
    pub(crate) fn begin(host: &str) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let id = format!("{}.{number}", process::id());
        note(&format!("+{id} {host}\n"));
        Self { end: format!("-{id}\n"), is_over: AtomicBool::new(false) }
    }

    /// All outputs are off. Allocates nothing.
    pub(crate) fn end(&self) {
        if !self.is_over.swap(true, Ordering::AcqRel) {
            note(&self.end);
        }
    }
}

/// Adds a line to the file, if there is one.
fn note(line: &str) {
    let mut notes = NOTES.lock();
    if notes.as_ref().is_none_or(|(process, _)| *process != process::id()) {
        let Some(path) = host::variable(VARIABLE) else { return };
        match open(path.as_ref()) {
            Ok(file) => *notes = Some((process::id(), file)),
            Err(error) => {
                return log::warn!(
                    "tx_run can't stop the motors if this program is killed: {error:#}"
                )
            }
        }
    }
    if let Some((_, file)) = &mut *notes {
        // It is small, and `tx_run` has made it.
        let _ = file.write_all(line.as_bytes());
    }
}

fn open(path: &Path) -> io::Result<File> {
    let opened = OpenOptions::new().read(true).append(true).open(path)?;
    // Not in the place of an input or output that the program has closed.
    let file = opened.try_clone()?;
    // Whatever closes the file in this process takes the mark away.
    drop(opened);
    #[cfg(unix)]
    mark(&file)?;
    Ok(file)
}

/// Holds a mark that goes when this process ends or becomes another program.
#[cfg(unix)]
fn mark(file: &File) -> io::Result<()> {
    use std::os::fd::AsRawFd;
    // SAFETY: integers, for which all bits 0 are valid.
    let mut mark: libc::flock = unsafe { std::mem::zeroed() };
    mark.l_type = libc::F_RDLCK as _;
    // SAFETY: the file is open, and the mark is this function's. Nobody else has one that excludes it.
    match unsafe { libc::fcntl(file.as_raw_fd(), libc::F_SETLK, &raw const mark) } {
        -1 => Err(io::Error::last_os_error()),
        _ => Ok(()),
    }
}
