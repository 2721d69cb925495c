//! Whether programs may go through `txt watch`. Its page shuts it, the relay obeys.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::OnceLock;

use mio::Waker;

/// Open at first.
#[derive(Default)]
pub(crate) struct Gate {
    shut: AtomicBool,
    relay: OnceLock<Waker>,
}

impl Gate {
    /// From now on this wakes the relay.
    pub(crate) fn wakes(&self, relay: Waker) {
        // There is one relay.
        let _ = self.relay.set(relay);
    }

    /// All programs that are there are disconnected, and those that come are refused.
    pub(crate) fn shut(&self) {
        self.shut.store(true, Ordering::Relaxed);
        // Without it, the relay learns of it with the next bytes that pass.
        self.wake();
    }

    /// Wakes the relay. Returns whether that was possible.
    pub(crate) fn wake(&self) -> bool {
        self.relay.get().is_some_and(|relay| relay.wake().is_ok())
    }

    pub(crate) fn open(&self) {
        self.shut.store(false, Ordering::Relaxed);
    }

    pub(crate) fn is_shut(&self) -> bool {
        self.shut.load(Ordering::Relaxed)
    }
}
