//! Which controllers the program has left with motors on. While a transfer runs there is a note, a file whose name has
//! its host, which the program's library removes when its last exchange has switched all outputs off.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io;
use std::mem;
use std::path::{self, Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::Error;
use parking_lot::Mutex;

use crate::stop;

/// The environment variable with the folder of these files.
pub(crate) const VARIABLE: &str = "FT_TXT_TRANSFERS";
/// The file in it of which the library marks a byte as long as its process lives.
const MARK: &str = "mark";
/// The file in it that the library makes when the first transfer begins.
const BEGUN: &str = "begun";
/// In the name of a note the byte of a transfer that has ended without a last exchange, while its process goes on.
const LOST: u32 = u32::MAX;
/// How long the program has to begin the next one with the same controller itself, or to end it when it is suspended.
const OWN_TRY: Duration = Duration::from_millis(500);
/// After how long one that could not be stopped is tried again, while the program runs.
const AGAIN: Duration = Duration::from_secs(1);

/// What the program and its children write down.
pub(crate) struct Online {
    pub(crate) folder: PathBuf,
    #[cfg_attr(not(unix), allow(dead_code, reason = "nobody asks for the mark"))]
    mark: File,
    /// The hosts that are being stopped while the program runs, which is looked at meanwhile.
    stopping: BTreeMap<String, JoinHandle<Result<String, Error>>>,
    /// The hosts that could not be stopped, and when they were tried.
    failed: BTreeMap<String, Instant>,
    /// Since when transfers are left that the program may begin again, or end itself.
    lost: Option<Instant>,
    /// The hosts that the program may use, as far as this process has named them.
    named: BTreeSet<String>,
    /// The hosts and bytes of all notes that were seen since the last stop.
    seen: BTreeSet<(String, u32)>,
    /// Those that say nothing more, and are perhaps still there.
    done_with: BTreeSet<Note>,
    /// The processes whose marks say nothing more.
    given_up: BTreeSet<u32>,
}

/// A transfer that has begun and not ended.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Note {
    path: PathBuf,
    /// The byte that its process marks; 0 if it can't.
    byte: u32,
    host: String,
}

/// Which transfers are left.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum While {
    /// Those that no process has any more.
    Runs,
    /// All: the program was suspended before their last exchange.
    IsSuspended,
    /// The same, when perhaps only what it has made by `fork` still runs.
    Ends,
    /// All.
    HasEnded,
}

impl Online {
    /// For a program to which these hosts are named.
    pub(crate) fn new(folder: &Path, named: BTreeSet<String>) -> io::Result<Self> {
        // The program may change its folder.
        let folder = path::absolute(folder.join("transfers"))?;
        fs::create_dir(&folder)?;
        let mark = File::create_new(folder.join(MARK))?;
        let (stopping, failed) = (BTreeMap::new(), BTreeMap::new());
        let (seen, done_with) = (BTreeSet::new(), BTreeSet::new());
        let given_up = BTreeSet::new();
        Ok(Self { folder, mark, stopping, failed, lost: None, named, seen, done_with, given_up })
    }

    /// Whether somebody has removed what is written down, with the folder or without it.
    pub(crate) fn is_gone(&self) -> bool {
        !self.folder.join(MARK).exists()
    }

    /// Whether the program has begun a transfer.
    pub(crate) fn has_begun(&self) -> bool {
        self.folder.join(BEGUN).exists()
    }

    /// Whether a transfer has begun and not ended, or is not stopped yet.
    pub(crate) fn has_any(&mut self) -> bool {
        !self.failed.is_empty() || !self.stopping.is_empty() || !self.notes().is_empty()
    }

    fn notes(&mut self) -> BTreeSet<Note> {
        let files = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let notes: BTreeSet<_> = files.filter_map(|file| Note::of(file.path())).collect();
        self.done_with.retain(|note| notes.contains(note));
        &notes - &self.done_with
    }

    /// Removes these, without waiting for a disk that may stand still.
    fn remove(&mut self, notes: &BTreeSet<Note>) {
        if notes.is_empty() {
            return;
        }
        self.done_with.extend(notes.iter().cloned());
        let paths: Vec<_> = notes.iter().map(|note| note.path.clone()).collect();
        let remove = move || paths.iter().for_each(|path| _ = fs::remove_file(path));
        // Without a thread they go with the folder.
        let _ = thread::Builder::new().spawn(remove);
    }

