//! The processes that a program has made by `fork` end with it. Such a process has a copy of the program's connection,
//! so the controller does not notice the program's end, and the process may go on to drive with nobody who stops it.

use std::collections::{BTreeSet, HashSet};
use std::fs::{self, File};
use std::io;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use crate::child::Left;

/// How long they may take to end by themselves.
const FAREWELL: Duration = Duration::from_secs(1);
/// How long killing them is tried. Those that follow one another quickly are found only by chance on a busy computer.
const KILLING: Duration = Duration::from_secs(5);
/// How often is looked at them, unless one was new: then others may be, too.
const LOOK: Duration = Duration::from_millis(5);
/// None are left when so many looks in a row find none: one look may miss a process that another one has made, which
/// ends, while it goes through all processes.
const EMPTY_LOOKS: u32 = 6;

/// The file of a program, by which the processes that are this program are known.
pub(crate) struct Forks(File);

impl Forks {
    /// While the file has the name that it was made with: the program may change it, or remove it.
    pub(crate) fn of(program: &Path) -> io::Result<Self> {
        File::open(program).map(Self)
    }

    /// Ends all processes that are this program, which itself has ended. Returns whether there were any. These drive.
    pub(crate) fn end(&self, drivers: &BTreeSet<u32>) -> Left {
        let mut had_any = false;
        for (signal, limit) in [(libc::SIGTERM, FAREWELL), (libc::SIGKILL, KILLING)] {
            let (begun, mut has_it, mut empty_looks) = (Instant::now(), HashSet::new(), 0);
            while begun.elapsed() < limit {
                let known = has_it.len();
                let mut send = |process| {
                    if has_it.insert(process) {
                        // SAFETY: a call without pointers. One that has just ended needs no signal.
                        unsafe { libc::kill(process, signal) };
                    }
                };
                // Each gets it as soon as it is found: it may soon be another one.
                let found = self.processes().chain(hidden(drivers)).map(&mut send).count() > 0;
                had_any |= found;
                empty_looks = if found { 0 } else { empty_looks + 1 };
                if empty_looks == EMPTY_LOOKS {
                    return self.left(had_any);
                }
                if has_it.len() == known {
                    thread::sleep(LOOK);
                }
            }
        }
        self.left(had_any)
    }

    fn left(&self, had_any: bool) -> Left {
        match (had_any, self.name()) {
            (true, _) => Left::Ended,
            (false, Some(_)) => Left::Nothing,
            (false, None) => Left::Unknown,
        }
    }

    /// How the system names the file; `None` without `/proc`.
    fn name(&self) -> Option<PathBuf> {
        fs::read_link(format!("/proc/self/fd/{}", self.0.as_raw_fd())).ok()
    }

    /// The processes that are this program. One that has become another program is none of them, and has no connection.
    fn processes(&self) -> impl Iterator<Item = libc::pid_t> {
        // The system names a file alike for both, also one that was renamed or removed. It asks no file system for it,
        // which may be one that does not answer.
        let program = self.name();
        let names = fs::read_dir("/proc").into_iter().flatten().flatten();
        let processes = names.filter_map(|process| process.file_name().to_str()?.parse().ok());
        processes.filter(move |process| program.is_some() && program == file_of(*process))
    }
}

/// Those of these processes that hide what they are, as `PR_SET_DUMPABLE` does. Others that drive are other programs.
fn hidden(drivers: &BTreeSet<u32>) -> impl Iterator<Item = libc::pid_t> + '_ {
    let is_hidden = |process: &libc::pid_t| {
        fs::read_link(format!("/proc/{process}/exe"))
            .is_err_and(|error| error.kind() == io::ErrorKind::PermissionDenied)
    };
    drivers.iter().filter_map(|process| (*process).try_into().ok()).filter(is_hidden)
}

/// The name of the file that a process runs.
fn file_of(process: libc::pid_t) -> Option<PathBuf> {
    let process = PathBuf::from(format!("/proc/{process}"));
    let of = |place: &Path| fs::read_link(place.join("exe"));
    match of(&process) {
        Ok(file) => Some(file),
        // Of another user.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => None,
        // Its first thread may have ended; the others know it.
        Err(_) => {
            let mut threads = fs::read_dir(process.join("task")).into_iter().flatten().flatten();
            threads.find_map(|thread| of(&thread.path()).ok())
        }
    }
}
