//! Time limits, and the time that is left of them.

use std::mem;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use crate::error::Error;

/// In ms: with an hour, no sum of limits is beyond the range of a clock, and no thread is held forever.
pub(crate) const LIMIT_RANGE: RangeInclusive<i64> = 1..=3_600_000;

/// The shortest limit that the operating system accepts.
pub(super) const SHORTEST_LIMIT: Duration = Duration::from_millis(1);

/// How long the steps of talking to the controller may take.
///
/// Each is 1 ms to an hour; the call that gets the limits returns [`Error::OutOfRange`] for another one.
/// Signals of the operating system that interrupt a wait do not lengthen a limit.
///
/// ```
/// use std::time::Duration;
/// use ft_transfer_area::{TimeLimits, TransferAreaComHandler};
///
/// let limits = TimeLimits::default().read(Duration::from_secs(4));
/// let builder = TransferAreaComHandler::builder("192.168.8.2").time_limits(limits);
/// # let _ = builder;
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TimeLimits {
    /// For looking up the addresses of a host name and connecting to one of them, all together.
    /// Default 5 s.
    ///
    /// If a host has several addresses, each gets an equal share of the time that is left when
    /// its turn comes. A numeric address needs no lookup.
    ///
    /// The operating system can't be interrupted while it looks up a host name. So a thread does
    /// this; when the limit is over, it goes on in the background until it ends. Asking for the same
    /// name again waits for that thread and starts no other.
    pub connect: Duration,
    /// For the whole response to a command. Default 2 s; the controller usually answers an exchange
    /// after 10 ms; up to 40 ms were seen.
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

impl TimeLimits {
    /// These limits with another one for [`connect`](Self::connect).
    #[must_use]
    pub const fn connect(self, connect: Duration) -> Self {
        Self { connect, ..self }
    }

    /// These limits with another one for [`read`](Self::read).
    #[must_use]
    pub const fn read(self, read: Duration) -> Self {
        Self { read, ..self }
    }

    /// These limits with another one for [`write`](Self::write).
    #[must_use]
    pub const fn write(self, write: Duration) -> Self {
        Self { write, ..self }
    }

    /// Returns an error when one is out of its range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        Error::check_millis("limit for connecting in ms", self.connect, LIMIT_RANGE)?;
        Error::check_millis("limit for reading in ms", self.read, LIMIT_RANGE)?;
        Error::check_millis("limit for writing in ms", self.write, LIMIT_RANGE)
    }
}

/// What is left of a limit that several waits share.
#[derive(Debug)]
pub(crate) struct TimeLeft {
    limit: Duration,
    /// `None` when it is beyond the range of the clock.
    deadline: Option<Instant>,
    waited: bool,
}

impl TimeLeft {
    pub(crate) fn new(limit: Duration, now: Instant) -> Self {
        Self { limit, deadline: now.checked_add(limit), waited: false }
    }

    /// The whole limit.
    pub(crate) fn limit(&self) -> Duration {
        self.limit
    }

    /// How long the next wait may take; `None` when nothing is left.
    ///
    /// The first wait may take the whole limit. The transport has this limit set already, so it need not
    /// set another, which saves a system call in each exchange.
    pub(crate) fn next(&mut self, now: impl FnOnce() -> Instant) -> Option<Duration> {
        if !mem::replace(&mut self.waited, true) {
            return Some(self.limit);
        }
        let Some(deadline) = self.deadline else { return Some(self.limit) };
        deadline.checked_duration_since(now()).filter(|rest| !rest.is_zero())
    }
}