    fn left(&mut self, program: While) -> BTreeSet<Note> {
        match program {
            // In this order: the library marks the file first.
            While::Runs | While::Ends => {
                let notes = self.notes();
                split(notes, |byte| self.is_marked(byte)).left
            }
            While::IsSuspended | While::HasEnded => self.notes(),
        }
    }

    /// Whether a transfer to this host is left, or is being stopped.
    pub(crate) fn has_left(&mut self, host: &str, program: While) -> bool {
        let is_left = self.left(program).iter().any(|left| left.host == host);
        is_left || self.stopping.contains_key(host)
    }

    /// Begins to send a last exchange to each controller that was left, and to those again that could not be stopped; the
    /// program goes on.
    pub(crate) fn begin_to_stop(&mut self, program: While) {
        let mut left = self.left(program);
        // What is left of one that is being stopped has its turn then.
        left.retain(|note| !self.stopping.contains_key(&note.host));
        self.remove(&left);
        let mut hosts: BTreeSet<String> = left.into_iter().map(|note| note.host).collect();
        let due = self.failed.iter().filter(|(_, tried)| tried.elapsed() >= AGAIN);
        hosts.extend(due.map(|(host, _)| host.clone()));
        hosts.extend(self.take_those_without_notes());
        for host in hosts {
            if let Entry::Vacant(place) = self.stopping.entry(host) {
                let host = place.key().clone();
                // Without a thread, all of it is tried again.
                match thread::Builder::new().spawn(move || stop::stop(&host)) {
                    Ok(thread) => drop(place.insert(thread)),
                    Err(_) => drop(self.failed.insert(place.into_key(), Instant::now())),
                }
            }
        }
    }

    /// How those were stopped that are done, by their hosts. One that could not be stopped is tried again, and told again
    /// only at the end: what the program has made by `fork` may have ended by then, with which the controller was online.
    pub(crate) fn take_stopped(&mut self) -> Vec<(String, Result<String, Error>)> {
        let is_done = |host: &&String| self.stopping[*host].is_finished();
        let done: Vec<String> = self.stopping.keys().filter(is_done).cloned().collect();
        let mut stopped = Vec::new();
        for host in done {
            let Some(thread) = self.stopping.remove(&host) else { continue };
            let Ok(result) = thread.join() else {
                // A panic has stopped nothing.
                self.failed.insert(host, Instant::now());
                continue;
            };
            // Meanwhile the program may have begun the next transfer, which kept this process out.
            let driven = split(self.notes(), |byte| self.is_marked(byte)).driven;
            if result.is_err() && driven.contains(&host) {
                self.failed.remove(&host);
                continue;
            }
            let before = match result {
                Ok(_) => self.failed.remove(&host),
                Err(_) => self.failed.insert(host.clone(), Instant::now()),
            };
            if result.is_ok() || before.is_none() {
                stopped.push((host, result));
            }
        }
        stopped
    }

    /// Sends a last exchange to each controller that was left, except to this one, and returns how that went, by their
    /// hosts. They are left no more then, but those that could not be stopped are tried again by the next call.
    pub(crate) fn stop_left(
        &mut self,
        but: Option<&str>,
        program: While,
    ) -> Vec<(String, Result<String, Error>)> {
        let left = self.left(program);
        self.remove(&left);
        let mut hosts: BTreeSet<String> = left.into_iter().map(|note| note.host).collect();
        hosts.extend(mem::take(&mut self.failed).into_keys());
        hosts.extend(self.take_those_without_notes());
        let begun = mem::take(&mut self.stopping);
        let begun: BTreeMap<_, _> =
            begun.into_iter().map(|(host, thread)| (host, Mutex::new(Some(thread)))).collect();
        let is_needed = |host: &str| hosts.contains(host);
        let stop = |host: &str| {
            let thread = begun.get(host).and_then(|thread| thread.lock().take());
            match thread.and_then(|thread| thread.join().ok()) {
                Some(Ok(name)) if !is_needed(host) => Ok(name),
                _ if program == While::HasEnded => stop::stop_in_time(host),
                _ => stop::stop(host),
            }
        };
        let all: BTreeSet<&String> = hosts.iter().chain(begun.keys()).collect();
        let all = all.into_iter().filter(|host| Some(host.as_str()) != but).cloned();
        let stopped = side_by_side(all.collect(), stop);
        let failed = stopped.iter().filter(|(_, stopped)| stopped.is_err());
        self.failed.extend(failed.map(|(host, _)| (host.clone(), Instant::now())));
        stopped
    }

