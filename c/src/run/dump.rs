//! The memory image of a process that has crashed (`core`). Only Linux shows that it is being written.
//!
//! Until it is written the process is there with its connection, so nobody else can stop the controller.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::time::{Duration, Instant};

/// How long it may take while a transfer has not ended.
const LIMIT: Duration = Duration::from_millis(500);
/// How often to look.
const LOOK: Duration = Duration::from_millis(100);

/// What was seen of them.
#[derive(Default)]
pub(crate) struct Dumps {
    since: BTreeMap<u32, Instant>,
    looked: Option<Instant>,
}

impl Dumps {
    /// Those of these processes that have written their memory image for too long.
    pub(crate) fn take_long(&mut self, processes: impl FnOnce() -> BTreeSet<u32>) -> Vec<u32> {
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK) {
            return Vec::new();
        }
        self.looked = Some(Instant::now());
        let dumping = processes().into_iter().filter(|process| is_dumping(*process));
        self.are_over(dumping.collect(), Instant::now())
    }

    fn are_over(&mut self, dumping: BTreeSet<u32>, now: Instant) -> Vec<u32> {
        self.since.retain(|process, _| dumping.contains(process));
        for process in dumping {
            self.since.entry(process).or_insert(now);
        }
        let is_over = |since: &Instant| now.saturating_duration_since(*since) >= LIMIT;
        self.since.iter().filter(|(_, since)| is_over(since)).map(|(process, _)| *process).collect()
    }
}

/// Ends such a process at once.
pub(crate) fn cut_off(process: u32) {
    #[cfg(target_os = "linux")]
    // SAFETY: a call without pointers. The process is there as long as its image is not written, and if it has just ended,
    // its number is not given to another one so soon.
    unsafe {
        libc::kill(process as libc::pid_t, libc::SIGKILL);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = process;
}

/// Any thread shows it, but not the first one if that has ended.
fn is_dumping(process: u32) -> bool {
    let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let statuses =
        threads.filter_map(|thread| fs::read_to_string(thread.path().join("status")).ok());
    let shown = statuses.filter_map(|status| {
        status.lines().find_map(|line| Some(line.strip_prefix("CoreDumping:")?.trim() == "1"))
    });
    shown.take(1).any(|is_dumping| is_dumping)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_memory_image_that_takes_long_is_cut_off() {
        let (mut dumps, begin) = (Dumps::default(), Instant::now());
        let mut at = |millis, dumping: &[u32]| {
            dumps.are_over(dumping.iter().copied().collect(), begin + Duration::from_millis(millis))
        };
        assert!(at(0, &[]).is_empty() && at(1000, &[7]).is_empty() && at(1400, &[7, 8]).is_empty());
        assert_eq!(at(1500, &[7, 8]), [7]);
        assert_eq!(at(1900, &[8]), [8]);
        assert!(at(2000, &[7]).is_empty(), "another process");
    }

    #[test]
    fn a_process_that_goes_on_writes_none() {
        assert!(!is_dumping(std::process::id()));
    }
}
