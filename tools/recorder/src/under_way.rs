//! What a file has to begin with when a transfer runs already.

use crate::format::Transfer;

/// What has happened to the transfer that runs, as far as a file needs it that begins now.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnderWay(Vec<Transfer>);

impl UnderWay {
    pub(crate) fn messages(&self) -> &[Transfer] {
        &self.0
    }

    pub(crate) fn take(&mut self, message: &Transfer) {
        match message {
            Transfer::Began { .. } => self.0 = vec![message.clone()],
            Transfer::Lost(_) => {
                self.0.truncate(1);
                self.0.push(message.clone());
            }
            Transfer::Restored { device_name: new_name, firmware: new_firmware, .. } => {
                self.0.truncate(1);
                if let Some(Transfer::Began { device_name, firmware, .. }) = self.0.first_mut() {
                    device_name.clone_from(new_name);
                    firmware.clone_from(new_firmware);
                }
            }
            Transfer::Failed(_) | Transfer::Ended | Transfer::EndedBy(_) => self.0.clear(),
            Transfer::WatchdogExpired { .. } | Transfer::NotRecorded { .. } => {}
        }
    }
}
