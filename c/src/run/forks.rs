//! The processes that a program has made by `fork` end with it. Such a process has a copy of the program's connection,
//! so the controller does not notice the program's end, and the process may go on to drive with nobody who stops it.

use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// How long they may take to end by themselves, and how long killing them is tried.
const FAREWELL: Duration = Duration::from_secs(1);
/// How often is looked at them.
const LOOK: Duration = Duration::from_millis(10);

/// Ends all processes that are this program, which itself has ended. Returns whether there were any.
pub(crate) fn end(program: &Path) -> bool {
    let Ok(program) = program.canonicalize() else { return false };
    let send = |all: &[libc::pid_t], signal| {
        // SAFETY: a call without pointers. One that has just ended needs no signal.
        all.iter().for_each(|one| _ = unsafe { libc::kill(*one, signal) });
    };
    let mut left = processes(&program);
    let had_any = !left.is_empty();
    for signal in [libc::SIGTERM, libc::SIGKILL] {
        send(&left, signal);
        let begun = Instant::now();
        while !left.is_empty() && begun.elapsed() < FAREWELL {
            thread::sleep(LOOK);
            left = processes(&program);
            if signal == libc::SIGKILL {
                // Others may have been made meanwhile.
                send(&left, signal);
            }
        }
    }
    had_any
}

/// The processes that are this program. One that has become another program is none of them, and has no connection.
fn processes(program: &Path) -> Vec<libc::pid_t> {
    let names = fs::read_dir("/proc").into_iter().flatten().flatten();
    let is_it = |process: &fs::DirEntry| {
        fs::read_link(process.path().join("exe")).is_ok_and(|path| path == program)
    };
    names.filter(is_it).filter_map(|process| process.file_name().to_str()?.parse().ok()).collect()
}
