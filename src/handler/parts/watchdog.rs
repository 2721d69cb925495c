//! The watchdog: stops the outputs when the program shows no sign of life.

use std::time::{Duration, Instant};

use crate::handler::sync::earlier;

/// How long the cycle hook may keep the areas, unless the watchdog has a limit.
pub(crate) const HOOK_LIMIT: Duration = Duration::from_millis(500);

/// When the program has last shown that it is alive, and whether that is too long ago.
///
/// It stops nothing itself. The transfer thread asks it, and stops the outputs.
#[derive(Debug)]
pub(crate) struct Watchdog {
    /// `None` switches it off, except for the cycle hook.
    limit: Option<Duration>,
    started: Instant,
    fed: Instant,
    /// When it has expired: the number of this interruption, until the program knows of it.
    expired: Option<u64>,
}

impl Watchdog {
    pub(crate) fn new(limit: Option<Duration>, now: Instant) -> Self {
        Self { limit, started: now, fed: now, expired: None }
    }

    /// Starts again, for a new transfer.
    pub(crate) fn start(&mut self, now: Instant) {
        self.expired = None;
        (self.started, self.fed) = (now, now);
    }

    /// Whether signs of life count.
    pub(crate) fn is_on(&self) -> bool {
        self.limit.is_some()
    }

    /// The program was alive at this time. After the watchdog has expired this is not enough.
    pub(crate) fn feed(&mut self, time: Instant) {
        self.fed = self.fed.max(time);
    }

    /// A first handle knows of the interruption with this number, or a later one: the outputs of all handles count again.
    pub(crate) fn acknowledge(&mut self, number: u64, now: Instant) {
        if self.expired.is_some_and(|expired| expired <= number) {
            self.start(now);
        }
    }

    /// The limit; that of the hook when it is off.
    pub(crate) fn limit(&self) -> Duration {
        self.limit.unwrap_or(HOOK_LIMIT)
    }

    /// The number of the interruption when it has expired, until the program knows of it.
    pub(crate) fn expired(&self) -> Option<u64> {
        self.expired
    }

    /// Whether the outputs are stopped until the program knows of it.
    pub(crate) fn has_expired(&self) -> bool {
        self.expired.is_some()
    }

    /// When it will expire, with a cycle hook that has the areas since then; `None` when it is off or has already
    /// expired.
    pub(crate) fn deadline(&self, hook_since: Option<Instant>) -> Option<Instant> {
        if self.has_expired() {
            return None;
        }
        let after = |since: Instant| since.checked_add(self.limit());
        let own = self.limit.and_then(|_| after(self.fed));
        // Signs of life of other threads don't count for it.
        let hook = hook_since.and_then(|since| after(since.max(self.started)));
        earlier(own, hook)
    }

    /// If its deadline has come, expires as the interruption `number` and returns its limit.
    pub(crate) fn check(
        &mut self,
        now: Instant,
        hook_since: Option<Instant>,
        number: u64,
    ) -> Option<Duration> {
        self.deadline(hook_since).filter(|deadline| *deadline <= now)?;
        self.expired = Some(number);
        Some(self.limit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(300);
    const NANO: Duration = Duration::from_nanos(1);

    #[test]
    fn it_expires_once_when_it_was_not_fed_for_its_limit() {
        let begin = Instant::now();
        let mut watchdog = Watchdog::new(Some(LIMIT), begin);
        assert_eq!(watchdog.check(begin + LIMIT - NANO, None, 1), None);
        assert_eq!(watchdog.check(begin + LIMIT, None, 1), Some(LIMIT));
        assert!(watchdog.has_expired());
        assert_eq!(watchdog.check(begin + 2 * LIMIT, None, 2), None, "once");
        assert_eq!(watchdog.deadline(None), None);
    }

    #[test]
    fn feeding_delays_it_but_does_not_undo_its_expiry() {
        let begin = Instant::now();
        let mut watchdog = Watchdog::new(Some(LIMIT), begin);
        watchdog.feed(begin + LIMIT);
        watchdog.feed(begin);
        assert_eq!(watchdog.check(begin + LIMIT, None, 1), None);
        assert_eq!(watchdog.check(begin + 2 * LIMIT, None, 1), Some(LIMIT));
        watchdog.feed(begin + 2 * LIMIT);
        assert!(watchdog.has_expired());
        watchdog.acknowledge(0, begin + 2 * LIMIT);
        assert!(watchdog.has_expired(), "that was another interruption");
        watchdog.acknowledge(1, begin + 2 * LIMIT);
        assert_eq!(watchdog.deadline(None), Some(begin + 3 * LIMIT));
    }

    #[test]
    fn it_starts_again_when_the_program_knows_of_a_later_interruption() {
        let begin = Instant::now();
        let mut watchdog = Watchdog::new(Some(LIMIT), begin);
        assert_eq!(watchdog.check(begin + LIMIT, None, 1), Some(LIMIT));
        // The first one may not be reported any more when there were many others.
        watchdog.acknowledge(17, begin + LIMIT);
        assert!(!watchdog.has_expired());
    }

    #[test]
    fn without_a_limit_it_expires_only_for_a_hook_that_keeps_the_areas() {
        let (begin, late) = (Instant::now(), Duration::from_secs(3600));
        let mut watchdog = Watchdog::new(None, begin);
        assert_eq!(watchdog.check(begin + late, None, 1), None);
        let got = begin + late;
        assert_eq!(watchdog.check(got + HOOK_LIMIT - NANO, Some(got), 1), None);
        assert_eq!(watchdog.check(got + HOOK_LIMIT, Some(got), 1), Some(HOOK_LIMIT));
        watchdog.acknowledge(1, got + HOOK_LIMIT);
        assert_eq!(watchdog.deadline(Some(got)), Some(got + 2 * HOOK_LIMIT), "it still has them");
        let mut watchdog = Watchdog::new(Some(2 * LIMIT), begin);
        watchdog.feed(got + 2 * LIMIT);
        assert_eq!(watchdog.check(got + 2 * LIMIT - NANO, Some(got), 1), None);
        let expired = watchdog.check(got + 2 * LIMIT, Some(got), 1);
        assert_eq!(expired, Some(2 * LIMIT), "others feed, but the hook has the areas");
        let mut watchdog = Watchdog::new(Some(Duration::MAX), begin);
        assert_eq!(watchdog.check(got + HOOK_LIMIT, Some(got), 1), None, "the program's own limit");
    }
}
