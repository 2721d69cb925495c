//! The log of a program: a channel in which every cycle comes.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvError, RecvTimeoutError, TryRecvError};

use super::listeners::Subscription;
use crate::events::LogEntry;
use crate::handler::shared::Shared;
use crate::pause::within_clock;

/// Every cycle of a handler's transfers, on a channel; made by
/// [`TransferAreas::cycle_log`](crate::TransferAreas::cycle_log).
///
/// It is an iterator: each step blocks until there is an entry, and it ends when the handler was dropped. A log
/// only looks: it neither keeps the motors on nor stops them, and dropping it changes nothing for the transfer.
///
/// ```
/// use ft_transfer_area::prelude::*;
/// use ft_transfer_area::{CycleLog, Logged};
///
/// /// The largest value of I1 in all cycles.
/// fn largest(log: CycleLog) -> i16 {
///     let mut largest = 0;
///     for entry in log {
///         if entry.lost > 0 {
///             println!("{} entries are missing here", entry.lost);
///         }
///         if let Logged::Cycle(cycle) = entry.what {
///             largest = largest.max(cycle.areas()[LOCAL_IO].input.uni[I1]);
///         }
///     }
///     largest
/// }
/// ```
pub struct CycleLog {
    receiver: Receiver<LogEntry>,
    lost: Arc<AtomicU64>,
    shared: Arc<Shared>,
}

impl CycleLog {
    /// The largest possible capacity of a channel: a minute. It takes 56 MB.
    pub const MAX_CAPACITY: usize = 6_000;

    /// Subscribes.
    pub(crate) fn new(shared: Arc<Shared>, capacity: usize) -> Self {
        // Locked meanwhile, so that no beginning and no response comes between.
        let mut listeners = shared.listeners.lock();
        let running = shared.state().beginning();
        let Subscription { receiver, lost } = listeners.add_log(capacity, running);
        drop(listeners);
        Self { receiver, lost, shared }
    }

    /// The channel itself, for [`select!`](crate::channel::select), for other ways to wait, and for other
    /// threads. In [lock-step](crate::TransferAreaComHandlerBuilder::lock_step) waiting on it does not move
    /// the time.
    pub fn receiver(&self) -> &Receiver<LogEntry> {
        &self.receiver
    }

    /// The next entry. Blocks until there is one.
    ///
    /// # Errors
    ///
    /// When the handler was dropped and all entries have been received.
    pub fn recv(&self) -> Result<LogEntry, RecvError> {
        self.receiver.recv()
    }

    /// The next entry, if there is one already. Does not block.
    ///
    /// # Errors
    ///
    /// When there is none, or the handler was dropped and all entries have been received.
    pub fn try_recv(&self) -> Result<LogEntry, TryRecvError> {
        self.receiver.try_recv()
    }

    /// The next entry. Blocks up to `limit`, with [`Duration::MAX`] forever.
    ///
    /// # Errors
    ///
    /// When no entry came in time, or the handler was dropped and all entries have been received.
    pub fn recv_timeout(&self, limit: Duration) -> Result<LogEntry, RecvTimeoutError> {
        self.receiver.recv_timeout(within_clock(limit))
    }

    /// How many entries were lost in all because the channel was full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Iterator for CycleLog {
    type Item = LogEntry;

    fn next(&mut self) -> Option<LogEntry> {
        self.recv().ok()
    }
}

impl fmt::Debug for CycleLog {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { receiver, lost, .. } = self;
        f.debug_struct("CycleLog")
            .field("receiver", receiver)
            .field("lost", lost)
            .finish_non_exhaustive()
    }
}

impl Drop for CycleLog {
    fn drop(&mut self) {
        self.shared.listeners.lock().logs.remove(&self.lost);
    }
}
