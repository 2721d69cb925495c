//! Which controller answers in a recording.

use std::path::Path;
use std::time::Duration;

use ft_transfer_area_recorder::Transfer;

use crate::print;

const UNKNOWN: &str = "unknown";

/// A controller as it was reported. All is empty while none was, name and firmware when the program has not asked.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Controller {
    pub(super) device_name: String,
    pub(super) firmware: String,
    pub(super) address: String,
}

/// Follows the transfers of a recording.
#[derive(Debug, Default)]
pub(super) struct Answering {
    now: Controller,
}

impl Answering {
    /// The controller that answers now.
    pub(super) fn now(&self) -> &Controller {
        &self.now
    }

    /// The controller that answers from this on, if it is the first or another one than before, and that one.
    pub(super) fn take(&mut self, transfer: &Transfer) -> Option<(&Controller, Controller)> {
        let (device_name, firmware, address) = match transfer {
            Transfer::Began { device_name, firmware, address, .. } => {
                (device_name, firmware, address)
            }
            // Older files have no names there, or no address.
            Transfer::Restored { device_name, firmware, address, .. }
                if !(device_name.is_empty() && firmware.is_empty()) =>
            {
                let address = if address.is_empty() { &self.now.address } else { address };
                (device_name, firmware, address)
            }
            _ => return None,
        };
        let [device_name, firmware, address] =
            [device_name, firmware, address].map(String::to_owned);
        let new = Controller { device_name, firmware, address };
        (new != self.now).then(|| {
            let before = std::mem::replace(&mut self.now, new);
            (&self.now, before)
        })
    }
}

/// Notes that not all in a recording is of one controller.
#[derive(Debug, Default)]
pub(super) struct Change {
    answering: Answering,
    /// Where a part begins.
    from: Duration,
    /// The one that answers there, after a change.
    there: Option<String>,
    /// The first change after that.
    first: Option<String>,
}

impl Change {
    /// In a part from here on.
    pub(super) fn from(from: Duration) -> Self {
        Self { from, ..Self::default() }
    }

    pub(super) fn take(&mut self, transfer: &Transfer, at: Duration) {
        let Some((now, before)) = self.answering.take(transfer) else { return };
        if before == Controller::default() {
            return;
        }
        let [now, before] = [now, &before].map(|one| {
            let [name, firmware] = known(&one.device_name, &one.firmware);
            format!("{name} at {}, firmware {firmware}", one.address)
        });
        if at <= self.from {
            self.there = Some(format!("here {now} answers"));
            return;
        }
        let at = at.as_secs_f64();
        self.first.get_or_insert_with(|| format!("from {at:.2} s on {now} in place of {before}"));
    }

    /// Says it on stderr.
    pub(super) fn say(&self, file: &Path) {
        for text in self.there.iter().chain(&self.first) {
            eprintln!("{}", print::clean(&format!("{}: {text}", file.display())));
        }
    }
}

/// Name and firmware, for people.
pub(super) fn known<'a>(device_name: &'a str, firmware: &'a str) -> [&'a str; 2] {
    [device_name, firmware].map(|reported| if reported.is_empty() { UNKNOWN } else { reported })
}
