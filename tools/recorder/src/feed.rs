//! What a program hands in that has no handler.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::notices::leave;
use ft_transfer_area::{LogEntry, Logged, LoggedCycle};
use log::Level;

use crate::format::{RecordedEvent, Transfer};

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
    lost: Arc<AtomicU64>,
    /// How many were lost since the last entry.
    lost_since: u64,
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
        let (sender, entries) = bounded(capacity);
        let lost = Arc::new(AtomicU64::new(0));
        (Self { sender, lost: Arc::clone(&lost), lost_since: 0 }, entries, lost)
    }

    /// Records a cycle.
    pub fn cycle(&mut self, cycle: LoggedCycle) {
        self.put(Fed::Cycle(cycle));
    }

    /// Records what has happened to a transfer.
    pub fn transfer(&mut self, at: Instant, what: Transfer) {
        self.put(Fed::Transfer { at, what });
    }

    fn put(&mut self, what: Fed) {
        if self.sender.try_send(FedEntry { lost: self.lost_since, what }).is_ok() {
            self.lost_since = 0;
        } else {
            self.lost_since += 1;
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}
