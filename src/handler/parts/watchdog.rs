//! The watchdog: stops the outputs when the program shows no sign of life.

use std::time::{Duration, Instant};

use crate::handler::sync::now;

/// When the program has last shown that it is alive, and whether that is too long ago.
///
/// It stops nothing itself. The transfer thread asks it, and stops the outputs.
#[derive(Debug)]
pub(crate) struct Watchdog {
    /// `None` switches it off.
    limit: Option<Duration>,
    fed: Instant,
    /// When it has expired: the number of this interruption, until the program knows of it.
    expired: Option<u64>,
}

impl Watchdog {
    pub(crate) fn new(limit: Option<Duration>) -> Self {
        Self { limit, fed: now(), expired: None }
    }

    /// Starts again, for a new transfer.
    pub(crate) fn start(&mut self) {
        self.expired = None;
        self.feed();
    }

    /// The program is alive. After the watchdog has expired this is not enough.
    pub(crate) fn feed(&mut self) {
        if self.limit.is_some() {
            self.fed = now();
        }
    }

    /// The program was alive at this time.
    pub(crate) fn feed_at(&mut self, time: Instant) {
        self.fed = self.fed.max(time);
    }

    /// The program knows of the interruption with this number, or a later one, and goes on.
    pub(crate) fn acknowledge(&mut self, number: u64) {
        if self.expired.is_some_and(|expired| expired <= number) {
            self.start();
        }
    }

    /// The limit; 0 when it is off.
    pub(crate) fn limit(&self) -> Duration {
        self.limit.unwrap_or_default()
    }

    /// Whether the outputs are stopped until the program knows of it.
    pub(crate) fn has_expired(&self) -> bool {
        self.expired.is_some()
    }

    /// When it will expire; `None` when it is off or has already expired.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let limit = self.limit.filter(|_| !self.has_expired())?;
        self.fed.checked_add(limit)
    }

    /// If its deadline has come, expires as the interruption `number` and returns its limit.
    pub(crate) fn check(&mut self, now: Instant, number: u64) -> Option<Duration> {
        self.deadline().filter(|deadline| *deadline <= now)?;
        self.expired = Some(number);
        self.limit
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(500);

    #[test]
    fn it_expires_once_when_it_was_not_fed_for_its_limit() {
        let mut watchdog = Watchdog::new(Some(LIMIT));
        let deadline = watchdog.deadline().unwrap();
        assert_eq!(watchdog.check(deadline - Duration::from_nanos(1), 1), None);
        assert_eq!(watchdog.check(deadline, 1), Some(LIMIT));
        assert!(watchdog.has_expired());
        assert_eq!(watchdog.check(deadline + LIMIT, 2), None, "once");
        assert_eq!(watchdog.deadline(), None);
    }

    #[test]
    fn feeding_delays_it_but_does_not_undo_its_expiry() {
        let mut watchdog = Watchdog::new(Some(LIMIT));
        let first = watchdog.deadline().unwrap();
        while watchdog.deadline().unwrap() <= first {
            watchdog.feed();
        }
        assert_eq!(watchdog.check(first, 1), None);
        let second = watchdog.deadline().unwrap();
        assert_eq!(watchdog.check(second, 1), Some(LIMIT));
        watchdog.feed();
        assert!(watchdog.has_expired());
        watchdog.acknowledge(0);
        assert!(watchdog.has_expired(), "that was another interruption");
        watchdog.acknowledge(1);
        assert!(!watchdog.has_expired());
        assert!(watchdog.deadline().is_some());
    }

    #[test]
    fn it_starts_again_when_the_program_knows_of_a_later_interruption() {
        let mut watchdog = Watchdog::new(Some(LIMIT));
        let deadline = watchdog.deadline().unwrap();
        assert_eq!(watchdog.check(deadline, 1), Some(LIMIT));
        // The first one may not be told any more when there were many others.
        watchdog.acknowledge(17);
        assert!(!watchdog.has_expired());
    }

    #[test]
    fn without_a_limit_it_never_expires() {
        let mut watchdog = Watchdog::new(None);
        assert_eq!(watchdog.deadline(), None);
        assert_eq!(watchdog.check(Instant::now(), 1), None);
        let mut watchdog = Watchdog::new(Some(Duration::MAX));
        assert_eq!(watchdog.check(Instant::now(), 1), None);
    }
}
