//! Signals to this process, which the program gets too.

#[cfg(unix)]
pub(crate) use unix::{name_in, pass_on_to, stop_passing_on, take_up};
#[cfg(not(unix))]
pub(crate) use windows::{name_in, pass_on_to, stop_passing_on, take_up};

#[cfg(unix)]
mod unix {
    use std::os::unix::process::ExitStatusExt;
    use std::process::{Child, ExitStatus};
    use std::sync::Mutex;
    use std::{io, thread};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level::signal_name;

    /// The child, and a signal that came before it.
    static CHILD: Mutex<(Option<libc::pid_t>, Option<i32>)> = Mutex::new((None, None));

    /// From now on signals do not end this process.
    pub(crate) fn take_up() -> io::Result<()> {
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
        thread::Builder::new().name("signals".into()).spawn(move || {
            for signal in signals.forever() {
                let mut child = CHILD.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                match child.0 {
                    Some(process) => send(process, signal),
                    None => child.1 = Some(signal),
                }
            }
        })?;
        Ok(())
    }

    fn send(process: libc::pid_t, signal: i32) {
        // SAFETY: a call without pointers. The process is a child that was not waited for yet, or has only
        // just ended.
        unsafe { libc::kill(process, signal) };
    }

    /// Passes signals on to this process, also one that has come already.
    pub(crate) fn pass_on_to(process: &Child) {
        let mut child = CHILD.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let id = process.id() as libc::pid_t;
        child.0 = Some(id);
        if let Some(signal) = child.1.take() {
            send(id, signal);
        }
    }

    pub(crate) fn stop_passing_on() {
        CHILD.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).0 = None;
    }

    /// The signal that has ended a process.
    pub(crate) fn name_in(status: ExitStatus) -> String {
        let what = |signal| match signal {
            libc::SIGSEGV => " (memory that is not the program's)",
            libc::SIGFPE => " (a division by zero)",
            libc::SIGABRT => " (abort)",
            libc::SIGKILL => " (it was killed)",
            _ => "",
        };
        match status.signal() {
            Some(signal) => match signal_name(signal) {
                Some(name) => format!("{name}{}", what(signal)),
                None => format!("signal {signal}{}", what(signal)),
            },
            None => status.to_string(),
        }
    }
}

#[cfg(not(unix))]
mod windows {
    use std::io;
    use std::process::{Child, ExitStatus};

    /// A console tells all of its processes of Ctrl-C, so the program needs nothing from this one, which
    /// goes on until the program has ended.
    pub(crate) fn take_up() -> io::Result<()> {
        ctrlc::set_handler(|| {}).map_err(io::Error::other)
    }

    pub(crate) fn pass_on_to(_: &Child) {}

    pub(crate) fn stop_passing_on() {}

    pub(crate) fn name_in(status: ExitStatus) -> String {
        status.to_string()
    }
}
