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

/// The newest of what has happened to transfers for which a queue had no room. It is told as soon as there is some:
/// otherwise all that follows would be of the transfer before.
#[derive(Debug, Default)]
pub(crate) struct Missed(Option<(Instant, Transfer)>);

impl Missed {
    /// There was no room for this.
    pub(crate) fn note(&mut self, at: Instant, message: &Transfer) {
        if !matches!(message, Transfer::WatchdogExpired { .. } | Transfer::NotRecorded { .. }) {
            self.0 = Some((at, message.clone()));
        }
    }

    pub(crate) fn get(&self) -> Option<(Instant, Transfer)> {
        self.0.clone()
    }

    /// It was told.
    pub(crate) fn clear(&mut self) {
        self.0 = None;
    }
}
