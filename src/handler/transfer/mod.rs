//! The transfer's side: the thread that exchanges, and what it does with the shared state.

pub(crate) mod calls;
mod cycle;
pub(crate) mod handshake;
mod long_guard;
#[cfg(all(test, not(shuttle)))]
mod peer;
mod reconnect;
pub(crate) mod thread;
