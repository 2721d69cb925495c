//! Whether it pays to stay awake for what other threads are about to do.

use std::time::Duration;

/// A thread that gave its core away for a moment, and got it back after this time, is not alone: other threads have
/// work for it.
const BUSY: Duration = Duration::from_millis(1);

/// So many waits sleep then. A thread that sleeps gets a core sooner than one that gives its core away.
const WAITS_ASLEEP: u32 = 1000;

/// What the threads of a transfer have learned about their cores.
#[derive(Debug, Default)]
pub(super) struct Patience {
    asleep: u32,
}

impl Patience {
    /// Whether the next wait begins awake.
    pub(super) fn stays_awake(&mut self) -> bool {
        let stays = self.asleep == 0;
        self.asleep = self.asleep.saturating_sub(1);
        stays
    }

    /// A thread has stayed awake for this time.
    pub(super) fn learn(&mut self, took: Duration) {
        if took >= BUSY {
            self.asleep = WAITS_ASLEEP;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_sleep_for_a_while_when_others_need_the_core() {
        let mut patience = Patience::default();
        patience.learn(BUSY / 2);
        assert!((0..10).all(|_| patience.stays_awake()));
        patience.learn(BUSY);
        assert!((0..WAITS_ASLEEP).all(|_| !patience.stays_awake()));
        assert!(patience.stays_awake());
    }
}
