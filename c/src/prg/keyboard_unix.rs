//! The settings of the keyboard of a terminal.

use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::OnceLock;

use crate::posix::{is_in_front, terminal_again};

/// How it was before, and whether it is different now.
static BEFORE: OnceLock<libc::termios> = OnceLock::new();
static CHANGED: AtomicBool = AtomicBool::new(false);

/// Makes each key available as it is pressed, and not shown. Returns whether that is possible.
pub(super) fn without_lines() -> bool {
    // A program in the background must leave the terminal alone.
    if !is_in_front() {
        return false;
    }
    let mut settings = MaybeUninit::uninit();
    // SAFETY: the place for the settings is this function's.
    if unsafe { libc::tcgetattr(libc::STDIN_FILENO, settings.as_mut_ptr()) } != 0 {
        return false;
    }
    // SAFETY: the call has filled them in.
    let mut settings: libc::termios = unsafe { settings.assume_init() };
    BEFORE.get_or_init(|| settings);
    settings.c_lflag &= !(libc::ICANON | libc::ECHO);
    CHANGED.store(true, Ordering::Release);
    set(&settings);
    true
}

fn set(settings: &libc::termios) {
    // SAFETY: the settings are a valid value.
    unsafe { libc::tcsetattr(libc::STDIN_FILENO, libc::TCSANOW, settings) };
}

/// Makes the terminal as it was, also when the program has changed it by `_kbhit`. Does not allocate and takes no lock.
pub(super) fn restore() {
    terminal_again();
    if CHANGED.swap(false, Ordering::AcqRel) {
        if let Some(before) = BEFORE.get().filter(|_| is_in_front()) {
            set(before);
        }
    }
}
