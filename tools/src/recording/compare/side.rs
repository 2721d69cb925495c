//! One of two recordings that are compared, cycle by cycle.

use std::path::{Path, PathBuf};
use std::time::Duration;

use ft_transfer_area_recorder::{Cycle, Error, Recorded, Recording, Transfer};

use super::super::answering::Change;
use super::super::whole::{say_what_is_missing, Transfers};

pub(super) struct Side {
    pub(super) path: PathBuf,
    recording: Recording,
    transfers: Transfers,
    change: Change,
    /// When its first cycle was.
    begin: Option<Duration>,
    /// Whether something is missing since the last cycle, also before the end of its transfer.
    misses: bool,
    next: Option<Step>,
}

/// A cycle, in which transfer, and when it was in the recording.
pub(super) struct Step {
    transfer: u64,
    pub(super) at: Duration,
    pub(super) cycle: Cycle,
    /// Whether cycles are missing before it.
    lost: bool,
}

impl Step {
    /// What two cycles have in common that stand for each other.
    pub(super) fn key(&self) -> (u64, u64) {
        (self.transfer, self.cycle.number)
    }
}

impl Side {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let recording = Recording::open(path)?;
        Ok(Self {
            path: path.to_owned(),
            recording,
            transfers: Transfers::default(),
            change: Change::default(),
            begin: None,
            misses: false,
            next: None,
        })
    }

    /// The recording, at its beginning again.
    pub(super) fn again(&mut self) -> Result<(&Path, &mut Recording), Error> {
        self.recording.rewind()?;
        Ok((&self.path, &mut self.recording))
    }

    /// When its first cycle was.
    pub(super) fn begin(&self) -> Duration {
        self.begin.unwrap_or_default()
    }

    pub(super) fn say_what_is_missing(&self) {
        self.change.say(&self.path);
        say_what_is_missing(&self.recording, &self.path, ": it is compared up to there");
    }

    /// The next cycle.
    pub(super) fn peek(&mut self) -> Result<Option<&Step>, Error> {
        while self.next.is_none() {
            let Some(entry) = self.recording.next().transpose()? else { break };
            if let Recorded::Transfer(transfer) = &entry.what {
                self.change.take(transfer, entry.at);
            }
            match entry.what {
                Recorded::Transfer(Transfer::Began { .. }) => self.transfers.begin(),
                Recorded::Missing | Recorded::Transfer(Transfer::NotRecorded { .. }) => {
                    self.transfers.miss();
                    self.misses = true;
                }
                Recorded::Cycle(cycle) => {
                    // It may have been running when the recording was started.
                    self.transfers.cycle(cycle.number);
                    let misses = std::mem::take(&mut self.misses);
                    let lost = misses || cycle.lost > 0 || self.begin.is_none();
                    self.begin.get_or_insert(entry.at);
                    let transfer = self.transfers.count;
                    self.next = Some(Step { transfer, at: entry.at, cycle, lost });
                }
                _ => {}
            }
        }
        Ok(self.next.as_ref())
    }

    pub(super) fn take(&mut self) -> Result<Option<Step>, Error> {
        self.peek()?;
        Ok(self.next.take())
    }

    /// Whether cycles are missing before the next one, or at the end.
    pub(super) fn has_lost(&mut self) -> Result<bool, Error> {
        let lost = self.peek()?.map(|step| step.lost);
        Ok(lost.unwrap_or(self.misses))
    }
}
