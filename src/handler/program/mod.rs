//! The program's side: the handle, its guards and waits, and the cycle hook.

pub(in crate::handler) mod area;
mod calls;
pub(in crate::handler) mod guard;
mod hook;
pub(in crate::handler) mod lease;
mod response_wait;
mod waits;
