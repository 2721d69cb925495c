//! What is missing in a recording, and what has to be guessed then.

use std::fmt::Display;
use std::path::Path;

use ft_transfer_area_recorder::Recording;

use crate::print;

/// Says on stderr why a recording that was read to its end is not whole. The last words say what was done with the
/// rest of one that is cut off.
pub(super) fn say_what_is_missing(recording: &Recording, path: &Path, rest: &str) {
    if let Some(damage) = recording.damage() {
        say_what_is_damaged(damage, path);
    }
    if recording.is_cut_off() {
        eprintln!("{} is cut off{rest}", path.display());
    }
}

/// Says on stderr what is left out.
pub(super) fn say_what_is_damaged(damage: impl Display, path: &Path) {
    eprintln!("{}", print::clean(&format!("{}: {damage}", path.display())));
}

/// Counts transfers, also those whose beginning is missing.
#[derive(Debug, Default)]
pub(super) struct Transfers {
    pub(super) count: u64,
    /// The number of the last cycle of this transfer.
    last: Option<u64>,
    /// Whether something is missing since the last cycle.
    is_missing: bool,
}

impl Transfers {
    pub(super) fn begin(&mut self) {
        self.count += 1;
        self.last = None;
        self.is_missing = false;
    }

    pub(super) fn miss(&mut self) {
        self.is_missing = true;
    }

    /// Takes a cycle in. Numbers rise within a transfer.
    pub(super) fn cycle(&mut self, number: u64) {
        let is_missing = std::mem::take(&mut self.is_missing);
        let is_later = self.last.map_or(self.count > 0, |last| last < number);
        if is_missing && !is_later {
            self.count += 1;
        }
        self.last = Some(number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transfer_whose_beginning_is_missing_counts() {
        let mut transfers = Transfers::default();
        transfers.miss();
        transfers.cycle(7);
        transfers.cycle(8);
        assert_eq!(transfers.count, 1);
        transfers.miss();
        transfers.cycle(20);
        assert_eq!(transfers.count, 1, "it goes on");
        transfers.miss();
        transfers.cycle(3);
        assert_eq!(transfers.count, 2, "it is another one");
        transfers.begin();
        transfers.miss();
        transfers.cycle(5);
        assert_eq!(transfers.count, 3, "its beginning is there");
        // A recording that was started during a transfer has none that began.
        let mut running = Transfers::default();
        running.cycle(100);
        assert_eq!(running.count, 0);
    }
}
