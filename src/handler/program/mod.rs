//! The program's side: the handle, its guards and waits, and the cycle hook.

pub(crate) mod area;
mod calls;
pub(crate) mod guard;
mod hook;
pub(crate) mod lease;
mod response_wait;
mod waits;
