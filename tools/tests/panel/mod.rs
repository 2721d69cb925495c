//! `txt panel`: the program itself, by real sockets, and what a simulated TXT sees of it.

mod access;
mod bad_input;
mod coming_and_going;
mod commands;
mod crowd;
mod driving;
mod ends;
mod http;
mod opening;
pub(crate) mod page;
pub(crate) mod program;
pub(crate) mod recording;
mod services;
mod shown;
mod world;

use std::time::Duration;

/// How long a test waits for what has to happen. Nothing takes as long, however busy the computer is.
const LIMIT: Duration = Duration::from_secs(40);
