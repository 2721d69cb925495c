//! Signals: those that ask the program to end, and those of a crash.

use std::ffi::c_int;
use std::io;
use std::mem::zeroed;
use std::ptr;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};

use super::system;
use crate::exit;
use crate::process::write_error;

/// The signals of a crash, with what they say.
const CRASHES: &[(c_int, &str)] = &[
    (libc::SIGSEGV, "SIGSEGV: memory that is not the program's, or no room left on the stack"),
    (libc::SIGBUS, "SIGBUS: memory that is not there, or no room left on the stack"),
    (libc::SIGFPE, "SIGFPE: a division by zero, or an overflow in one"),
    (libc::SIGILL, "SIGILL: something that is not an instruction"),
    (libc::SIGABRT, "SIGABRT: abort was called"),
    (libc::SIGTRAP, "SIGTRAP: an instruction for a debugger"),
    (libc::SIGSYS, "SIGSYS: a system call that is not allowed here"),
];

/// The signals that ask the program to end, with their names. One that would suspend it does so, too: it is made for a
/// controller, which knows no pauses.
fn ends() -> impl Iterator<Item = (c_int, &'static str)> {
    exit::ends().chain(exit::SUSPENDS)
}

/// The first crash; 0 for none.
static CRASH: AtomicI32 = AtomicI32::new(0);

/// The thread that says how the program has ended; 0 for none.
static WATCHER: AtomicUsize = AtomicUsize::new(0);

/// Makes the calling thread the watcher.
pub(super) fn watch_from_here() {
    // SAFETY: a call without pointers.
    WATCHER.store(unsafe { libc::pthread_self() } as usize, Ordering::Release);
}

/// Bytes of the stack on which handlers run: the program's own may be full.
const STACK: usize = 64 << 10;

/// Takes up the signals, for the whole process; the calling thread gets a stack for them.
pub(super) fn take_up() -> io::Result<()> {
    let stack = Box::leak(vec![0_u8; STACK].into_boxed_slice());
    let stack = libc::stack_t { ss_sp: stack.as_mut_ptr().cast(), ss_flags: 0, ss_size: STACK };
    // SAFETY: the stack is never freed.
    if unsafe { libc::sigaltstack(&raw const stack, ptr::null_mut()) } != 0 {
        return Err(io::Error::last_os_error());
    }
    for (signal, _) in CRASHES {
        handle(*signal, on_crash as extern "C" fn(c_int) as usize)?;
    }
    for (signal, _) in ends() {
        match exit::handler_of(signal) {
            Ok(libc::SIG_IGN) => {}
            // An emulator may have fewer of them.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {}
            _ => handle(signal, on_end as extern "C" fn(c_int) as usize)?,
        }
    }
    Ok(())
}

/// From now on signals end the process, as they do without this library.
pub(super) fn give_back() {
    for (signal, _) in CRASHES.iter().copied().chain(ends()) {
        // It has worked with the handler.
        let _ = handle(signal, libc::SIG_DFL);
    }
}

fn handle(signal: c_int, handler: usize) -> io::Result<()> {
    // SAFETY: integers, pointers and sets, for which all bits 0 are valid.
    let mut action: libc::sigaction = unsafe { zeroed() };
    action.sa_sigaction = handler;
    action.sa_flags = libc::SA_ONSTACK | libc::SA_RESTART;
    // SAFETY: the action is a valid value, and its handler is async-signal-safe.
    match unsafe { libc::sigaction(signal, &raw const action, ptr::null_mut()) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

extern "C" fn on_end(signal: c_int) {
    system::ask_to_stop(signal as u32);
}

/// The thread does nothing more: the watcher stops the outputs and ends the process. If it crashes too, because
/// the program has destroyed its memory, or does nothing, this is the end.
extern "C" fn on_crash(signal: c_int) {
    // The first one says more.
    let _ = CRASH.compare_exchange(0, signal, Ordering::AcqRel, Ordering::Acquire);
    // SAFETY: async-signal-safe calls.
    unsafe {
        if libc::pthread_self() as usize != WATCHER.load(Ordering::Acquire) {
            libc::sleep(2);
        }
    }
    write_error("the program has crashed with ");
    write_error(crash().unwrap_or("a signal"));
    write_error("; no last exchange: the outputs of a TXT may stay on\n");
    exit(1)
}

/// What the program has crashed with. Does not allocate.
pub(super) fn crash() -> Option<&'static str> {
    let signal = CRASH.load(Ordering::Acquire);
    CRASHES.iter().find(|(crash, _)| *crash == signal).map(|(_, text)| *text)
}

/// What has asked the program to end.
pub(super) fn end_name(reason: u32) -> &'static str {
    let end = ends().find(|(signal, _)| *signal as u32 == reason);
    end.map_or("a signal", |(_, name)| name)
}

/// Ends the process, without what the program has ordered for its end.
pub(super) fn exit(status: c_int) -> ! {
    // SAFETY: it does not return.
    unsafe { libc::_exit(status) }
}
