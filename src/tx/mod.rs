//! The TX library's calls, as methods on one area.

pub use crate::sockets::{Counter, Input, Motor, Output};
