//! The program's side: the handle, its guards and waits, and the cycle hook.

pub(crate) mod area;
pub(crate) mod guard;
mod hook;
pub(crate) mod known;
mod steps;
mod waits;
