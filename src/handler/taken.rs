//! What a guard holds, and what its handle knows.

use std::time::Instant;

use super::shared::State;
use crate::transfer_area::FishX1Transfer;

/// What one handle to the areas has been told, so that it is told everything once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Known {
    /// The newest window that a wait of this handle has returned.
    pub(super) returned: u64,
    /// The newest response that any guard of this handle has shown.
    pub(super) shown: u64,
    /// How many interruptions it knows of.
    pub(super) interruptions: u64,
}

/// The areas that a guard holds, and what has to be known when they are put back.
#[derive(Debug)]
pub(super) struct Taken {
    pub(super) areas: Vec<FishX1Transfer>,
    /// The holder's turn.
    pub(super) turn: u64,
    /// The newest window.
    pub(super) window: u64,
    /// The newest response that is in the areas.
    pub(super) newest: u64,
    /// Its number in its transfer.
    pub(super) cycle: u64,
    /// When it came in.
    pub(super) arrived: Instant,
    /// What has made its thread take the areas.
    pub(super) purpose: Purpose,
    /// How many interruptions there were before; if there are more, the outputs do not count.
    pub(super) interruptions: u64,
    /// Whether the outputs count at all.
    pub(super) outputs_count: bool,
}

/// Why a thread has taken the areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// It is the cycle hook.
    Hook,
    /// It has waited for the window of this number.
    Reacts(u64),
    /// It has not waited, and its handle sees this response for the first time.
    Looks,
    /// None of these.
    Locks,
}

impl Taken {
    /// Brings areas that were taken up to date, for a handle that knows this.
    pub(super) fn new(
        state: &mut State,
        (mut areas, turn): (Vec<FishX1Transfer>, u64),
        known: Known,
        purpose: Purpose,
    ) -> Self {
        let elapsed = state.elapsed();
        state.hand_over.bring_up_to_date(&mut areas, elapsed);
        Self {
            areas,
            turn,
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
    pub(super) fn outputs_count(&self, known: Known) -> bool {
        let goes_on = self.transfer.is_exchanging() && !self.watchdog.has_expired();
        goes_on || known.interruptions >= self.interruptions.count()
    }
}
