//! Which controllers the program has left with motors on. While a transfer runs there is a note, a file whose name has
//! its host, which the program's library removes when its last exchange has switched all outputs off.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io;
use std::mem;
use std::path::{self, Path, PathBuf};
use std::thread;

use ft_transfer_area::Error;

use crate::stop;

/// The environment variable with the folder of these files.
pub(crate) const VARIABLE: &str = "FT_TXT_TRANSFERS";
/// The file in it that the library marks as long as its process lives.
const MARK: &str = "mark";
/// The file in it that the library makes when the first transfer begins.
const BEGUN: &str = "begun";

/// What the program and its children write down.
pub(crate) struct Online {
    pub(crate) folder: PathBuf,
    #[cfg_attr(not(unix), allow(dead_code, reason = "nobody asks for the mark"))]
    mark: File,
    /// The hosts that could not be stopped.
    failed: BTreeSet<String>,
    /// The hosts that the program may use, as far as this process has named them.
    named: BTreeSet<String>,
    /// The hosts in all notes that were seen since the last stop.
    seen: BTreeSet<String>,
}

impl Online {
    /// For a program to which these hosts are named.
    pub(crate) fn new(folder: &Path, named: BTreeSet<String>) -> io::Result<Self> {
        // The program may change its folder.
        let folder = path::absolute(folder.join("transfers"))?;
        fs::create_dir(&folder)?;
        let mark = File::create_new(folder.join(MARK))?;
        Ok(Self { folder, mark, failed: BTreeSet::new(), named, seen: BTreeSet::new() })
    }

    /// Whether somebody has removed what is written down, with the folder or without it.
    pub(crate) fn is_gone(&self) -> bool {
        !self.folder.join(MARK).exists()
    }

    /// Whether the program has begun a transfer.
    pub(crate) fn has_begun(&self) -> bool {
        self.folder.join(BEGUN).exists()
    }

    /// The notes of transfers that have begun and not ended, with their hosts.
    fn left(&self) -> BTreeMap<PathBuf, String> {
        let notes = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let notes = notes.map(|note| note.path());
        // Other files have no host.
        notes.filter_map(|note| host_in(&note).map(|host| (note, host))).collect()
    }

    /// Whether a transfer to this host is left.
    pub(crate) fn has_left(&self, host: &str) -> bool {
        self.left().values().any(|left| left == host)
    }

    /// Sends a last exchange to each controller that was left, except to this one, and returns how that went, by their
    /// hosts. They are left no more then. One that could not be stopped is tried again by the next call: what the
    /// program has made by `fork` may have ended by then, with which the controller was online. Without the notes it is
    /// each controller that may be left, once: one that is online with another program takes no exchange.
    pub(crate) fn stop_left(&mut self, but: Option<&str>) -> Vec<(String, Result<(), Error>)> {
        let left = self.left();
        left.keys().for_each(|file| _ = fs::remove_file(file));
        let mut hosts: BTreeSet<String> =
            left.into_values().chain(mem::take(&mut self.failed)).collect();
        let seen = mem::take(&mut self.seen);
        if self.is_gone() {
            hosts.extend(seen);
            hosts.extend(mem::take(&mut self.named));
        }
        let hosts = hosts.into_iter().filter(|host| Some(host.as_str()) != but);
        let stopped = side_by_side(hosts.collect(), stop::stop);
        let failed = stopped.iter().filter(|(_, stopped)| stopped.is_err());
        self.failed.extend(failed.map(|(host, _)| host.clone()));
        stopped
    }

    /// Whether transfers are left that no process has any more: the program has ended, or has become another one.
    #[cfg(unix)]
    pub(crate) fn is_left(&mut self) -> bool {
        let left = self.left();
        let is_any = !left.is_empty() || (!self.seen.is_empty() && self.is_gone());
        self.seen.extend(left.into_values());
        // In this order: the library marks the file first.
        is_any && !self.is_marked()
    }

    /// Programs do not become others.
    #[cfg(not(unix))]
    pub(crate) fn is_left(&mut self) -> bool {
        false
    }

    /// Whether a process holds the library's mark.
    #[cfg(unix)]
    fn is_marked(&self) -> bool {
        use std::os::fd::AsRawFd;
        // SAFETY: integers, for which all bits 0 are valid.
        let mut mark: libc::flock = unsafe { mem::zeroed() };
        mark.l_type = libc::F_WRLCK as _;
        // SAFETY: the file is open, and the mark is this function's. It only asks.
        let asked = unsafe { libc::fcntl(self.mark.as_raw_fd(), libc::F_GETLK, &raw mut mark) };
        asked == -1 || mark.l_type != libc::F_UNLCK as _
    }
}

/// Stops all of these at once: one that does not answer does not keep the others moving.
fn side_by_side<T: Send>(hosts: Vec<String>, stop: impl Fn(&str) -> T + Sync) -> Vec<(String, T)> {
    let stop = &stop;
    thread::scope(|scope| {
        let begin = |host: String| {
            let own = host.clone();
            let begun = thread::Builder::new().spawn_scoped(scope, move || stop(&own));
            // Without a thread for it, it is stopped last.
            (host, begun)
        };
        let begun: Vec<_> = hosts.into_iter().map(begin).collect();
        let end = |(host, begun): (String, io::Result<thread::ScopedJoinHandle<'_, T>>)| {
            let ended = begun.ok().and_then(|thread| thread.join().ok());
            let result = ended.unwrap_or_else(|| stop(&host));
            (host, result)
        };
        begun.into_iter().map(end).collect()
    })
}

/// The host in the name of a note; `None` for other files.
fn host_in(note: &Path) -> Option<String> {
    let host = note.file_name()?.to_str()?.split('.').nth(2)?;
    let byte = |at| u8::from_str_radix(host.get(at..at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..host.len()).step_by(2).map(byte).collect();
    String::from_utf8(bytes?).ok()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn one_controller_that_does_not_answer_does_not_keep_another_one_moving() {
        let begun = AtomicUsize::new(0);
        let deadline = Instant::now() + Duration::from_secs(30);
        let waits_for_the_other = |_: &str| {
            begun.fetch_add(1, Ordering::Relaxed);
            while begun.load(Ordering::Relaxed) < 2 && Instant::now() < deadline {
                thread::sleep(Duration::from_millis(1));
            }
            Instant::now() < deadline
        };
        let hosts = ["10.0.0.7", "10.0.0.8"].map(str::to_owned).to_vec();
        let stopped = side_by_side(hosts.clone(), waits_for_the_other);
        assert_eq!(stopped, hosts.into_iter().map(|host| (host, true)).collect::<Vec<_>>());
    }

    #[test]
    fn what_has_begun_and_not_ended_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let mut online = Online::new(folder.path(), BTreeSet::new()).unwrap();
        let left = |online: &Online| online.left().into_values().collect::<Vec<_>>();
        // "auto" and "10.0.0.7:65000", as the library names them.
        let notes = ["7.0.6175746f", "7.1.31302e302e302e373a3635303030"];
        let note = |name| File::create_new(online.folder.join(name)).unwrap();
        assert_eq!(left(&online), [""; 0]);
        notes.into_iter().for_each(|name| drop(note(name)));
        note("begun");
        assert_eq!(left(&online), ["auto", "10.0.0.7:65000"]);
        fs::remove_file(online.folder.join(notes[0])).unwrap();
        assert!(online.stop_left(Some("10.0.0.7:65000")).is_empty());
        assert_eq!(left(&online), [""; 0]);
    }
}
