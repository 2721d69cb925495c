//! What ends a program on systems with signals.

use std::env;
use std::ffi::{c_int, c_void};
#[cfg(target_os = "linux")]
use std::fs;
use std::io;
use std::mem::{self, transmute, zeroed};
use std::path::PathBuf;
use std::process;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::{end_all, goes_on, Stack, ANSWER_LIMIT, LOCK_LIMIT};
use crate::ffi::guarded;
use crate::inside;
use crate::online::is_of_tx_run;
use crate::posix::terminal_again;

/// The signals that end a program by default on all systems, with their names, except those of a crash.
const ENDS: [(c_int, &str); 12] = [
    (libc::SIGINT, "Ctrl-C"),
    (libc::SIGTERM, "SIGTERM"),
    (libc::SIGHUP, "SIGHUP"),
    (libc::SIGQUIT, "SIGQUIT"),
    (libc::SIGPIPE, "SIGPIPE"),
    (libc::SIGALRM, "SIGALRM"),
    (libc::SIGVTALRM, "SIGVTALRM"),
    (libc::SIGPROF, "SIGPROF"),
    (libc::SIGUSR1, "SIGUSR1"),
    (libc::SIGUSR2, "SIGUSR2"),
    (libc::SIGXCPU, "SIGXCPU"),
    (libc::SIGXFSZ, "SIGXFSZ"),
];

/// All that end a program by default.
pub(crate) fn ends() -> impl Iterator<Item = (c_int, &'static str)> {
    ENDS.into_iter().chain(ends_of_linux())
}

/// Timers and inputs that say when they are ready use these.
#[cfg(target_os = "linux")]
fn ends_of_linux() -> impl Iterator<Item = (c_int, &'static str)> {
    let named =
        [(libc::SIGPOLL, "SIGPOLL"), (libc::SIGPWR, "SIGPWR"), (libc::SIGSTKFLT, "SIGSTKFLT")];
    let real_time = libc::SIGRTMIN()..=libc::SIGRTMAX();
    named.into_iter().chain(real_time.map(|signal| (signal, "a real-time signal")))
}

