//! What a guard holds, and what its handle knows.

use std::time::Instant;

use super::shared::State;
use crate::transfer_area::FishX1Transfer;

/// What one handle to the areas has been told, so that it is told everything once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Known {
    /// The newest response that a wait of this handle has returned.
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
    /// The newest response whose window was opened.
    pub(super) response: u64,
    /// The newest response that is in the areas.
    pub(super) newest: u64,
    /// Its number in its transfer.
    pub(super) cycle: u64,
    /// When it came in.
    pub(super) arrived: Instant,
    /// The response for which the thread waited.
    pub(super) reacts_to: Option<u64>,
    /// Whether the thread has not waited, and its handle sees this response for the first time.
    pub(super) looks: bool,
    /// How many interruptions there were before; if there are more, the outputs do not count.
    pub(super) interruptions: u64,
    /// Whether the outputs count at all.
    pub(super) outputs_count: bool,
}

impl Taken {
    /// The areas that the cycle hook holds.
    pub(super) fn for_hook(state: &State, areas: Vec<FishX1Transfer>, turn: u64) -> Self {
        let interruptions = state.interruptions.count();
        let known = Known { interruptions, ..Known::default() };
        Self::new(state, areas, turn, None, state.outputs_count(known))
    }

    pub(super) fn new(
        state: &State,
        areas: Vec<FishX1Transfer>,
        turn: u64,
        reacts_to: Option<u64>,
        outputs_count: bool,
    ) -> Self {
        Self {
            areas,
            turn,
            response: state.window.response(),
            newest: state.delivered,
            cycle: state.statistics.cycles,
            arrived: state.arrived,
            reacts_to,
            looks: false,
            interruptions: state.interruptions.count(),
            outputs_count,
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
