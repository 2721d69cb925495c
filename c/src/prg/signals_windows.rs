//! What Windows has in place of signals: those that ask the program to end, and those of a crash.

use std::ffi::c_int;
use std::io;
use std::sync::atomic::{AtomicI32, Ordering};
use std::thread;
use std::time::Duration;

use windows_sys::Win32::Foundation::{
    EXCEPTION_ACCESS_VIOLATION, EXCEPTION_FLT_DIVIDE_BY_ZERO, EXCEPTION_ILLEGAL_INSTRUCTION,
    EXCEPTION_INT_DIVIDE_BY_ZERO, EXCEPTION_STACK_OVERFLOW,
};
use windows_sys::Win32::System::Diagnostics::Debug::{
    SetUnhandledExceptionFilter, EXCEPTION_POINTERS,
};
use windows_sys::Win32::System::Threading::{GetCurrentProcess, TerminateProcess};

use super::system;

/// What `abort` raises.
const SIGABRT: c_int = 22;

const CRASHES: &[(c_int, &str)] = &[
    (EXCEPTION_ACCESS_VIOLATION, "an access violation: memory that is not the program's"),
    (EXCEPTION_STACK_OVERFLOW, "a stack overflow: no room left on the stack"),
    (EXCEPTION_INT_DIVIDE_BY_ZERO, "a division by zero"),
    (EXCEPTION_FLT_DIVIDE_BY_ZERO, "a division by zero"),
    (EXCEPTION_ILLEGAL_INSTRUCTION, "something that is not an instruction"),
    (SIGABRT, "abort was called"),
];

/// The first crash; 0 for none.
static CRASH: AtomicI32 = AtomicI32::new(0);

/// Takes up what ends a process.
pub(super) fn take_up() -> io::Result<()> {
    // SAFETY: the filter is a function of the type that is asked for.
    unsafe { SetUnhandledExceptionFilter(Some(on_exception)) };
    // SAFETY: the handler is a function of the type that is asked for.
    unsafe { libc::signal(SIGABRT, on_abort as extern "C" fn(c_int) as usize) };
    ctrlc::set_handler(|| system::ask_to_stop(1)).map_err(io::Error::other)
}

/// The watcher needs nothing here.
pub(super) fn watch_from_here() {}

/// From now on a crash ends the process, as it does without this library. The handler of Ctrl-C stays.
pub(super) fn give_back() {
    // SAFETY: no filter and the default action are allowed.
    unsafe {
        SetUnhandledExceptionFilter(None);
        libc::signal(SIGABRT, libc::SIG_DFL);
    }
}

unsafe extern "system" fn on_exception(exception: *const EXCEPTION_POINTERS) -> i32 {
    // SAFETY: Windows passes what it says.
    park(unsafe { (*(*exception).ExceptionRecord).ExceptionCode })
}

extern "C" fn on_abort(signal: c_int) {
    park(signal)
}

/// The thread does nothing more: another one stops the outputs and ends the process.
fn park(crash: c_int) -> ! {
    let _ = CRASH.compare_exchange(0, crash, Ordering::AcqRel, Ordering::Acquire);
    thread::sleep(Duration::from_secs(5));
    exit(1)
}

/// What the program has crashed with.
pub(super) fn crash() -> Option<&'static str> {
    let crash = CRASH.load(Ordering::Acquire);
    let known = CRASHES.iter().find(|(code, _)| *code == crash).map(|(_, text)| *text);
    known.or((crash != 0).then_some("an exception that nobody has caught"))
}

/// What has asked the program to end.
pub(super) fn end_name(_: u32) -> &'static str {
    "Ctrl-C"
}

/// Ends the process, without what the program has ordered for its end.
pub(super) fn exit(status: c_int) -> ! {
    // SAFETY: the process is this one.
    unsafe { TerminateProcess(GetCurrentProcess(), status as u32) };
    std::process::abort()
}
