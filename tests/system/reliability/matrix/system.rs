//! What only some operating systems have: signals, and limits for a process.

use super::row::Skipped;

#[cfg(unix)]
pub(crate) use unix::*;
#[cfg(windows)]
pub(crate) use windows::*;

/// For tests that need something that Windows has not.
pub(crate) fn only_unix(what: &str) -> Result<(), Skipped> {
    if cfg!(unix) {
        return Ok(());
    }
    Err(Skipped(format!("Windows has no {what}")))
}

#[cfg(unix)]
mod unix {
    use nix::sys::resource::{setrlimit, Resource};
    use nix::sys::signal::{kill, SigSet};
    use nix::unistd::{setuid, Pid, Uid};

    pub(crate) use nix::sys::signal::Signal;

    /// A user whose number of threads is limited, unlike that of root.
    const NOBODY: u32 = 65_534;

    pub(crate) fn signal(process: u32, what: Signal) {
        kill(Pid::from_raw(i32::try_from(process).unwrap()), what).unwrap();
    }

    /// Handles SIGINT, so that it interrupts system calls of this thread. Returns what keeps it from the thread.
    pub(crate) fn take_interrupts() -> impl FnOnce() {
        let mut signal = SigSet::empty();
        signal.add(Signal::SIGINT);
        // The thread that waits for Ctrl-C must not get the signal, so that the reading threads get it.
        signal.thread_block().unwrap();
        ctrlc::set_handler(|| {}).unwrap();
        signal.thread_unblock().unwrap();
        move || signal.thread_block().unwrap()
    }

    pub(crate) fn is_root() -> bool {
        Uid::effective().is_root()
    }

    /// From now on no file and no connection can be opened.
    pub(crate) fn leave_no_descriptor() {
        // Standard input, output and error are open.
        setrlimit(Resource::RLIMIT_NOFILE, 3, 3).unwrap();
    }

    /// From now on no thread can be started.
    pub(crate) fn leave_no_thread() {
        if is_root() {
            setuid(Uid::from_raw(NOBODY)).unwrap();
        }
        setrlimit(Resource::RLIMIT_NPROC, 0, 0).unwrap();
    }
}

/// No test gets as far as these: see [`only_unix`].
#[cfg(windows)]
mod windows {
    #[derive(Clone, Copy, PartialEq, Eq)]
    #[allow(clippy::upper_case_acronyms, reason = "the names of Unix")]
    pub(crate) enum Signal {
        SIGKILL,
        SIGTERM,
        SIGINT,
        SIGABRT,
        SIGSTOP,
        SIGCONT,
    }

    pub(crate) fn signal(_: u32, _: Signal) {
        unreachable!("there are no signals")
    }

    pub(crate) fn take_interrupts() -> impl FnOnce() {
        || unreachable!("there are no signals")
    }

    /// Nobody makes networks of Linux there.
    pub(crate) fn is_root() -> bool {
        false
    }

    pub(crate) fn leave_no_descriptor() {
        unreachable!("there are no such limits")
    }

    pub(crate) fn leave_no_thread() {
        unreachable!("there are no such limits")
    }
}