    /// Without the notes each controller may be left, once: one that is online with another program takes no exchange.
    fn take_those_without_notes(&mut self) -> BTreeSet<String> {
        let seen = mem::take(&mut self.seen);
        if !self.is_gone() {
            return BTreeSet::new();
        }
        let named = mem::take(&mut self.named);
        seen.into_iter().map(|(host, _)| host).chain(named).collect()
    }

    /// The hosts that could not be stopped.
    pub(crate) fn not_stopped(&self) -> impl Iterator<Item = &String> {
        self.failed.keys()
    }

    /// Whether transfers are left that no process has any more: it has ended, or has become another program. Or that the
    /// program, which is suspended, could not end before. Or whether it is time to try one again.
    pub(crate) fn is_left(&mut self, is_suspended: bool) -> bool {
        let notes = self.notes();
        // Another process may get the number of one that is no more.
        self.given_up.retain(|process| Path::new(&format!("/proc/{process}")).exists());
        let is_gone = !self.seen.is_empty() && self.is_gone();
        let are_lost = is_gone && !self.seen.iter().any(|(_, byte)| self.is_marked(*byte));
        self.remember(&notes);
        let is_driven = |byte| !is_suspended && self.is_marked(byte);
        let Split { left, stood_for, driven } = split(notes, is_driven);
        self.remove(&stood_for);
        self.failed.retain(|host, _| !driven.contains(host));
        let is_time = !is_gone && self.failed.values().any(|tried| tried.elapsed() >= AGAIN);
        let (lost, gone): (Vec<_>, Vec<_>) =
            left.iter().partition(|note| is_suspended || note.byte == LOST);
        self.lost = (!lost.is_empty()).then(|| self.lost.unwrap_or_else(Instant::now));
        let is_over = self.lost.is_some_and(|since| since.elapsed() >= OWN_TRY);
        !gone.is_empty() || is_over || are_lost || is_time
    }

    /// Remembers these. They stand for what processes that are no more have done with the same controllers.
    fn remember(&mut self, notes: &BTreeSet<Note>) {
        let mut seen = mem::take(&mut self.seen);
        let again: BTreeSet<&str> = notes.iter().map(|note| note.host.as_str()).collect();
        seen.retain(|(host, byte)| !again.contains(host.as_str()) || self.is_marked(*byte));
        seen.extend(notes.iter().map(|note| (note.host.clone(), note.byte)));
        self.seen = seen;
    }

    /// The processes that drive, as far as that is known.
    pub(crate) fn drivers(&mut self) -> BTreeSet<u32> {
        #[cfg(unix)]
        {
            let mut bytes: BTreeSet<u32> = self.notes().iter().map(|note| note.byte).collect();
            if self.is_gone() {
                bytes.extend(self.seen.iter().map(|(_, byte)| *byte));
            }
            bytes.into_iter().filter_map(|byte| self.mark_on(byte)?.1).collect()
        }
        #[cfg(not(unix))]
        BTreeSet::new()
    }

    /// This process was killed, and has not ended for the system.
    pub(crate) fn give_up(&mut self, process: u32) {
        self.given_up.insert(process);
    }

    /// Whether a process holds the mark on this byte, or can't hold one.
    #[cfg(unix)]
    fn is_marked(&self, byte: u32) -> bool {
        byte != LOST && (byte == 0 || self.mark_on(byte).is_none_or(|(is_held, _)| is_held))
    }

    /// Whether a process holds the mark on this byte, and which; `None` when that can't be asked.
    #[cfg(unix)]
    fn mark_on(&self, byte: u32) -> Option<(bool, Option<u32>)> {
        use std::os::fd::AsRawFd;
        // SAFETY: integers, for which all bits 0 are valid.
        let mut mark: libc::flock = unsafe { mem::zeroed() };
        mark.l_type = libc::F_WRLCK as _;
        mark.l_start = byte as _;
        mark.l_len = 1;
        // SAFETY: the file is open, and the mark is this function's. It only asks.
        let asked = unsafe { libc::fcntl(self.mark.as_raw_fd(), libc::F_GETLK, &raw mut mark) };
        let is_held = mark.l_type != libc::F_UNLCK as _;
        // In another namespace of processes it is 0.
        let holder = u32::try_from(mark.l_pid).ok().filter(|holder| is_held && *holder > 0);
        let is_given_up = holder.is_some_and(|holder| self.given_up.contains(&holder));
        (asked != -1).then_some(match is_given_up {
            true => (false, None),
            false => (is_held, holder),
        })
    }

