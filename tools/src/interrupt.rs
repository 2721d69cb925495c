//! Ctrl-C, the end of the session and such, and how a command ends: its last words have a limit.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
#[cfg(target_os = "linux")]
use std::sync::LazyLock;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use std::{io, process};

use anyhow::Context;
use crossbeam_channel::{bounded, Receiver, Sender};
#[cfg(unix)]
use nix::sys::signal::{SigSet, Signal};
#[cfg(unix)]
use signal_hook::flag;
#[cfg(unix)]
use signal_hook::iterator::Signals;

use crate::lines;

/// Signals that come together are one: a terminal sends it to a program and to the script that has started it, which
/// may pass it on.
const TOGETHER: Duration = Duration::from_millis(300);
/// How long a file or a terminal may take for what is written, such as the end of a recording.
const IN_TIME: Duration = Duration::from_secs(3);
/// How long all of the end may take. Nothing that works takes so long: `selftest` looks for its controller for 10 s.
const END: Duration = Duration::from_secs(20);
/// The exit status after a second Ctrl-C, as that of a program which the first one kills.
const STATUS: i32 = 130;

/// There was a signal.
static ASKED: AtomicBool = AtomicBool::new(false);
/// There was a second signal.
static AGAIN: AtomicBool = AtomicBool::new(false);
/// How much drives.
static DRIVING: AtomicUsize = AtomicUsize::new(0);

/// As long as nothing waits for signals, those that who has started this program ignores end it all the same.
#[cfg(target_os = "linux")]
static ENDS_BY_ITSELF: LazyLock<Arc<AtomicBool>> = LazyLock::new(|| Arc::new(true.into()));

/// The command also ends when its standard input does.
static WITH_INPUT: AtomicBool = AtomicBool::new(false);

/// For a command that another process of this program has started, and that should not outlive it: the end of its
/// standard input is as Ctrl-C. To be called before it asks for a receiver.
pub(crate) fn end_with_input() {
    WITH_INPUT.store(true, Ordering::SeqCst);
}

/// A receiver that gets a message with Ctrl-C, SIGTERM, SIGHUP or SIGQUIT; with `nohup`, not with SIGHUP. A program calls
/// this once, before it moves anything.
///
/// A second one ends the program at once, when nothing drives.
pub(crate) fn receiver() -> anyhow::Result<Receiver<()>> {
    #[cfg(unix)]
    return asked_by(&[], &[]);
    #[cfg(not(unix))]
    asked_by()
}

/// The same for a program that drives, which what would suspend it ends, too, such as Ctrl-Z, and other signals that would
/// end it, such as a limit of the processor's time: motors would go on. To be called before it starts a thread.
///
/// What suspends is held back, also in programs that this one starts. A terminal asks again and again for those that have
/// a handler, and a program that is suspended could not end in order.
pub(crate) fn receiver_for_driving() -> anyhow::Result<Receiver<()>> {
    #[cfg(unix)]
    {
        use Signal::*;
        let others = [SIGALRM, SIGVTALRM, SIGPROF, SIGUSR1, SIGUSR2, SIGXCPU];
        #[cfg(target_os = "linux")]
        let of_linux = [SIGIO, SIGPWR, SIGSTKFLT];
        #[cfg(not(target_os = "linux"))]
        let of_linux = [];
        asked_by(&[&others[..], &of_linux].concat(), &[SIGTSTP, SIGTTIN, SIGTTOU])
    }
    #[cfg(not(unix))]
    asked_by()
}

fn asked_by(
    #[cfg(unix)] others: &[Signal],
    #[cfg(unix)] suspending: &[Signal],
) -> anyhow::Result<Receiver<()>> {
    let (sender, interrupted) = bounded(1);
    let asked = Arc::new(Asked { sender, first: Mutex::new(None) });
    #[cfg(unix)]
    if !suspending.is_empty() {
        // All threads take this over from the first one.
        let suspending: SigSet = suspending.iter().copied().collect();
        suspending.thread_block()?;
        let asked = Arc::clone(&asked);
        let wait = move || loop {
            if suspending.wait().is_ok() {
                asked.again();
            }
        };
        thread::Builder::new().name("signals".to_owned()).spawn(wait)?;
    }
    #[cfg(unix)]
    {
        let hangup = (!is_hangup_ignored()).then_some(Signal::SIGHUP);
        let ends = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGQUIT].into_iter().chain(hangup);
        let ends = ends.chain(others.iter().copied()).map(|signal| signal as i32);
        let mut ends = Signals::new(ends).context("signals can't be watched")?;
        let asked = Arc::clone(&asked);
        #[cfg(target_os = "linux")]
        ENDS_BY_ITSELF.store(false, Ordering::SeqCst);
        let wait = move || ends.forever().for_each(|_| asked.again());
        thread::Builder::new().name("ends".to_owned()).spawn(wait)?;
    }
    if WITH_INPUT.load(Ordering::SeqCst) {
        let asked = Arc::clone(&asked);
        let wait = move || {
            // An input that can't be read has ended, too.
            let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
            asked.unless_asked();
        };
        thread::Builder::new().name("input".to_owned()).spawn(wait)?;
    }
    #[cfg(not(unix))]
    {
        let watched = ctrlc::set_handler(move || asked.again()).map_err(|error| match error {
            ctrlc::Error::System(cause) => anyhow::Error::from(cause),
            other => other.into(),
        });
        watched.context("Ctrl-C can't be watched")?;
    }
    Ok(interrupted)
}

