//! What a guard holds, and what its handle knows.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use crate::handler::shared::State;
use crate::transfer_area::FishX1Transfer;

/// What one handle to the areas has learned of, so that it learns of everything once.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Known {
    /// The newest window that a wait of this handle has returned.
    pub(crate) returned: u64,
    /// The newest response that any guard of this handle has shown.
    pub(crate) shown: u64,
    /// How many interruptions it knows of.
    pub(crate) interruptions: u64,
}

/// What a handle knows. Threads that share the handle share this.
#[derive(Debug, Default)]
pub(crate) struct AtomicKnown {
    pub(crate) returned: AtomicU64,
    pub(crate) shown: AtomicU64,
    pub(crate) interruptions: AtomicU64,
}

impl AtomicKnown {
    pub(crate) fn get(&self) -> Known {
        Known {
            returned: self.returned.load(Ordering::Relaxed),
            shown: self.shown.load(Ordering::Relaxed),
            interruptions: self.interruptions.load(Ordering::Relaxed),
        }
    }
}

impl Clone for AtomicKnown {
    fn clone(&self) -> Self {
        let Known { returned, shown, interruptions } = self.get();
        Self { returned: returned.into(), shown: shown.into(), interruptions: interruptions.into() }
    }
}

/// The areas that a guard holds, and what has to be known when they are put back.
#[derive(Debug)]
pub(crate) struct Lease {
    pub(crate) areas: Vec<FishX1Transfer>,
    /// The lease's number.
    pub(crate) number: u64,
    /// The newest window.
    pub(crate) window: u64,
    /// The newest response that is in the areas.
    pub(crate) newest: u64,
    /// Its number in its transfer.
    pub(crate) cycle: u64,
    /// When it came in.
    pub(crate) arrived: Instant,
    /// What has made its thread take the areas.
    pub(crate) purpose: Purpose,
    /// How many interruptions there were before; if there are more, the outputs do not count.
    pub(crate) interruptions: u64,
    /// Whether the outputs count at all.
    pub(crate) outputs_count: bool,
}

/// Why a thread has taken the areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// It is the cycle hook.
    Hook,
    /// It has waited for the window of this number.
    Reacts(u64),
    /// It has not waited, and its handle sees this response for the first time.
    Looks,
    /// None of these.
    Locks,
}

impl Lease {
    /// Brings areas that were taken up to date, for a handle that knows this.
    pub(crate) fn new(
        state: &mut State,
        (mut areas, number): (Vec<FishX1Transfer>, u64),
        known: Known,
        purpose: Purpose,
    ) -> Self {
        let elapsed = state.elapsed();
        state.hand_over.bring_up_to_date(&mut areas, elapsed);
        Self {
            areas,
            number,
            window: state.window.number(),
            newest: state.delivered,
            cycle: state.statistics.cycles,
            arrived: state.arrived,
            purpose,
            interruptions: state.interruptions.count(),
            outputs_count: state.outputs_count(known),
        }
    }
}

impl State {
    /// Whether the outputs that a handle writes now count: not while they are stopped and the handle does not
    /// know of that.
    pub(crate) fn outputs_count(&self, known: Known) -> bool {
        let goes_on = self.transfer.is_exchanging() && !self.watchdog.has_expired();
        goes_on || known.interruptions >= self.interruptions.count()
    }
}
