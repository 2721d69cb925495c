//! Functions of Windows that programs for PCs use, for other systems. `include/posix` declares them.
#![allow(unreachable_pub, reason = "programs in C reach them by their names")]

mod console;
mod control;
mod files;
mod keyboard;
mod keys;
mod libraries;
mod message;
mod numbers;
mod objects;
mod processors;
mod screen;
mod settings;
mod shell;
mod text;
mod threads;
mod time;

pub(crate) use keyboard::is_in_front;

/// Makes the terminal as it was. Async-signal-safe.
pub(crate) fn terminal_again() {
    keyboard::lines_again();
    console::as_before();
}
