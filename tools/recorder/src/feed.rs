//! What a program hands in that has no handler.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::notices::leave;
use ft_transfer_area::{LogEntry, Logged, LoggedCycle};
use log::Level;

use crate::format::{RecordedEvent, Transfer};
use crate::under_way::Missed;

/// So many messages about transfers have room beside the cycles.
const OF_TRANSFERS: usize = 16;

/// Takes cycles into a recording that has no handler; made by [`Recorder::fed`](crate::Recorder::fed). Nothing of
/// it waits for the disk: what has no room is lost, and the next entry has the number of lost ones.
///
/// ```
/// use std::time::Instant;
///
/// use ft_transfer_area::{FishX1Transfer, LoggedCycle};
/// use ft_transfer_area_recorder::{Options, Recorder, Transfer};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("run.mcap");
/// let (recorder, mut feed) = Recorder::fed(&path, Options::default())?;
/// feed.cycle(LoggedCycle::new(1, &[FishX1Transfer::default()]));
/// feed.transfer(Instant::now(), Transfer::Ended);
/// assert_eq!(recorder.finish()?.cycles, 1);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Feed {
    sender: Sender<FedEntry>,
    /// For how many cycles there is room.
    capacity: usize,
    lost: Arc<AtomicU64>,
    /// How many were lost since the last entry.
    lost_since: u64,
    missed: Missed,
}

/// An entry, before which this number was lost.
#[derive(Debug)]
pub(crate) struct FedEntry {
    pub(crate) lost: u64,
    pub(crate) what: Fed,
}

#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "nearly all of them are cycles")]
pub(crate) enum Fed {
    Cycle(LoggedCycle),
    Transfer { at: Instant, what: Transfer },
    Event { at: Instant, what: RecordedEvent },
}

impl FedEntry {
    /// What a handler has logged; `None` for what this program does not know yet.
    pub(crate) fn of_log(LogEntry { lost, what, .. }: LogEntry) -> Option<Self> {
        let what = match what {
            Logged::Cycle(cycle) => Fed::Cycle(cycle),
            Logged::Began(began) => Fed::Transfer { at: began.at, what: (&began).into() },
            Logged::Event(reported) => match Transfer::of_event(&reported.event) {
                Some(what) => Fed::Transfer { at: reported.arrived, what },
                // A kind that this program does not know yet is not lost.
                None => Fed::Event { at: reported.arrived, what: (&reported).into() },
            },
            Logged::Failed { at, error, .. } => {
                Fed::Transfer { at, what: Transfer::Failed((&error).into()) }
            }
            other => {
                let text =
                    format_args!("this recorder is too old for {other:?}, which is not recorded");
                leave(Level::Warn, module_path!(), text);
                return None;
            }
        };
        let what = match what {
            Fed::Transfer { at, what } => Fed::Transfer { at, what: what.cut() },
            what => what,
        };
        Some(Self { lost, what })
    }

    /// When it happened.
    pub(crate) fn at(&self) -> Instant {
        match &self.what {
            Fed::Cycle(cycle) => cycle.arrived,
            Fed::Transfer { at, .. } | Fed::Event { at, .. } => *at,
        }
    }
}

impl Feed {
    /// A feed with room for this number of entries, its other end, and the number of those that had no room.
    pub(crate) fn channel(capacity: usize) -> (Self, Receiver<FedEntry>, Arc<AtomicU64>) {
        let (sender, entries) = bounded(capacity + OF_TRANSFERS);
        let lost = Arc::new(AtomicU64::new(0));
        let missed = Missed::default();
        let feed = Self { sender, capacity, lost: Arc::clone(&lost), lost_since: 0, missed };
        (feed, entries, lost)
    }

    /// Records a cycle.
    pub fn cycle(&mut self, cycle: LoggedCycle) {
        let has_room = self.repeat_missed() && self.sender.len() < self.capacity;
        if !(has_room && self.put(Fed::Cycle(cycle))) {
            self.lose();
        }
    }

