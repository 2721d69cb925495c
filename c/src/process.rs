//! Which process has this library's threads: not a child after `fork`, which has only the thread that forked.

use std::process;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// The process in which this library has started threads; 0 for none yet.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// To be called before this library starts threads that are there between two calls.
pub(crate) fn begin() {
    #[cfg(all(unix, not(miri), not(asan)))]
    crate::allocator::survive_forks();
    let _ = OWNER.compare_exchange(0, process::id(), Ordering::AcqRel, Ordering::Acquire);
}

/// Whether this is a child of the process that has this library's threads. Its copies of locks and threads are
/// as they were at a moment in the middle of anything, so it must not use them. Async-signal-safe.
pub(crate) fn is_forked() -> bool {
    let owner = OWNER.load(Ordering::Acquire);
    owner != 0 && owner != process::id()
}

/// Says, once, why calls of such a child fail. Uses no lock.
pub(crate) fn tell_forked() {
    static TOLD: AtomicBool = AtomicBool::new(false);
    if !TOLD.swap(true, Ordering::AcqRel) {
        write_error(
            "ft-transfer-area: a child process after fork can't use the library that its parent has started\n",
        );
    }
}

/// Ends such a child in the middle of what is its parent's: neither the transfer nor the threads are in it.
#[cfg(unix)]
pub(crate) fn end_forked() -> ! {
    tell_forked();
    // SAFETY: a call without pointers.
    unsafe { libc::_exit(1) }
}

/// Waits until the error output has room, a second in all.
#[cfg(unix)]
fn is_read() -> bool {
    use std::sync::atomic::AtomicI32;

    static LIMIT_MS: AtomicI32 = AtomicI32::new(1000);
    let limit = LIMIT_MS.load(Ordering::Relaxed);
    let mut output = libc::pollfd { fd: libc::STDERR_FILENO, events: libc::POLLOUT, revents: 0 };
    loop {
        // SAFETY: the place is this function's.
        match unsafe { libc::poll(&raw mut output, 1, limit) } {
            0 => LIMIT_MS.store(0, Ordering::Relaxed),
            -1 if std::io::Error::last_os_error().kind() == std::io::ErrorKind::Interrupted => {
                continue
            }
            _ => return true,
        }
        return false;
    }
}

/// Writes to the error output. Allocates nothing and takes no lock; what can't be written is lost, also when nobody
/// reads for a second, as at a paused terminal.
pub(crate) fn write_error(text: &str) {
    #[cfg(unix)]
    if is_read() {
        // SAFETY: the bytes are there.
        unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
    }
    #[cfg(not(unix))]
    {
        use std::io::Write;
        let _ = std::io::stderr().write_all(text.as_bytes());
    }
}
