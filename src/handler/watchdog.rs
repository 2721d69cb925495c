//! The watchdog: stops the outputs when the program shows no sign of life.

use std::time::{Duration, Instant};

/// When the program has last shown that it is alive, and whether that is too long ago.
///
/// It only says so. Whoever makes the requests asks it, and stops the outputs.
#[derive(Debug)]
pub(super) struct Watchdog {
    /// `None` switches it off.
    limit: Option<Duration>,
    fed: Instant,
    /// The number of the interruption that it was, until the program has learned of it.
    expired: Option<u64>,
}

impl Watchdog {
    pub(super) fn new(limit: Option<Duration>) -> Self {
        Self { limit, fed: Instant::now(), expired: None }
    }

    /// Begins anew with a transfer.
    pub(super) fn start(&mut self) {
        self.expired = None;
        self.feed();
    }

    /// The program is alive. After it has expired this is not enough.
    pub(super) fn feed(&mut self) {
        if self.limit.is_some() {
            self.fed = Instant::now();
        }
    }

    /// The program has learned of the interruption with this number, or a later one, and goes on.
    pub(super) fn acknowledge(&mut self, number: u64) {
        if self.expired.is_some_and(|expired| expired <= number) {
            self.start();
        }
    }

    /// Whether the outputs are stopped until the program has learned of it.
    pub(super) fn has_expired(&self) -> bool {
        self.expired.is_some()
    }

    /// When it will expire; `None` when it is off, and when it has expired already.
    pub(super) fn deadline(&self) -> Option<Instant> {
        let limit = self.limit.filter(|_| !self.has_expired())?;
        self.fed.checked_add(limit)
    }

    /// Expires when it is time for that, as the interruption `number`, and then tells its limit.
    pub(super) fn check(&mut self, now: Instant, number: u64) -> Option<Duration> {
        self.deadline().filter(|deadline| *deadline <= now)?;
        self.expired = Some(number);
        self.limit
    }
}

#[cfg(test)]
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
    fn food_puts_it_off_but_does_not_wake_it() {
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
    fn learning_of_a_later_interruption_wakes_it_too() {
        let mut watchdog = Watchdog::new(Some(LIMIT));
        let deadline = watchdog.deadline().unwrap();
        assert_eq!(watchdog.check(deadline, 1), Some(LIMIT));
        // The first one may be told no more when there were many others.
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
