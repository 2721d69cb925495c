//! The transfer's ends of all logs.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;

use crossbeam_channel::{bounded, Sender};

use super::listeners::Subscription;
use crate::events::{Event, LogEntry, Logged, LoggedCycle, TimedEvent};

/// Places for entries that are not cycles: the beginnings, gaps and ends of a transfer.
const RESERVED: usize = 16;

/// The transfer's ends of all logs.
#[derive(Debug, Default)]
pub(crate) struct Logs(Vec<Log>);

#[derive(Debug)]
struct Log {
    /// Has [`RESERVED`] more places than `capacity`.
    sender: Sender<LogEntry>,
    capacity: usize,
    pub(super) lost: Arc<AtomicU64>,
    /// How many were lost since the last entry.
    lost_since: u64,
    /// The newest beginning, gap or end that was lost. It is repeated when there is room: otherwise what follows would
    /// seem to be of the controller before.
    missed: Option<Logged>,
}

impl Logs {
    /// Adds a log. If a transfer runs already, its first entries are these: its beginning, and the gap that it is in.
    pub(super) fn add(
        &mut self,
        capacity: usize,
        running: impl Iterator<Item = Logged>,
    ) -> Subscription<LogEntry> {
        let (sender, receiver) = bounded(capacity + RESERVED);
        let lost = Arc::new(AtomicU64::new(0));
        let mut log =
            Log { sender, capacity, lost: Arc::clone(&lost), lost_since: 0, missed: None };
        running.for_each(|entry| log.note(&entry));
        self.0.push(log);
        Subscription { receiver, lost }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Logs a cycle. Does not block.
    pub(crate) fn note_cycle(&mut self, cycle: &LoggedCycle) {
        for log in &mut self.0 {
            log.repeat_missed();
            log.put(0, || Logged::Cycle(*cycle));
        }
    }

    /// Logs an entry that is not a cycle. Does not block.
    pub(crate) fn note(&mut self, what: &Logged) {
        self.0.iter_mut().for_each(|log| log.note(what));
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn remove(&mut self, lost: &Arc<AtomicU64>) {
        self.0.retain(|log| !Arc::ptr_eq(&log.lost, lost));
    }
}

impl Log {
    fn note(&mut self, what: &Logged) {
        self.repeat_missed();
        let is_of_watchdog =
            matches!(what, Logged::Event(TimedEvent { event: Event::WatchdogExpired { .. }, .. }));
        if !self.put(RESERVED, || what.clone()) && !is_of_watchdog {
            self.missed = Some(what.clone());
        }
    }

    fn repeat_missed(&mut self) {
        if self.missed.is_none() || !self.has_room(RESERVED) {
            return;
        }
        if let Some(missed) = self.missed.take() {
            self.put(RESERVED, || missed);
        }
    }

    fn has_room(&self, reserved: usize) -> bool {
        self.sender.len() < self.capacity + reserved
    }

    /// Puts an entry into the channel, which may use this many of the reserved places for it. Returns whether there was
    /// room. No other thread does so while the logs are locked, so there is still room.
    fn put(&mut self, reserved: usize, what: impl FnOnce() -> Logged) -> bool {
        let is_put = self.has_room(reserved)
            && self.sender.try_send(LogEntry { lost: self.lost_since, what: what() }).is_ok();
        if is_put {
            self.lost_since = 0;
        } else {
            self.lost_since += 1;
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
        is_put
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    use crossbeam_channel::Receiver;

    use crate::error::Error;
    use crate::transfer_area::FishX1Transfer;

    fn logs(capacity: usize) -> (Logs, Receiver<LogEntry>) {
        let mut logs = Logs::default();
        let receiver = logs.add(capacity, std::iter::empty()).receiver;
        (logs, receiver)
    }

    fn cycle(number: u64) -> LoggedCycle {
        LoggedCycle::new(number, &[FishX1Transfer::default()])
    }

    fn ended() -> Logged {
        let event = Event::TransferEnded { error: None };
        Logged::Event(TimedEvent { event, cycle: 1, arrived: Instant::now() })
    }

    /// The lost entries and the numbers of cycles, 0 for other entries.
    fn received(receiver: &Receiver<LogEntry>) -> Vec<(u64, u64)> {
        let number = |what| if let Logged::Cycle(cycle) = what { cycle.number } else { 0 };
        receiver.try_iter().map(|entry| (entry.lost, number(entry.what))).collect()
    }

    #[test]
    fn the_entry_after_a_loss_tells_how_many_are_missing() {
        let (mut logs, receiver) = logs(2);
        (1..=5).for_each(|number| logs.note_cycle(&cycle(number)));
        assert_eq!(received(&receiver), [(0, 1), (0, 2)]);
        (6..=9).for_each(|number| logs.note_cycle(&cycle(number)));
        assert_eq!(received(&receiver), [(3, 6), (0, 7)]);
        logs.note_cycle(&cycle(10));
        assert_eq!(received(&receiver), [(2, 10)]);
        assert_eq!(logs.0[0].lost.load(Ordering::Relaxed), 5);
    }

    #[test]
    fn the_end_of_a_transfer_has_room_in_a_log_that_is_full_of_cycles() {
        let (mut logs, receiver) = logs(1);
        (1..=2).for_each(|number| logs.note_cycle(&cycle(number)));
        (0..=RESERVED).for_each(|_| logs.note(&ended()));
        let received = received(&receiver);
        assert_eq!((received.len(), &received[..2]), (1 + RESERVED, &[(0, 1), (1, 0)][..]));
        assert_eq!(logs.0[0].lost_since, 1, "one more than there is room for");
    }

    #[test]
    fn the_newest_gap_that_had_no_room_comes_before_the_next_cycle() {
        let (mut logs, receiver) = logs(2);
        let event = |event| Logged::Event(TimedEvent { event, cycle: 1, arrived: Instant::now() });
        let expired = |seconds| Error::WatchdogExpired { limit: Duration::from_secs(seconds) };
        let gap = |number| event(Event::ConnectionLost { error: expired(number) });
        (0..20).for_each(|number| logs.note(&gap(number)));
        logs.note(&event(Event::WatchdogExpired { limit: Duration::ZERO }));
        logs.note_cycle(&cycle(1));
        assert_eq!(received(&receiver), [(0, 0); 18]);
        logs.note_cycle(&cycle(2));
        let first = receiver.try_recv().unwrap();
        let Logged::Event(TimedEvent { event: Event::ConnectionLost { error }, .. }) = first.what
        else {
            panic!("{first:?}");
        };
        assert_eq!((first.lost, error), (4, expired(19)));
        assert_eq!(received(&receiver), [(0, 2)]);
        logs.note_cycle(&cycle(3));
        assert_eq!(received(&receiver), [(0, 3)], "it is repeated once");
    }
}
