//! What a file has to begin with when a transfer runs already.

use std::time::Instant;

use ft_transfer_area::Statistics;

use crate::format::Transfer;

/// What has happened to the transfer that runs, as far as a file needs it that begins now.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnderWay {
    messages: Vec<Transfer>,
    /// Of its last cycle.
    statistics: Option<Statistics>,
}

impl UnderWay {
    pub(crate) fn messages(&self) -> &[Transfer] {
        &self.messages
    }

    pub(crate) fn statistics(&self) -> Option<&Statistics> {
        self.statistics.as_ref()
    }

    /// A cycle with these statistics.
    pub(crate) fn count(&mut self, statistics: Statistics) {
        self.statistics = Some(statistics);
    }

    pub(crate) fn take(&mut self, message: &Transfer) {
        match message {
            Transfer::Began { .. } => {
                *self = Self { messages: vec![message.clone()], statistics: None };
            }
            Transfer::Lost(_) => {
                self.messages.truncate(1);
                self.messages.push(message.clone());
            }
            Transfer::Restored { device_name, firmware, address, .. } => {
                self.messages.truncate(1);
                if let Some(Transfer::Began {
                    device_name: name,
                    firmware: version,
                    address: at,
                    ..
                }) = self.messages.first_mut()
                {
                    name.clone_from(device_name);
                    version.clone_from(firmware);
                    at.clone_from(address);
                }
            }
            Transfer::Failed(_) | Transfer::Ended | Transfer::EndedBy(_) => *self = Self::default(),
            Transfer::WatchdogExpired { .. } | Transfer::NotRecorded { .. } => {}
        }
    }
}

/// What has happened to a transfer, for a queue that may be full. What had no room is told as soon as there is some:
/// otherwise all that follows would be of the transfer before.
#[derive(Debug, Default)]
pub(crate) struct Told {
    under_way: UnderWay,
    /// When the last of it was that had no room.
    missed: Option<Instant>,
}

impl Told {
    pub(crate) fn since(under_way: UnderWay) -> Self {
        Self { under_way, missed: None }
    }

    pub(crate) fn take(&mut self, message: &Transfer) {
        self.under_way.take(message);
    }

    /// What was taken last had no room.
    pub(crate) fn miss(&mut self, at: Instant) {
        self.missed = Some(at);
    }

    /// What has to be told first; nothing if all was told.
    pub(crate) fn missed(&self) -> Vec<(Instant, Transfer)> {
        let Some(at) = self.missed else { return Vec::new() };
        match self.under_way.messages() {
            [] => vec![(at, Transfer::Ended)],
            messages => messages.iter().map(|message| (at, message.clone())).collect(),
        }
    }

    /// That was told.
    pub(crate) fn caught_up(&mut self) {
        self.missed = None;
    }
}
