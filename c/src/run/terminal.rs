//! The settings of the terminal. A program may change them, and can't put them back when it is killed.

use std::fs::File;
use std::mem::MaybeUninit;
use std::os::fd::AsRawFd;
use std::sync::OnceLock;

/// The terminal, and its settings before the program.
static BEFORE: OnceLock<(File, libc::termios)> = OnceLock::new();

/// Remembers the settings as they are now. Without a terminal there is nothing to do.
pub(crate) fn remember() {
    let Some(terminal) = File::open("/dev/tty").ok().filter(is_ours) else { return };
    let mut settings = MaybeUninit::uninit();
    // SAFETY: the place for the settings is this function's, and the call fills them in.
    let settings = unsafe {
        if libc::tcgetattr(terminal.as_raw_fd(), settings.as_mut_ptr()) != 0 {
            return;
        }
        settings.assume_init()
    };
    let _ = BEFORE.set((terminal, settings));
}

/// Makes the terminal as it was before the program.
pub(crate) fn put_back() {
    if let Some((terminal, settings)) = BEFORE.get().filter(|(terminal, _)| is_ours(terminal)) {
        // SAFETY: the settings are a valid value. It does not wait for a terminal that is paused.
        unsafe { libc::tcsetattr(terminal.as_raw_fd(), libc::TCSANOW, settings) };
    }
}

/// Whether this process is in front. In the background the settings are another's, and changing them suspends it.
fn is_ours(terminal: &File) -> bool {
    // SAFETY: two calls without pointers.
    unsafe { libc::tcgetpgrp(terminal.as_raw_fd()) == libc::getpgrp() }
}
