//! A log of everything that a transfer exchanges, on a channel, for recorders.

use std::net::IpAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{bounded, Receiver, Sender};

use super::event::TimedEvent;
use crate::error::Error;
use crate::exchange::Inputs;
use crate::firmware::FirmwareVersion;
use crate::handler::statistics::Statistics;
use crate::transfer_area::{FishX1Transfer, IZ_COUNTER, IZ_MOTOR, MAX_AREAS};

/// Places for entries that are not cycles: the beginnings, gaps and ends of a transfer.
const RESERVED: usize = 16;

/// An entry of a [`CycleLog`](crate::CycleLog).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LogEntry {
    /// How many entries were lost directly before this one, because the channel was full.
    pub lost: u64,
    /// What has happened.
    pub what: Logged,
}

/// What a [`LogEntry`] tells.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant, reason = "cycles are by value, so that none of them allocates")]
pub enum Logged {
    /// A transfer has begun, or runs already when the log is made.
    Began(LoggedBeginning),
    /// A request was sent, and its response came in.
    Cycle(LoggedCycle),
    /// What comes from no response: [`ConnectionLost`](crate::Event::ConnectionLost),
    /// [`ConnectionRestored`](crate::Event::ConnectionRestored),
    /// [`WatchdogExpired`](crate::Event::WatchdogExpired) or
    /// [`TransferEnded`](crate::Event::TransferEnded).
    Event(TimedEvent),
    /// A transfer could not begin.
    #[non_exhaustive]
    Failed {
        /// When.
        at: Instant,
        /// Why.
        error: Error,
    },
}

/// The beginning of a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoggedBeginning {
    /// When it began.
    pub at: Instant,
    /// The name of the controller.
    pub device_name: String,
    /// The version of its firmware.
    pub firmware: FirmwareVersion,
    /// Its address.
    pub address: Option<IpAddr>,
    /// How many areas the handler has.
    pub areas: usize,
}

/// One cycle: a request, and the response to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoggedCycle {
    /// Its number in its transfer, from 1, as
    /// [`TransferAreaGuard::cycle`](crate::TransferAreaGuard::cycle) counts.
    pub number: u64,
    /// When the response came in.
    pub arrived: Instant,
    /// Whether it is the first of its connection.
    pub first: bool,
    /// The statistics with this response.
    pub statistics: Statistics,
    count: usize,
    areas: [FishX1Transfer; MAX_AREAS],
}

impl LoggedCycle {
    /// The areas: the configurations and outputs as they were sent, the inputs as they came in. The rest is as in
    /// a new area. So are the inputs of an extension that has not yet taken part on this connection, the
    /// timers, and the flags [`cnt_resetted`](crate::transfer_area::InputValues::cnt_resetted) and
    /// [`motor_ex_reached`](crate::transfer_area::InputValues::motor_ex_reached), which belong to the
    /// program.
    ///
    /// After a lost connection a handler hides from the program that a command which was cut off is done. Here it
    /// is what the controller reports.
    pub fn areas(&self) -> &[FishX1Transfer] {
        &self.areas[..self.count]
    }

    /// A cycle with these areas, to test what a program does with it. It arrived now, as the first of its
    /// connection. More than 9 areas are left out.
    pub fn new(number: u64, areas: &[FishX1Transfer]) -> Self {
        let mut cycle = Self {
            number,
            arrived: Instant::now(),
            first: true,
            statistics: Statistics::default(),
            count: areas.len().min(MAX_AREAS),
            areas: [FishX1Transfer::default(); MAX_AREAS],
        };
        cycle.areas.iter_mut().zip(areas).for_each(|(logged, area)| *logged = *area);
        cycle
    }

    /// The areas of a request, without their inputs; those come from the response.
    pub(crate) fn exchanged(
        number: u64,
        arrived: Instant,
        first: bool,
        statistics: Statistics,
        sent: &[FishX1Transfer],
        inputs: &Inputs,
    ) -> Self {
        let mut cycle = Self { arrived, first, statistics, ..Self::new(number, &[]) };
        cycle.count = sent.len().min(MAX_AREAS);
        for (area, sent) in cycle.areas.iter_mut().zip(sent) {
            area.state.id = sent.state.id;
            area.state.config_id = sent.state.config_id;
            area.config = sent.config;
            area.output = sent.output;
            area.output.duty = sent.output.sent_duty();
            area.txt_outputs = sent.txt_outputs;
        }
        let areas = &mut cycle.areas[..cycle.count];
        inputs.apply(areas);
        for area in areas {
            area.input.cnt_resetted = [0; IZ_COUNTER];
            area.input.motor_ex_reached = [0; IZ_MOTOR];
        }
        cycle
    }
}

/// The program's end of a new log.
pub(crate) struct Subscription {
    pub(super) receiver: Receiver<LogEntry>,
    /// Also identifies the log.
    pub(super) lost: Arc<AtomicU64>,
}

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
}

impl Logs {
    /// Adds a log. If a transfer runs already, its first entry is this beginning.
    pub(crate) fn add(
        &mut self,
        capacity: usize,
        running: Option<LoggedBeginning>,
    ) -> Subscription {
        let (sender, receiver) = bounded(capacity + RESERVED);
        let lost = Arc::new(AtomicU64::new(0));
        let mut log = Log { sender, capacity, lost: Arc::clone(&lost), lost_since: 0 };
        if let Some(running) = running {
            log.put(RESERVED, || Logged::Began(running));
        }
        self.0.push(log);
        Subscription { receiver, lost }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Logs a cycle. Does not block.
    pub(crate) fn note_cycle(&mut self, cycle: &LoggedCycle) {
        self.0.iter_mut().for_each(|log| log.put(0, || Logged::Cycle(*cycle)));
    }

    /// Logs an entry that is not a cycle. Does not block.
    pub(crate) fn note(&mut self, what: &Logged) {
        self.0.iter_mut().for_each(|log| log.put(RESERVED, || what.clone()));
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn remove(&mut self, lost: &Arc<AtomicU64>) {
        self.0.retain(|log| !Arc::ptr_eq(&log.lost, lost));
    }
}

impl Log {
    /// Puts an entry into the channel, which may use this many of the reserved places for it. No other thread does
    /// so while the logs are locked, so there is still room.
    fn put(&mut self, reserved: usize, what: impl FnOnce() -> Logged) {
        let has_room = self.sender.len() < self.capacity + reserved;
        if has_room
            && self.sender.try_send(LogEntry { lost: self.lost_since, what: what() }).is_ok()
        {
            self.lost_since = 0;
        } else {
            self.lost_since += 1;
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;
    use crate::handler::events::Event;

    fn logs(capacity: usize) -> (Logs, Receiver<LogEntry>) {
        let mut logs = Logs::default();
        let receiver = logs.add(capacity, None).receiver;
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
    fn outputs_are_logged_as_they_are_sent() {
        let mut sent = [FishX1Transfer::default()];
        sent[0].output.duty = [-1, 0, 1, 512, 513, i16::MAX, i16::MIN, 256];
        sent[0].input.uni = [77; 8];
        let cycle = LoggedCycle::exchanged(
            1,
            Instant::now(),
            true,
            Statistics::default(),
            &sent,
            &Inputs::default(),
        );
        assert_eq!(cycle.areas()[0].output.duty, [0, 0, 1, 512, 512, 512, 0, 256]);
        assert_eq!(cycle.areas()[0].input.uni, [0; 8], "no input has come in");
    }
}