    /// Records what has happened to a transfer. It has room of its own; of what has none the newest comes when there is
    /// some.
    pub fn transfer(&mut self, at: Instant, what: Transfer) {
        let what = what.cut();
        if !(self.repeat_missed() && self.put(Fed::Transfer { at, what: what.clone() })) {
            self.lose();
            self.missed.note(at, &what);
        }
    }

    /// Returns whether there was room for it.
    fn repeat_missed(&mut self) -> bool {
        let Some((at, what)) = self.missed.get() else { return true };
        let is_put = self.put(Fed::Transfer { at, what });
        if is_put {
            self.missed.clear();
        }
        is_put
    }

    fn put(&mut self, what: Fed) -> bool {
        let is_put = self.sender.try_send(FedEntry { lost: self.lost_since, what }).is_ok();
        if is_put {
            self.lost_since = 0;
        }
        is_put
    }

    fn lose(&mut self) {
        self.lost_since += 1;
        self.lost.fetch_add(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::FishX1Transfer;

    use super::*;

    fn began(name: &str) -> Transfer {
        let [firmware, address] = [String::new(), String::new()];
        Transfer::Began { device_name: name.into(), firmware, address, areas: 1 }
    }

    /// Hands in a cycle.
    fn cycle(feed: &mut Feed) {
        feed.cycle(LoggedCycle::new(1, &[FishX1Transfer::default()]));
    }

    /// What waits: of each entry how many were lost before, and the transfer that it is about.
    fn waiting(entries: &Receiver<FedEntry>) -> Vec<(u64, Option<Transfer>)> {
        let transfer = |what| match what {
            Fed::Transfer { what, .. } => Some(what),
            Fed::Cycle(_) | Fed::Event { .. } => None,
        };
        entries.try_iter().map(|entry| (entry.lost, transfer(entry.what))).collect()
    }

    #[test]
    fn what_happens_to_transfers_has_room_where_cycles_have_none() {
        let (mut feed, entries, lost) = Feed::channel(1);
        (0..5).for_each(|_| cycle(&mut feed));
        feed.transfer(Instant::now(), Transfer::Ended);
        feed.transfer(Instant::now(), began("BETA"));
        cycle(&mut feed);
        let expected = [(0, None), (4, Some(Transfer::Ended)), (0, Some(began("BETA")))];
        assert_eq!(waiting(&entries), expected);
        cycle(&mut feed);
        assert_eq!(waiting(&entries), [(1, None)]);
        assert_eq!(lost.load(Ordering::Relaxed), 5);
    }

    #[test]
    fn what_follows_a_transfer_that_had_no_room_is_of_the_newest_one() {
        let (mut feed, entries, _lost) = Feed::channel(2);
        feed.transfer(Instant::now(), began("ALPHA"));
        for _ in 0..=OF_TRANSFERS {
            feed.transfer(Instant::now(), Transfer::Ended);
        }
        feed.transfer(Instant::now(), began("BETA"));
        cycle(&mut feed);
        assert_eq!(waiting(&entries).len(), 2 + OF_TRANSFERS);
        cycle(&mut feed);
        assert_eq!(waiting(&entries), [(2, Some(began("BETA"))), (0, None)]);
        // How it has ended is told, and no watchdog hides that.
        for _ in 0..2 + OF_TRANSFERS {
            feed.transfer(Instant::now(), began("GAMMA"));
        }
        let error = "the network is gone".to_owned();
        let failure = crate::Failure { kind: crate::FailureKind::Other, error };
        let ended = Transfer::EndedBy(failure);
        feed.transfer(Instant::now(), ended.clone());
        feed.transfer(Instant::now(), Transfer::WatchdogExpired { limit_ms: 5 });
        waiting(&entries);
        feed.transfer(Instant::now(), began("DELTA"));
        assert_eq!(waiting(&entries), [(2, Some(ended)), (0, Some(began("DELTA")))]);
    }
}
