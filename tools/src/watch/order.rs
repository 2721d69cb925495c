//! The order of connections: the commands of a program wait for its connection to the camera or to I2C, so that the
//! controller sees both in the program's order.

use std::time::{Duration, Instant};

/// How long commands wait. If that was for nothing, they wait for none during the pause: a program that connects again
/// and again does not hold up its own stop, and others that come all the time hold up nobody.
pub(super) const ORDER_LIMIT: Duration = Duration::from_millis(50);
const ORDER_PAUSE: Duration = Duration::from_secs(1);

#[derive(Default)]
pub(super) struct Order {
    /// Since when commands wait.
    since: Option<Instant>,
    /// From when on they may wait again.
    from: Option<Instant>,
}

impl Order {
    /// Whether commands wait, when connections are being made since these times.
    pub(super) fn waits(&mut self, begun: impl Iterator<Item = Instant>, now: Instant) -> bool {
        let mut is_coming = false;
        for begun in begun {
            let until = begun + ORDER_LIMIT;
            if now < until {
                is_coming = true;
            } else {
                self.from = self.from.max(Some(until + ORDER_PAUSE));
            }
        }
        if !is_coming || self.from.is_some_and(|from| now < from) {
            self.since = None;
            return false;
        }
        let until = *self.since.get_or_insert(now) + ORDER_LIMIT;
        if until <= now {
            self.from = Some(now + ORDER_PAUSE);
        }
        now < until
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_wait_for_a_connection_for_its_limit_and_then_pause() {
        let (mut order, begin) = (Order::default(), Instant::now());
        let mut waits = |ms, begun: &[u64]| {
            let at = |ms: &u64| begin + Duration::from_millis(*ms);
            order.waits(begun.iter().map(at), at(&ms))
        };
        assert!(waits(0, &[0]) && waits(40, &[0]) && !waits(45, &[]));
        assert!(waits(60, &[60]) && !waits(110, &[60]), "the limit");
        assert!(!waits(120, &[120]) && waits(1200, &[1200]), "the pause");
    }

    #[test]
    fn connections_that_come_all_the_time_hold_up_no_command_for_longer() {
        let (mut order, begin) = (Order::default(), Instant::now());
        let waits = |ms| {
            let now = begin + Duration::from_millis(ms);
            order.waits(std::iter::once(now), now)
        };
        assert_eq!((0..500).map(waits).filter(|waits| *waits).count(), 50);
    }
}
