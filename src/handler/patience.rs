//! Whether it pays to stay awake for what other threads are about to do.

/// A thread that was not answered in time sleeps during this many later waits.
const WAITS_ASLEEP: u32 = 1000;

/// What one kind of wait has learned: while each processor has its own work, or the other side is slow, a thread that
/// stays awake only takes time from others.
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

    /// A thread has stayed awake, and it was in vain.
    pub(super) fn lose(&mut self) {
        self.asleep = WAITS_ASLEEP;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_in_vain_lets_later_ones_sleep_for_a_while() {
        let mut patience = Patience::default();
        assert!((0..10).all(|_| patience.stays_awake()));
        patience.lose();
        assert!((0..WAITS_ASLEEP).all(|_| !patience.stays_awake()));
        assert!(patience.stays_awake());
    }
}
