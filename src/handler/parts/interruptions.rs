//! What has stopped the outputs without the program, and which handle knows of it.

use std::collections::VecDeque;

use crate::error::Error;

/// How many are kept for a handle that has not asked for a long time.
const KEPT: usize = 16;

/// Counts what has set the outputs to 0: the end of a transfer, a lost connection, the watchdog.
///
/// Each handle stores how many it knows of. Those that do not end the transfer are reported by an
/// error, once to each handle.
#[derive(Debug, Default)]
pub(crate) struct Interruptions {
    count: u64,
    /// By number, the error that reports it.
    unreported: VecDeque<(u64, Error)>,
}

impl Interruptions {
    /// How many there were so far.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// The outputs were stopped in a transfer that goes on.
    pub(crate) fn note(&mut self, error: Error) {
        self.count += 1;
        if self.unreported.len() == KEPT {
            self.unreported.pop_front();
        }
        self.unreported.push_back((self.count, error));
    }

    /// A transfer ends. Its own error reports this.
    pub(crate) fn note_end(&mut self) {
        self.count += 1;
        self.unreported.clear();
    }

    /// The next error for a handle that knows of the first `known` interruptions, with the number of those that it knows
    /// of then.
    pub(crate) fn next_after(&self, known: u64) -> Option<(u64, Error)> {
        self.unreported.iter().find(|(number, _)| *number > known).cloned()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn expired(seconds: u64) -> Error {
        Error::WatchdogExpired { limit: Duration::from_secs(seconds) }
    }

    #[test]
    fn each_handle_is_told_of_each_once_in_order() {
        let mut interruptions = Interruptions::default();
        assert_eq!(interruptions.next_after(0), None);
        interruptions.note(expired(1));
        interruptions.note(expired(2));
        assert_eq!(interruptions.next_after(0), Some((1, expired(1))));
        assert_eq!(interruptions.next_after(1), Some((2, expired(2))));
        assert_eq!(interruptions.next_after(2), None);
    }

    #[test]
    fn an_end_leaves_nothing_to_tell_but_counts() {
        let mut interruptions = Interruptions::default();
        interruptions.note(expired(1));
        interruptions.note_end();
        assert_eq!((interruptions.count(), interruptions.next_after(0)), (2, None));
    }

    #[test]
    fn the_newest_are_kept_for_a_handle_that_does_not_ask() {
        let mut interruptions = Interruptions::default();
        (1..=100).for_each(|number| interruptions.note(expired(number)));
        assert_eq!(interruptions.next_after(0), Some((85, expired(85))));
    }
}
