//! Functions of Windows that programs for PCs use, for other systems. `include/posix` declares them.
#![allow(unreachable_pub, reason = "programs in C reach them by their names")]

mod keyboard;
mod libraries;
mod objects;
mod processors;
mod shell;
mod text;
mod threads;
mod time;

pub(crate) use keyboard::lines_again;
