//! What a handle knows.

use std::sync::atomic::{AtomicU64, Ordering};

/// What one handle to the areas has learned of, so that it learns of everything once.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Known {
    /// The newest response that a wait of this handle has returned.
    pub(crate) returned: u64,
    /// The newest response that any guard of this handle has shown.
    pub(crate) shown: u64,
    /// How many interruptions it knows of.
    pub(crate) interruptions: u64,
}

/// What a handle knows. Threads that share the handle share this.
#[derive(Debug, Default)]
pub(crate) struct AtomicKnown {
    returned: AtomicU64,
    shown: AtomicU64,
    interruptions: AtomicU64,
}

impl AtomicKnown {
    pub(crate) fn get(&self) -> Known {
        Known {
            returned: self.returned.load(Ordering::Relaxed),
            shown: self.shown.load(Ordering::Relaxed),
            interruptions: self.interruptions.load(Ordering::Relaxed),
        }
    }

    /// Adds what a call has learned. Another thread that shares the handle may know more by now.
    pub(crate) fn learn(&self, known: Known) {
        let Known { returned, shown, interruptions } = known;
        self.returned.fetch_max(returned, Ordering::Relaxed);
        self.shown.fetch_max(shown, Ordering::Relaxed);
        self.interruptions.fetch_max(interruptions, Ordering::Relaxed);
    }
}

impl Clone for AtomicKnown {
    fn clone(&self) -> Self {
        let clone = Self::default();
        clone.learn(self.get());
        clone
    }
}
