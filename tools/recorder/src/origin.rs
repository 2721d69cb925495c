//! Where the entries of a recording come from.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{Receiver, TryRecvError};
use ft_transfer_area::{CycleLog, Events, LogEntry, TimedEvent};

use crate::feed::FedEntry;
use crate::history::Follow;
use crate::under_way::UnderWay;

/// Where the entries come from.
pub(crate) enum Origin {
    Handler {
        log: CycleLog,
        events: Events,
    },
    Feed {
        entries: Receiver<FedEntry>,
        /// How many had no room.
        lost: Arc<AtomicU64>,
    },
    History(Follow),
}

/// An entry of an origin.
#[allow(clippy::large_enum_variant, reason = "as in the log, so that none of them allocates")]
pub(crate) enum Arrival {
    Logged(LogEntry),
    Fed(FedEntry),
    /// What may be from before.
    Kept(FedEntry),
}

impl Origin {
    pub(crate) fn waiting(&self) -> usize {
        match self {
            Self::Handler { log, .. } => log.receiver().len(),
            Self::Feed { entries, .. } => entries.len(),
            Self::History(follow) => follow.waiting(),
        }
    }

    /// What a history knows its follower by.
    pub(crate) fn follows(&self) -> Option<Arc<()>> {
        match self {
            Self::Handler { .. } | Self::Feed { .. } => None,
            Self::History(follow) => Some(follow.is_there()),
        }
    }

    /// Since when there is something of a transfer that runs already, and what has happened to it.
    pub(crate) fn within(&self) -> Option<(Instant, UnderWay)> {
        match self {
            Self::Handler { .. } | Self::Feed { .. } => None,
            Self::History(follow) => Some((follow.since(), follow.under_way().clone())),
        }
    }

    pub(crate) fn next(&mut self) -> Result<Arrival, TryRecvError> {
        match self {
            Self::Handler { log, .. } => log.try_recv().map(Arrival::Logged),
            Self::Feed { entries, .. } => entries.try_recv().map(Arrival::Fed),
            Self::History(follow) => follow.next().map(Arrival::Kept),
        }
    }

    /// The next event of a response. Of a history it is an entry; a feed has none.
    pub(crate) fn next_event(&self) -> Option<TimedEvent> {
        match self {
            Self::Handler { events, .. } => events.try_recv().ok(),
            Self::Feed { .. } | Self::History(_) => None,
        }
    }

    /// How many entries and events had no room.
    pub(crate) fn lost(&self) -> (u64, u64) {
        match self {
            Self::Handler { log, events } => (log.lost(), events.lost()),
            Self::Feed { lost, .. } => (lost.load(Ordering::Relaxed), 0),
            Self::History(follow) => (follow.lost(), 0),
        }
    }
}
