//! Statistics of a transfer.

use std::time::{Duration, Instant};

/// Statistics of one transfer since its beginning.
///
/// Two figures say whether the program keeps up. [`missed_responses`](Self::missed_responses) counts
/// responses, and is the one for a program that polls. [`late_reactions`](Self::late_reactions) counts
/// guards, and is the one for threads that wait, as the cycle hook does.
/// [`TransferAreaGuard::cycle`](crate::TransferAreaGuard::cycle) shows which responses a thread has missed itself.
/// From the moment at which a transfer is asked to end, nothing is counted any more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Responses that have come in.
    pub cycles: u64,
    /// Configurations that were sent, including those before the first exchange.
    pub config_updates: u64,
    /// Guards that were dropped too late: the outputs for the request after the newest response that they
    /// showed were taken already. So their outputs went out one request later, or more. It counts guards of a
    /// wait, of the [cycle hook](crate::TransferAreaComHandler::set_cycle_hook), and those of a lock that
    /// were the first to show a response to their handle and changed outputs. Each counts once.
    pub late_reactions: u64,
    /// Responses that no guard has answered in time: none that showed the response was dropped before the
    /// outputs for the next request were taken. For a program that polls: how often it was too late,
    /// whether it changed outputs or not.
    pub missed_responses: u64,
    /// How often the connection was lost in a transfer that
    /// [reconnects](crate::TransferAreaComHandlerBuilder::reconnect).
    pub gaps: u64,
    /// The time between the last two responses of one connection; 0 before there were two.
    pub last_cycle: Duration,
    /// The shortest time between two responses of one connection; 0 before there were two.
    pub shortest_cycle: Duration,
    /// The longest time between two responses of one connection; 0 before there were two.
    pub longest_cycle: Duration,
}

impl Statistics {
    /// Counts a response that came in `now`, after the `previous` one.
    pub(crate) fn count_response(&mut self, previous: Option<Instant>, now: Instant) {
        self.cycles += 1;
        let Some(previous) = previous else { return };
        let cycle = now.saturating_duration_since(previous);
        self.last_cycle = cycle;
        self.longest_cycle = self.longest_cycle.max(cycle);
        let is_first = self.shortest_cycle.is_zero();
        self.shortest_cycle = if is_first { cycle } else { self.shortest_cycle.min(cycle) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_are_the_times_between_responses() {
        let ms = Duration::from_millis;
        let start = Instant::now();
        let mut statistics = Statistics::default();
        statistics.count_response(None, start);
        assert_eq!(statistics, Statistics { cycles: 1, ..Statistics::default() });
        for (previous, now) in [(0, 10), (10, 40), (40, 47), (47, 57)] {
            statistics.count_response(Some(start + ms(previous)), start + ms(now));
        }
        assert_eq!(
            statistics,
            Statistics {
                cycles: 5,
                last_cycle: ms(10),
                shortest_cycle: ms(7),
                longest_cycle: ms(30),
                ..Statistics::default()
            }
        );
    }
}