#[cfg(not(target_os = "linux"))]
fn ends_of_linux() -> [(c_int, &'static str); 0] {
    []
}

/// Those that suspend it by default: Ctrl-Z, and when it uses the terminal in the background.
pub(crate) const SUSPENDS: [(c_int, &str); 3] =
    [(libc::SIGTSTP, "Ctrl-Z"), (libc::SIGTTIN, "SIGTTIN"), (libc::SIGTTOU, "SIGTTOU")];

/// The signals of a crash.
const CRASHES: [(c_int, &str); 7] = [
    (libc::SIGSEGV, "SIGSEGV"),
    (libc::SIGBUS, "SIGBUS"),
    (libc::SIGFPE, "SIGFPE"),
    (libc::SIGILL, "SIGILL"),
    (libc::SIGABRT, "SIGABRT"),
    (libc::SIGTRAP, "SIGTRAP"),
    (libc::SIGSYS, "SIGSYS"),
];

/// How often the thread looks for a signal.
const LOOK: Duration = Duration::from_millis(20);
/// How long a program that is asked to end goes on at most. The last exchange may follow an answer that comes late.
const END_LIMIT: Duration = ANSWER_LIMIT.saturating_add(Duration::from_millis(500));

/// The process that has the threads; 0 for none. A child after `fork` has this value, but not the threads.
static WATCHED_BY: AtomicU32 = AtomicU32::new(0);
/// The first signal that has asked the program to end; 0 for none.
static CAME: AtomicI32 = AtomicI32::new(0);
/// Whether the program has crashed, and whether its transfers have ended since then.
static CRASHED: AtomicBool = AtomicBool::new(false);
static ENDED: AtomicBool = AtomicBool::new(false);
/// How often the transfers were to end, and how often they have.
static ASKED: AtomicU32 = AtomicU32::new(0);
static DONE: AtomicU32 = AtomicU32::new(0);
/// Whether a signal has come that suspends the program.
static SUSPEND: AtomicBool = AtomicBool::new(false);

/// Whoever changes which signals are taken up. A child after `fork` may find it locked for ever.
static TAKES_UP: Mutex<()> = Mutex::new(());

/// Has this called when the program returns from `main` or calls `exit`, with glibc also `quick_exit`.
pub(crate) fn at_exit(function: extern "C" fn()) {
    type AtQuickExit = unsafe extern "C" fn(extern "C" fn(), *const c_void) -> c_int;
    // SAFETY: the callers' functions live as long as this library, and do not unwind. The other function is the one
    // behind `at_quick_exit`, whose function gets an argument that it need not take.
    unsafe {
        libc::atexit(function);
        let found = libc::dlsym(libc::RTLD_DEFAULT, c"__cxa_at_quick_exit".as_ptr());
        if !found.is_null() {
            transmute::<*mut c_void, AtQuickExit>(found)(function, ptr::null());
        }
    }
}

/// Has Python call this before it ends. After Ctrl-C that nothing in the program takes, it ends itself by the signal
/// with its default action, so no function of `atexit` is called.
pub(super) fn at_exit_of_python(function: extern "C" fn()) {
    type PyAtExit = unsafe extern "C" fn(extern "C" fn()) -> c_int;
    // A program that only has Python within it may go on when that has ended.
    let is_python = |file: PathBuf| {
        let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        name.starts_with("python")
    };
    if !env::current_exe().is_ok_and(is_python) {
        return;
    }
    // SAFETY: the name is that of one function of Python, which keeps the function of this library. That one lives as
    // long as the library, does not unwind, and calls nothing of Python.
    unsafe {
        let found = libc::dlsym(libc::RTLD_DEFAULT, c"Py_AtExit".as_ptr());
        if !found.is_null() {
            transmute::<*mut c_void, PyAtExit>(found)(function);
        }
    }
}

/// Threads are there until the process ends.
pub(crate) fn threads_are_gone() -> bool {
    false
}

/// Ends the transfers when a signal ends or suspends the program, and then has the signal do so. A signal that the
/// program handles or ignores stays the program's.
pub(super) fn watch() {
    // The thread holds signals back, too.
    let _inside = inside::enter();
    let _one = TAKES_UP.try_lock_for(LOCK_LIMIT);
    continue_tx_run();
    let own = process::id();
    if WATCHED_BY.load(Ordering::Acquire) != own {
        stay_loaded();
        // This thread may be any of the program.
        mem::forget(Stack::give());
        #[cfg(not(any(miri, asan)))]
        crate::allocator::survive_forks();
        CAME.store(0, Ordering::Release);
        // There may be no memory for a thread when one is needed.
        let start = || thread::Builder::new().name("ft/ends".into());
        let started = start().spawn(end_when_asked).and_then(|ender| {
            let ender = ender.thread().clone();
            start().spawn(move || look(&ender))
        });
        if let Err(error) = started {
            log::warn!("Ctrl-C will end the program without a last exchange: {error}");
            return;
        }
        WATCHED_BY.store(own, Ordering::Release);
    }
    let ends = ends().map(|end| (end, on_end as extern "C" fn(c_int)));
    let suspends = SUSPENDS.map(|suspend| (suspend, on_suspend as extern "C" fn(c_int)));
    let crashes = CRASHES.map(|crash| (crash, on_crash as extern "C" fn(c_int)));
    for ((signal, name), handler) in ends.chain(suspends).chain(crashes) {
        match take_up(signal, handler) {
            // An emulator may have fewer of them.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {}
            Err(error) => log::warn!("after {name} there will be no last exchange: {error}"),
            Ok(()) => {}
        }
    }
}

/// Keeps this library where it is when the program closes it: its handlers and a thread are there until the end.
fn stay_loaded() {
    // SAFETY: pointers, for which all bits 0 are valid.
    let mut found: libc::Dl_info = unsafe { zeroed() };
    // SAFETY: the address is that of a function here, and the place for what is found is this function's. The
    // name is a text that ends with 0. A program that has the library within itself has nothing to close.
    unsafe {
        if libc::dladdr(stay_loaded as *const c_void, &raw mut found) != 0 {
            let how = libc::RTLD_NOW | libc::RTLD_NOLOAD | libc::RTLD_NODELETE;
            libc::dlopen(found.dli_fname, how);
        }
    }
}

/// Takes up a signal that the program leaves to the system.
fn take_up(signal: c_int, handler: extern "C" fn(c_int)) -> io::Result<()> {
    match handler_of(signal)? {
        libc::SIG_DFL => set(signal, handler as usize),
        _ => Ok(()),
    }
}

/// Has a handler of this library take a signal in place of its usual one; the program's own, and what it ignores, stay.
pub(crate) fn take_over(signal: c_int, handler: extern "C" fn(c_int)) {
    let usual = on_end as extern "C" fn(c_int) as usize;
    if handler_of(signal).is_ok_and(|present| present == usual || present == libc::SIG_DFL) {
        let _ = set(signal, handler as usize);
    }
}

/// Whether Ctrl-C ends this process with a last exchange: it has begun a transfer, and leaves the signal to the system.
pub(crate) fn ends_by_ctrl_c() -> bool {
    WATCHED_BY.load(Ordering::Acquire) == process::id() && is_taken_by(libc::SIGINT, on_end)
}

/// Whether this handler of the library has the signal.
fn is_taken_by(signal: c_int, handler: extern "C" fn(c_int)) -> bool {
    handler_of(signal).is_ok_and(|present| present == handler as usize)
}

pub(crate) fn handler_of(signal: c_int) -> io::Result<usize> {
    // SAFETY: integers, pointers and sets, for which all bits 0 are valid.
    let mut action: libc::sigaction = unsafe { zeroed() };
    // SAFETY: the place for the action is this function's.
    match unsafe { libc::sigaction(signal, ptr::null(), &raw mut action) } {
        0 => Ok(action.sa_sigaction),
        _ => Err(io::Error::last_os_error()),
    }
}

fn set(signal: c_int, handler: usize) -> io::Result<()> {
    // SAFETY: integers, pointers and sets, for which all bits 0 are valid.
    let mut action: libc::sigaction = unsafe { zeroed() };
    action.sa_sigaction = handler;
    action.sa_flags = libc::SA_RESTART | libc::SA_ONSTACK;
    // SAFETY: the action is a valid value, and its handler is async-signal-safe.
    match unsafe { libc::sigaction(signal, &raw const action, ptr::null_mut()) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Asks for the end that this signal means. Async-signal-safe.
pub(crate) extern "C" fn on_end(signal: c_int) {
    if process::id() == WATCHED_BY.load(Ordering::Acquire) {
        // One that follows says nothing new: a terminal and `tx_run` both send Ctrl-C.
        let _ = CAME.compare_exchange(0, signal, Ordering::AcqRel, Ordering::Acquire);
    } else {
        end_by(signal);
    }
}

extern "C" fn on_suspend(signal: c_int) {
    if process::id() == WATCHED_BY.load(Ordering::Acquire) {
        SUSPEND.store(true, Ordering::Release);
    } else {
        end_by(signal);
    }
}

extern "C" fn on_crash(signal: c_int) {
    end_before_crash();
    end_by(signal);
}

/// The thread that crashes waits until the transfers have ended. Async-signal-safe.
pub(crate) fn end_before_crash() {
    if process::id() == WATCHED_BY.load(Ordering::Acquire) {
        CRASHED.store(true, Ordering::Release);
        hold_signals_back();
        let look = libc::timespec { tv_sec: 0, tv_nsec: LOOK.subsec_nanos() as _ };
        // The thread that ends them may be the one that has crashed.
        let most = 2 * END_LIMIT.as_millis() / LOOK.as_millis();
        for _ in 0..most {
            if ENDED.load(Ordering::Acquire) {
                break;
            }
            // SAFETY: the time is this function's.
            unsafe { libc::nanosleep(&raw const look, ptr::null_mut()) };
        }
    }
}

/// In this thread: each signal of a timer would end a sleep early. Async-signal-safe.
fn hold_signals_back() {
    // SAFETY: a set, for which all bits 0 are valid.
    let mut all: libc::sigset_t = unsafe { zeroed() };
    // SAFETY: the set is this function's.
    unsafe {
        libc::sigfillset(&raw mut all);
        libc::pthread_sigmask(libc::SIG_BLOCK, &raw const all, ptr::null_mut());
    }
}

/// Suspends the program, with its transfers ended. When it goes on it may begin them again. Where no shell could continue
/// it, as behind `ssh -t`, it goes on at once: the system does nothing then, and SIGSTOP would suspend for ever.
fn suspend(ender: &Thread) {
    end_within_limit(ender);
    terminal_again();
    // SAFETY: integers, pointers and sets, for which all bits 0 are valid.
    let (mut held, mut before): (libc::sigset_t, libc::sigaction) = unsafe { (zeroed(), zeroed()) };
    // SAFETY: the places for the set and the action are this function's.
    unsafe {
        libc::pthread_sigmask(libc::SIG_BLOCK, ptr::null(), &raw mut held);
        libc::sigaction(libc::SIGTSTP, ptr::null(), &raw mut before);
    }
    // A thread that begins a transfer would take the signal up again, and it would do nothing.
    let takes_up = TAKES_UP.try_lock_for(LOCK_LIMIT);
    // One that still waits for a call would suspend once more. What is ignored is gone.
    for (signal, _) in SUSPENDS.into_iter().filter(|(signal, _)| is_taken_by(*signal, on_suspend)) {
        let _ = set(signal, libc::SIG_IGN);
        let _ = set(signal, on_suspend as extern "C" fn(c_int) as usize);
    }
    end_by(libc::SIGTSTP);
    // SAFETY: the set is one that this thread had.
    unsafe { libc::pthread_sigmask(libc::SIG_SETMASK, &raw const held, ptr::null_mut()) };
    // Unless the program has set another one already.
    if handler_of(libc::SIGTSTP).is_ok_and(|present| present == libc::SIG_DFL) {
        // SAFETY: the action is one that the program had.
        unsafe { libc::sigaction(libc::SIGTSTP, &raw const before, ptr::null_mut()) };
    }
    drop(takes_up);
    SUSPEND.store(false, Ordering::Release);
    goes_on();
}

/// The shell may have continued only this program, and `tx_run`, which stops what it leaves, is still suspended.
fn continue_tx_run() {
    // SAFETY: calls without pointers.
    unsafe {
        let parent = libc::getppid();
        if is_of_tx_run() && libc::getpgid(parent) == libc::getpgrp() && is_suspended(parent) {
            libc::kill(parent, libc::SIGCONT);
        }
    }
}

/// Whether a process is suspended. To one that runs the signal that continues it would do harm: a Ctrl-Z that it has not
/// seen yet would be lost.
#[cfg(target_os = "linux")]
fn is_suspended(process: libc::pid_t) -> bool {
    let stat = fs::read(format!("/proc/{process}/stat"));
    stat.map_or(true, |stat| has_state(&stat, 'T'))
}

/// Whether a file `stat` of the system shows this state.
#[cfg(target_os = "linux")]
fn has_state(stat: &[u8], state: char) -> bool {
    // The name before it may have any characters, and be cut within one.
    let stat = String::from_utf8_lossy(stat);
    stat.rsplit_once(") ").is_some_and(|(_, rest)| rest.starts_with(state))
}

/// Other systems do not show it.
#[cfg(not(target_os = "linux"))]
fn is_suspended(_: libc::pid_t) -> bool {
    true
}

/// Does what the signal does without this library, which ends or suspends the process. Async-signal-safe.
fn end_by(signal: c_int) {
    // It can't fail: the signal had this action.
    let _ = set(signal, libc::SIG_DFL);
    // SAFETY: a set, for which all bits 0 are valid.
    let mut only: libc::sigset_t = unsafe { zeroed() };
    // SAFETY: the set is this function's.
    unsafe {
        libc::sigemptyset(&raw mut only);
        libc::sigaddset(&raw mut only, signal);
        libc::pthread_sigmask(libc::SIG_UNBLOCK, &raw const only, ptr::null_mut());
        libc::raise(signal);
    }
}

/// A program that was asked to end, and ends because its transfer does, still ends by the signal.
pub(super) fn end_as_asked() {
    let signal = CAME.load(Ordering::Acquire);
    if signal != 0 {
        terminal_again();
        end_by(signal);
        // The first process of a container is not ended by a default action.
        // SAFETY: a call without pointers.
        unsafe { libc::_exit(128 + signal) };
    }
}

/// The thread that looks.
fn look(ender: &Thread) {
    // Half a second: after `pthread_exit` nobody is in a hurry.
    const LOOKS_FOR_MAIN: u32 = 25;
    for looks in 1_u32.. {
        thread::sleep(LOOK);
        look_for_pending();
        if CAME.load(Ordering::Acquire) != 0 {
            end_within_limit(ender);
            end_as_asked();
        }
        if CRASHED.load(Ordering::Acquire) && !ENDED.load(Ordering::Acquire) {
            end_within_limit(ender);
            terminal_again();
            ENDED.store(true, Ordering::Release);
        }
        if SUSPEND.load(Ordering::Acquire) {
            suspend(ender);
        }
        if looks % LOOKS_FOR_MAIN == 0 && program_has_left() {
            end_within_limit(ender);
            // As when the last thread of a program ends.
            process::exit(0);
        }
    }
}

/// A signal waits while all threads of the program that would take it are in calls of this library. One that the program
/// itself holds back is the program's.
fn look_for_pending() {
    // SAFETY: a set, for which all bits 0 are valid.
    let mut pending: libc::sigset_t = unsafe { zeroed() };
    // SAFETY: the set is this function's.
    if unsafe { libc::sigpending(&raw mut pending) } != 0 {
        return;
    }
    let waits = |signal: c_int, handler: extern "C" fn(c_int)| {
        // SAFETY: the set is this function's, and this thread holds back all signals.
        let is_pending = unsafe { libc::sigismember(&raw const pending, signal) } == 1;
        is_pending && inside::is_held_by_library(signal) && is_taken_by(signal, handler)
    };
    // One of a crash that another process has sent.
    let crash = CRASHES.into_iter().find(|(signal, _)| waits(*signal, on_crash));
    if let Some((signal, _)) = ends().find(|(signal, _)| waits(*signal, on_end)).or(crash) {
        on_end(signal);
    }
    if let Some((signal, _)) = SUSPENDS.into_iter().find(|(signal, _)| waits(*signal, on_suspend)) {
        on_suspend(signal);
    }
}

/// The other thread. Whoever asks need not wait for it.
fn end_when_asked() {
    loop {
        let asked = ASKED.load(Ordering::Acquire);
        if asked == DONE.load(Ordering::Acquire) {
            thread::park();
        } else {
            guarded((), end_all);
            DONE.store(asked, Ordering::Release);
        }
    }
}

/// Allocates nothing.
fn end_within_limit(ender: &Thread) {
    let asked = ASKED.fetch_add(1, Ordering::AcqRel).wrapping_add(1);
    ender.unpark();
    let limit = Instant::now() + END_LIMIT;
    while DONE.load(Ordering::Acquire) != asked && Instant::now() < limit {
        thread::sleep(LOOK / 4);
    }
}

/// Whether `main` has ended by `pthread_exit`, and of all threads only this library's are left: they would
/// keep the motors turning forever.
#[cfg(target_os = "linux")]
fn program_has_left() -> bool {
    let main = process::id().to_string();
    let stat = fs::read(format!("/proc/self/task/{main}/stat"));
    if !stat.is_ok_and(|stat| has_state(&stat, 'Z')) {
        return false;
    }
    let Ok(threads) = fs::read_dir("/proc/self/task") else { return false };
    threads.flatten().filter(|thread| *thread.file_name() != *main).all(|thread| {
        // All threads of ours have such a name. Others begin with the name of the program, in which there is no slash. One
        // that has ended meanwhile is not left.
        fs::read(thread.path().join("comm")).map_or(true, |name| name.starts_with(b"ft/"))
    })
}

/// Other systems do not show it.
#[cfg(not(target_os = "linux"))]
fn program_has_left() -> bool {
    false
}
