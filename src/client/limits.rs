//! How long things may take, and what is left of that.

use std::mem;
use std::time::{Duration, Instant};

/// How long the steps of talking to the controller may take.
///
/// Each limit holds however often a signal of the operating system interrupts the waiting. Limits
/// under a millisecond count as one millisecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeLimits {
    /// For finding the addresses of a host name and connecting to one of them, all together.
    /// Default 5 s.
    ///
    /// Where a host has several addresses, each gets an equal share of the time that is left when
    /// its turn comes. A numeric address needs no finding, so nobody is asked for it.
    ///
    /// The operating system can't be interrupted while it looks for a host name. So that is done
    /// in a thread, which is left behind to end by itself when the limit comes; asking for the same
    /// name again waits for that thread and starts no other.
    pub connect: Duration,
    /// For the whole response to a command. Default 2 s; the controller answers an exchange
    /// after 10 ms, 40 ms at most.
    pub read: Duration,
    /// For handing a whole command to the operating system. Default 2 s.
    pub write: Duration,
}

impl Default for TimeLimits {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(5),
            read: Duration::from_secs(2),
            write: Duration::from_secs(2),
        }
    }
}

/// What is left of a limit that several waits share.
#[derive(Debug)]
pub(crate) struct TimeLeft {
    limit: Duration,
    /// `None` when it is beyond what a clock can tell.
    deadline: Option<Instant>,
    waited: bool,
}

impl TimeLeft {
    pub(crate) fn new(limit: Duration, now: Instant) -> Self {
        Self { limit, deadline: now.checked_add(limit), waited: false }
    }

    /// The limit that there was in the beginning.
    pub(crate) fn limit(&self) -> Duration {
        self.limit
    }

    /// How long the next wait may take; `None` when nothing is left.
    ///
    /// The first wait may take the whole limit. A transport that has been told this limit before
    /// need not be told again, which saves a system call in each exchange.
    pub(crate) fn next(&mut self, now: impl FnOnce() -> Instant) -> Option<Duration> {
        if !mem::replace(&mut self.waited, true) {
            return Some(self.limit);
        }
        let Some(deadline) = self.deadline else { return Some(self.limit) };
        deadline.checked_duration_since(now()).filter(|rest| !rest.is_zero())
    }
}
