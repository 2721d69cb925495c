//! The transfer's side: the thread that exchanges, and what it does with the shared state.

mod cycle;
pub(crate) mod handshake;
#[cfg(all(test, not(shuttle)))]
mod peer;
mod reconnect;
pub(crate) mod side;
pub(crate) mod thread;

#[cfg(not(all(test, shuttle)))]
use crate::client::TxtClient;
#[cfg(all(test, shuttle))]
use crate::handler::model::TxtClient;
