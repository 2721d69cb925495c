//! The transfer's side: the thread that exchanges, and what it does with the shared state.

pub(in crate::handler) mod calls;
mod cycle;
pub(in crate::handler) mod handshake;
mod long_guard;
#[cfg(all(test, not(shuttle)))]
mod peer;
mod reconnect;
pub(in crate::handler) mod thread;
