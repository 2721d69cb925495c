//! Processes that take too long to end while a transfer has not ended. Only Linux shows them.
//!
//! A process is there, with its connection, until its memory image (`core`) is written, and one that was killed until a
//! disk has done what its threads wait for.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::time::{Duration, Instant};

/// How long it may take.
const LIMIT: Duration = Duration::from_millis(500);
/// How often to look.
const LOOK: Duration = Duration::from_millis(100);

/// What a process does that has not ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Doing {
    WritesImage,
    /// It runs no instruction of its own any more.
    WaitsForSystem,
}

/// What was seen of them.
#[derive(Default)]
pub(crate) struct Endings {
    since: BTreeMap<(u32, Doing), Instant>,
    looked: Option<Instant>,
}

impl Endings {
    /// Those of these processes that have taken too long.
    pub(crate) fn take_long(
        &mut self,
        processes: impl FnOnce() -> BTreeSet<u32>,
    ) -> Vec<(u32, Doing)> {
        if self.looked.is_some_and(|looked| looked.elapsed() < LOOK) {
            return Vec::new();
        }
        self.looked = Some(Instant::now());
        let ending = processes().into_iter().filter_map(|it| Some((it, doing(&threads_of(it))?)));
        self.are_over(ending.collect(), Instant::now())
    }

    fn are_over(&mut self, ending: BTreeSet<(u32, Doing)>, now: Instant) -> Vec<(u32, Doing)> {
        self.since.retain(|process, _| ending.contains(process));
        for process in ending {
            self.since.entry(process).or_insert(now);
        }
        let is_over = |since: &Instant| now.saturating_duration_since(*since) >= LIMIT;
        self.since.iter().filter(|(_, since)| is_over(since)).map(|(process, _)| *process).collect()
    }
}

/// Ends a process at once that writes its memory image.
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

/// A thread, as the system shows it.
#[derive(Clone, Debug, Default)]
struct Thread {
    writes_image: bool,
    has_ended: bool,
    /// It was killed, or is in the middle of its end.
    ends: bool,
}

impl Thread {
    /// By the texts `status` and `stat`.
    fn read(status: &str, stat: &str) -> Self {
        const SIGKILL: u64 = 1 << 8;
        const PF_EXITING: u64 = 4;
        let field = |name: &str| status.lines().find_map(|line| line.strip_prefix(name));
        let waiting = ["SigPnd:", "ShdPnd:"].map(|name| field(name).unwrap_or_default().trim());
        let is_killed = waiting
            .iter()
            .any(|set| u64::from_str_radix(set, 16).is_ok_and(|set| set & SIGKILL != 0));
        // The name, in brackets, may have spaces. What follows begins with the state.
        let behind_name = stat.rsplit_once(')').map_or("", |(_, rest)| rest);
        let flags = behind_name.split_ascii_whitespace().nth(6).and_then(|it| it.parse().ok());
        let is_exiting = flags.is_some_and(|flags: u64| flags & PF_EXITING != 0);
        Self {
            writes_image: field("CoreDumping:").is_some_and(|it| it.trim() == "1"),
            has_ended: field("State:").is_some_and(|it| it.trim().starts_with(['Z', 'X'])),
            ends: is_killed || is_exiting,
        }
    }
}

fn threads_of(process: u32) -> Vec<Thread> {
    let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let read = |thread: fs::DirEntry| {
        // The thread's name is in them, perhaps cut within a letter.
        let text = |name| fs::read(thread.path().join(name)).ok();
        let [status, stat] = [text("status")?, text("stat")?];
        Some(Thread::read(&String::from_utf8_lossy(&status), &String::from_utf8_lossy(&stat)))
    };
    threads.filter_map(read).collect()
}

/// What a process with these threads does before it has ended; `None` for one that goes on.
fn doing(threads: &[Thread]) -> Option<Doing> {
    // Any thread shows it, but not the first one if that has ended.
    if threads.iter().any(|thread| thread.writes_image) {
        return Some(Doing::WritesImage);
    }
    let is_last = |thread: &Thread| thread.ends && !thread.has_ended;
    let all_end = threads.iter().all(|thread| thread.ends || thread.has_ended);
    (all_end && threads.iter().any(is_last)).then_some(Doing::WaitsForSystem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_takes_long_is_over() {
        let (mut endings, begin) = (Endings::default(), Instant::now());
        let mut at = |millis, dumping: &[u32]| {
            let ending = dumping.iter().map(|process| (*process, Doing::WritesImage));
            let over = endings.are_over(ending.collect(), begin + Duration::from_millis(millis));
            over.into_iter().map(|(process, _)| process).collect::<Vec<_>>()
        };
        assert!(at(0, &[]).is_empty() && at(1000, &[7]).is_empty() && at(1400, &[7, 8]).is_empty());
        assert_eq!(at(1500, &[7, 8]), [7]);
        assert_eq!(at(1900, &[8]), [8]);
        assert!(at(2000, &[7]).is_empty(), "another process");
    }

    #[test]
    fn a_process_ends_when_each_of_its_threads_does() {
        let thread = |state: char, pending: u64, flags: u64, image: char| {
            let status = format!("Name:\ta\nState:\t{state} (so)\nSigPnd:\t{pending:016x}\nShdPnd:\t0000000000000000\nCoreDumping:\t{image}\n");
            let stat = format!("7 (a) b) {state} 1 2 3 4 5 {flags} 8\n");
            Thread::read(&status, &stat)
        };
        let ended = thread('Z', 0, 0x40_004C, '0');
        let is_killed = thread('D', 0x100, 0x40_0040, '0');
        let is_exiting = thread('S', 0, 0x40_004C, '0');
        let goes_on = thread('D', 0, 0x40_0040, '0');
        for last in [&is_killed, &is_exiting] {
            assert_eq!(doing(std::slice::from_ref(last)), Some(Doing::WaitsForSystem));
            assert_eq!(doing(&[ended.clone(), last.clone()]), Some(Doing::WaitsForSystem));
            assert_eq!(doing(&[last.clone(), goes_on.clone()]), None);
        }
        // The first thread may end before the others.
        assert_eq!(doing(&[ended.clone(), goes_on]), None);
        assert_eq!(doing(&[ended]), None);
        assert_eq!(doing(&[thread('D', 0x100, 0x40_0040, '1')]), Some(Doing::WritesImage));
        assert_eq!(doing(&[]), None);
        assert_eq!(doing(&threads_of(std::process::id())), None);
    }
}
