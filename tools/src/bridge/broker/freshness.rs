//! How long a message may have waited before it was read.
//!
//! A message has no time in it. But when the connection has been read until nothing was left, whatever comes later has
//! also arrived later.

use std::time::{Duration, Instant};

/// How often the connection is checked.
const TICK: Duration = Duration::from_millis(100);

/// After such a pause this process has not run: it was suspended, or the computer was.
const STALL: Duration = Duration::from_millis(300);

/// For this time after a stall, an empty connection means nothing: what has arrived meanwhile may not be known yet.
const SETTLING: Duration = Duration::from_millis(50);

pub(super) struct Freshness {
    /// When nothing waited.
    empty: Instant,
    /// When `nothing_waits` was last called.
    said: Instant,
    /// When the last stall ended.
    resumed: Option<Instant>,
}

impl Freshness {
    /// Of a connection that has not begun.
    pub(super) fn new(now: Instant) -> Self {
        Self { empty: now, said: now, resumed: None }
    }

    /// When to look next whether something waits.
    pub(super) fn next_look(&self) -> Instant {
        self.said + TICK
    }

    /// Everything that has arrived has been read.
    pub(super) fn nothing_waits(&mut self, now: Instant) {
        if now.saturating_duration_since(self.said) > STALL {
            self.resumed = Some(now);
        }
        self.said = now;
        let settled = |at| now.saturating_duration_since(at) >= SETTLING;
        if self.resumed.is_none_or(settled) {
            self.empty = now;
        }
    }

    /// What is read now has not arrived before this time.
    pub(super) fn not_before(&self) -> Instant {
        self.empty
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_after_a_stall_may_have_come_at_its_beginning() {
        let begin = Instant::now();
        let at = |ms| begin + Duration::from_millis(ms);
        let mut freshness = Freshness::new(begin);
        (1..=10).for_each(|tick| freshness.nothing_waits(at(100 * tick)));
        assert_eq!(freshness.not_before(), at(1000));
        // Two seconds later the process goes on. What the system has may not be known at once.
        freshness.nothing_waits(at(3000));
        freshness.nothing_waits(at(3001));
        assert_eq!(freshness.not_before(), at(1000));
        freshness.nothing_waits(at(3100));
        assert_eq!(freshness.not_before(), at(3100));
    }
}