    /// Programs do not become others, and this process sees each end.
    #[cfg(not(unix))]
    fn is_marked(&self, byte: u32) -> bool {
        byte != LOST
    }
}

/// Which of the notes are left.
struct Split {
    left: BTreeSet<Note>,
    /// Those of processes that are no more, but another one drives the same controller since: its own note stands for
    /// these, and a last exchange in between would stop what it does.
    stood_for: BTreeSet<Note>,
    /// The hosts of the others.
    driven: BTreeSet<String>,
}

fn split(notes: BTreeSet<Note>, is_marked: impl Fn(u32) -> bool) -> Split {
    let (kept, lost): (BTreeSet<_>, BTreeSet<_>) =
        notes.into_iter().partition(|note| is_marked(note.byte));
    let driven: BTreeSet<String> = kept.into_iter().map(|note| note.host).collect();
    let (stood_for, left) = lost.into_iter().partition(|note| driven.contains(&note.host));
    Split { left, stood_for, driven }
}

impl Note {
    /// By the name of its file; `None` for other files.
    fn of(path: PathBuf) -> Option<Self> {
        let mut parts = path.file_name()?.to_str()?.split('.');
        let (byte, host) = (parts.next()?.parse().ok()?, parts.nth(1)?);
        let letter = |at| u8::from_str_radix(host.get(at..at + 2)?, 16).ok();
        let letters: Option<Vec<u8>> = (0..host.len()).step_by(2).map(letter).collect();
        let host = String::from_utf8(letters?).ok()?;
        Some(Self { path, byte, host })
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

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

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
        let left = |online: &mut Online| {
            online.left(While::HasEnded).into_iter().map(|note| note.host).collect::<Vec<_>>()
        };
        // "auto" and "10.0.0.7:65000", as the library names them.
        let notes = ["7.0.6175746f", "7.1.31302e302e302e373a3635303030"];
        let transfers = online.folder.clone();
        let note = |name| File::create_new(transfers.join(name)).unwrap();
        assert_eq!(left(&mut online), [""; 0]);
        notes.into_iter().for_each(|name| drop(note(name)));
        note("begun");
        assert_eq!(left(&mut online), ["auto", "10.0.0.7:65000"]);
        fs::remove_file(online.folder.join(notes[0])).unwrap();
        assert!(online.stop_left(Some("10.0.0.7:65000"), While::HasEnded).is_empty());
        assert_eq!(left(&mut online), [""; 0]);
    }

    #[test]
    fn transfers_that_have_ended_are_not_remembered() {
        let folder = tempfile::tempdir().unwrap();
        let mut online = Online::new(folder.path(), BTreeSet::new()).unwrap();
        for number in 0..50 {
            // "auto", without a mark.
            let note = online.folder.join(format!("0.{number}.6175746f"));
            File::create_new(&note).unwrap();
            assert!(!online.is_left(false));
            online.done_with.extend(Note::of(note.clone()));
            fs::remove_file(note).unwrap();
        }
        assert!(!online.is_left(false));
        assert_eq!((online.seen.len(), online.done_with.len()), (1, 0));
        // Nor are processes that have ended. Elsewhere none becomes another one.
        for byte in (1..50).filter(|_| cfg!(unix)) {
            let note = online.folder.join(format!("{byte}.0.6175746f"));
            File::create_new(&note).unwrap();
            online.is_left(false);
            fs::remove_file(note).unwrap();
        }
        assert!(online.seen.len() <= 2, "{:?}", online.seen);
    }

    #[test]
    fn a_process_that_has_gone_leaves_what_no_other_one_drives() {
        // Of the processes 1 to 3 only 2 lives, and one has no mark.
        let notes = [(1, "a"), (1, "b"), (2, "b"), (2, "c"), (3, "d"), (0, "e")];
        let note = |(byte, host): (u32, &str)| Note {
            path: format!("{byte}.{host}").into(),
            byte,
            host: host.to_owned(),
        };
        let hosts =
            |notes: BTreeSet<Note>| notes.into_iter().map(|note| note.host).collect::<Vec<_>>();
        let Split { left, stood_for, driven } =
            split(notes.into_iter().map(note).collect(), |byte| byte == 0 || byte == 2);
        assert_eq!(
            (hosts(left), hosts(stood_for)),
            (vec!["a".into(), "d".into()], vec!["b".into()])
        );
        assert_eq!(driven.into_iter().collect::<Vec<_>>(), ["b", "c", "e"]);
    }
}