/// Whether a closed terminal should not end this process, as `nohup` asks for. What it starts inherits that.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    if let Some(ignored) = ignores(Signal::SIGHUP) {
        return ignored;
    }
    let mut inherits = process::Command::new("sh");
    inherits.args(["-c", "kill -HUP $$"]).stdin(process::Stdio::null());
    inherits.stdout(process::Stdio::null()).stderr(process::Stdio::null());
    inherits.status().is_ok_and(|status| status.success())
}

/// Whether and when the program was asked to end.
struct Asked {
    sender: Sender<()>,
    first: Mutex<Option<Instant>>,
}

impl Asked {
    /// Ctrl-C in a terminal goes to both processes. It is still the first one.
    fn unless_asked(&self) {
        let is_first = self.first.lock().unwrap_or_else(PoisonError::into_inner).is_none();
        if is_first {
            self.again();
        }
    }

    fn again(&self) {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        match *first {
            None => {
                *first = Some(Instant::now());
                ASKED.store(true, Ordering::SeqCst);
                let _ = self.sender.try_send(());
                // Without the thread, there is still the second one.
                let _ = thread::Builder::new().name("end".to_owned()).spawn(end_in_time);
            }
            Some(first) if first.elapsed() < TOGETHER => {}
            Some(_) => {
                AGAIN.store(true, Ordering::SeqCst);
                end_if_asked_again();
            }
        }
    }
}

/// Learns how children end, also where who has started this process ignores that: with a handler, the system keeps it.
/// Otherwise there is none, because it interrupts threads that wait.
pub(crate) fn wait_for_children() {
    #[cfg(target_os = "linux")]
    if ignores(Signal::SIGCHLD) == Some(true) {
        if let Err(error) = flag::register(Signal::SIGCHLD as i32, Arc::default()) {
            log::warn!("the end of a program may not be seen: {error}");
        }
    }
}

/// Whether this process ignores a signal. Only Linux says it.
#[cfg(unix)]
fn ignores(signal: Signal) -> Option<bool> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    let ignored = u64::from_str_radix(ignored.trim(), 16).ok()?;
    Some(ignored >> (signal as i32 - 1) & 1 == 1)
}

/// Has signals end this program also where who has started it holds them back or ignores them, as a script does for what
/// it starts in the background. All threads take this over from the first one.
pub(crate) fn take_ends() {
    #[cfg(unix)]
    {
        let ends: SigSet = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP].into_iter().collect();
        if let Err(error) = ends.thread_unblock() {
            log::warn!("signals may not end this program: {error}");
        }
    }
    #[cfg(target_os = "linux")]
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        if ignores(signal) != Some(true) {
            continue;
        }
        let (signal, ends) = (signal as i32, Arc::clone(&ENDS_BY_ITSELF));
        // With the status that a shell gives to one that it ends.
        if let Err(error) = flag::register_conditional_shutdown(signal, 128 + signal, ends) {
            log::warn!("signals may not end this program: {error}");
        }
    }
}

/// A limit for the size of files (`ulimit -f`) makes an error of a write, not the end of a program that drives.
pub(crate) fn outlive_full_files() {
    #[cfg(unix)]
    if let Err(error) = flag::register(Signal::SIGXFSZ as i32, Arc::default()) {
        log::warn!("a limit for the size of files would end this program: {error}");
    }
}

/// What this thread and those that it starts write to a terminal does not suspend this process, also where that suspends
/// who writes from the background (`stty tostop`).
pub(crate) fn write_from_behind() -> anyhow::Result<()> {
    #[cfg(unix)]
    SigSet::from(Signal::SIGTTOU).thread_block()?;
    Ok(())
}

/// What ends or suspends a whole group, such as a service or a terminal's session, leaves this process alone, as does
/// each other signal but those of a crash.
pub(crate) fn outlive_requests() -> anyhow::Result<()> {
    #[cfg(unix)]
    {
        use Signal::*;
        let mut signals = SigSet::all();
        for crash in [SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGSYS, SIGTRAP] {
            signals.remove(crash);
        }
        signals.thread_block()?;
    }
    Ok(())
}

/// While this is there, motors may have to be stopped first.
pub(crate) struct Driving(());

impl Driving {
    pub(crate) fn begin() -> Self {
        DRIVING.fetch_add(1, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Driving {
    fn drop(&mut self) {
        DRIVING.fetch_sub(1, Ordering::SeqCst);
        end_if_asked_again();
    }
}

/// Whether there was a second Ctrl-C.
pub(crate) fn is_again() -> bool {
    AGAIN.load(Ordering::SeqCst)
}

fn end_if_asked_again() {
    if is_again() && DRIVING.load(Ordering::SeqCst) == 0 {
        process::exit(STATUS);
    }
}

fn end_in_time() {
    let given_up = END - IN_TIME;
    thread::sleep(given_up);
    // What is printed may be what holds it up.
    in_time(move || {
        let seconds = given_up.as_secs();
        lines::print(&format!("the end takes longer than {seconds} s, and is given up"));
        lines::flush();
    });
    process::exit(1);
}

/// Says something. After Ctrl-C these are last words, which have a limit: then `None` says that nobody reads them.
pub(crate) fn say<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    match ASKED.load(Ordering::SeqCst) {
        true => in_time(work),
        false => Some(work()),
    }
}

/// Does what a disk, a pipe or a terminal may block. `None` when that takes too long: then it is left to itself.
pub(crate) fn in_time<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    let (done, result) = bounded(1);
    let work = move || drop(done.send(work()));
    // Without a thread, the result does not come.
    thread::Builder::new().name("in time".to_owned()).spawn(work).ok()?;
    result.recv_timeout(IN_TIME).ok()
}
