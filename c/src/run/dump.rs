//! The memory image of a program that has crashed (`core`). Only Linux shows that it is being written.
//!
//! Until it is written the process is there with its connection, so nobody else can stop the controller.

use std::fs;
use std::time::{Duration, Instant};

/// How long it may take while a transfer has not ended.
const LIMIT: Duration = Duration::from_millis(500);
/// How often to look.
const LOOK: Duration = Duration::from_millis(100);

/// What was seen of it.
#[derive(Default)]
pub(crate) struct Dump {
    since: Option<Instant>,
    looked: Option<Instant>,
}

impl Dump {
    /// Whether this process has written its memory image for too long.
    pub(crate) fn takes_long(&mut self, process: u32) -> bool {
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK) {
            return false;
        }
        self.looked = Some(Instant::now());
        let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
        self.is_over(status.lines().any(|line| line == "CoreDumping:\t1"), Instant::now())
    }

    fn is_over(&mut self, is_dumping: bool, now: Instant) -> bool {
        self.since = is_dumping.then(|| self.since.unwrap_or(now));
        self.since.is_some_and(|since| now.saturating_duration_since(since) >= LIMIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_memory_image_that_takes_long_is_cut_off() {
        let (mut dump, begin) = (Dump::default(), Instant::now());
        let mut at =
            |millis, is_dumping| dump.is_over(is_dumping, begin + Duration::from_millis(millis));
        assert!(!at(0, false) && !at(1000, true) && !at(1400, true) && at(1500, true));
        assert!(!at(1600, false), "another program");
        assert!(!at(1700, true));
    }

    #[test]
    fn a_process_that_goes_on_writes_none() {
        assert!(!Dump::default().takes_long(std::process::id()));
    }
}
