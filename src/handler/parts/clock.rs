//! The clock for the times of a transfer.

use std::time::{Duration, Instant};

use crate::handler::sync;

/// How far a response moves the clock of a machine in lock-step.
pub(crate) const STEP: Duration = Duration::from_millis(10);

/// The system's clock, or in lock-step one that only responses move.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TransferClock {
    System,
    /// With its current time.
    LockStep(Instant),
}

impl TransferClock {
    pub(crate) fn new(lock_step: bool) -> Self {
        if lock_step {
            Self::LockStep(sync::now())
        } else {
            Self::System
        }
    }

    pub(crate) fn is_lock_step(self) -> bool {
        matches!(self, Self::LockStep(_))
    }

    pub(crate) fn now(self) -> Instant {
        match self {
            Self::System => sync::now(),
            Self::LockStep(now) => now,
        }
    }

    /// A response has come in.
    pub(crate) fn step(&mut self) {
        if let Self::LockStep(now) = self {
            *now += STEP;
        }
    }

    /// The end of a time limit; `None` when that is beyond the range of the clock.
    pub(crate) fn deadline_after(self, limit: Duration) -> Option<Instant> {
        self.now().checked_add(limit)
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;

    #[test]
    fn in_lock_step_only_responses_move_it() {
        let mut clock = TransferClock::new(true);
        let begin = clock.now();
        while begin.elapsed() < Duration::from_millis(1) {}
        assert_eq!(clock.now(), begin);
        clock.step();
        assert_eq!(clock.now(), begin + STEP);
        assert_eq!(clock.deadline_after(STEP), Some(begin + 2 * STEP));
        assert_eq!(clock.deadline_after(Duration::MAX), None);
    }

    #[test]
    fn the_system_clock_goes_by_itself() {
        let mut clock = TransferClock::new(false);
        let begin = clock.now();
        while clock.now() == begin {}
        clock.step();
        assert!(clock.now() < begin + Duration::from_secs(3600));
    }
}
