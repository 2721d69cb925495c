//! Tells `tx_run` which controllers may have motors on: a note, a file whose name has the controller's host, is there
//! from the begin of a transfer until its last exchange has switched all outputs off. For one that is left `tx_run`
//! sends that exchange.

use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::mem;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{self, SyncSender};
use std::time::{Duration, SystemTime};

use parking_lot::Mutex;

use crate::{host, report};

/// The environment variable with the folder.
const VARIABLE: &str = "FT_TXT_TRANSFERS";
/// The file in it of which each process that has begun a transfer marks a byte.
const MARK: &str = "mark";
/// The empty file in it that stays when the first transfer has begun.
const BEGUN: &str = "begun";

/// How long a program waits until a note is changed: a disk may stand still, and the program has other motors to stop.
const CHANGE_LIMIT: Duration = Duration::from_millis(300);

/// Whether `tx_run` has started the program. Then `FT_TXT_HOST` is the controller that it has said.
pub(crate) fn is_of_tx_run() -> bool {
    host::variable_as_it_is(VARIABLE).is_some()
}

/// The mark of this process.
static MARKED: Mutex<Option<Mark>> = Mutex::new(None);

/// Transfers that are gone without a last exchange.
static LEFT: Mutex<Vec<Note>> = Mutex::new(Vec::new());

/// In the name of a note the byte of a transfer that has ended without a last exchange, while its process goes on.
const LOST: u32 = u32::MAX;

/// How many changes of notes wait for a disk that stands still.
#[cfg(unix)]
const CHANGES: usize = 64;

/// A note that is to be removed, or gets this other name, and who waits for that.
type Change = (PathBuf, Option<PathBuf>, SyncSender<()>);

/// What changes notes, and the process that has its thread.
static CHANGER: Mutex<Option<(u32, &'static SyncSender<Change>)>> = Mutex::new(None);

/// A transfer whose motors may be on.
pub(crate) struct Online {
    note: Option<Note>,
    is_over: AtomicBool,
}

/// What says so in the folder.
struct Note {
    path: PathBuf,
    host: String,
    /// Which process has made it.
    process: u32,
}

impl Online {
    /// The transfer with the controller at this address has begun. Before the program's outputs are sent. The name may
    /// lead nowhere, or to another one, when `tx_run` has to stop it.
    pub(crate) fn begin(address: Option<SocketAddr>, host: &str) -> Self {
        let host = address.map_or_else(|| host.to_owned(), |address| address.to_string());
        let folder = host::variable_as_it_is(VARIABLE).map(PathBuf::from);
        Self::with_folder(folder.as_deref(), &host)
    }

    fn with_folder(folder: Option<&Path>, host: &str) -> Self {
        let note = folder.and_then(|folder| match Note::new(folder, host) {
            Ok(note) => Some(note),
            Err(error) => {
                report::warning(format_args!(
                    "{host}: tx_run can't stop the motors if this program is killed: {error:#}"
                ));
                None
            }
        });
        if let Some(note) = &note {
            note.stand_for_left();
        }
        Self { note, is_over: AtomicBool::new(false) }
    }

    /// All outputs are off. Needs no memory but the library's own.
    pub(crate) fn end(&self) {
        if self.is_over.swap(true, Ordering::AcqRel) {
            return;
        }
        if let Some(note) = &self.note {
            note.remove();
            note.stand_for_left();
        }
    }
}

impl Drop for Online {
    fn drop(&mut self) {
        let left = self.note.take().filter(|_| !self.is_over.load(Ordering::Acquire));
        LEFT.lock().extend(left.map(Note::lost));
    }
}

impl Note {
    fn new(folder: &Path, host: &str) -> io::Result<Self> {
        let begun = folder.join(BEGUN);
        let process = process::id();
        #[cfg(unix)]
        start_changer(process);
        let noted = mark(process, &folder.join(MARK)).and_then(|mark| {
            File::create(&begun)?;
            Self::write(folder, host, process, mark)
        });
        if noted.is_err() {
            // That no transfer is noted means nothing from now on.
            let _ = fs::remove_file(begun);
        }
        noted
    }

    fn write(folder: &Path, host: &str, process: u32, mark: u32) -> io::Result<Self> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(name_of(mark, number, host));
        File::create_new(&path)?;
        Ok(Self { path, host: host.to_owned(), process })
    }

    /// The program may go on for long: `tx_run` need not wait for its end.
    fn lost(mut self) -> Self {
        // A child after `fork` has only a copy, and the transfer goes on.
        if self.process == process::id() {
            let name = self.path.file_name().and_then(|name| name.to_str()?.split_once('.'));
            if let Some((_, rest)) = name {
                let lost = self.path.with_file_name(format!("{LOST}.{rest}"));
                self.change(Some(lost.clone()));
                self.path = lost;
            }
        }
        self
    }

    fn remove(&self) {
        self.change(None);
    }

    /// Gives it another name, or removes it.
    fn change(&self, to: Option<PathBuf>) {
        let changer = CHANGER.lock().filter(|(process, _)| *process == process::id());
        let Some((_, sender)) = changer else {
            change(&self.path, to.as_deref());
            return;
        };
        let (done, is_done) = mpsc::sync_channel(1);
        // Without room for it, `tx_run` removes it at the end.
        if sender.try_send((self.path.clone(), to, done)).is_ok() {
            let _ = is_done.recv_timeout(CHANGE_LIMIT);
        }
    }

    /// Removes the notes of earlier transfers of this process with the same controller: one is enough to stop it, and
    /// none is needed when the last exchange of this one has done so.
    fn stand_for_left(&self) {
        LEFT.lock().retain(|left| {
            let is_same = left.host == self.host && left.process == self.process;
            if is_same {
                left.remove();
            }
            !is_same
        });
    }
}

/// `tx_run` may have removed it already.
fn change(path: &Path, to: Option<&Path>) {
    let _ = match to {
        Some(to) => fs::rename(path, to),
        None => fs::remove_file(path),
    };
}

/// Starts the thread that changes notes, unless this process has it: a handler that ends a transfer can't start one.
#[cfg(unix)]
fn start_changer(process: u32) {
    let mut changer = CHANGER.lock();
    if changer.is_some_and(|(of, _)| of == process) {
        return;
    }
    #[cfg(not(any(miri, asan)))]
    crate::allocator::survive_forks();
    // The thread holds signals back, too.
    let _inside = crate::inside::enter();
    let (sender, changes) = mpsc::sync_channel::<Change>(CHANGES);
    let change_all = move || {
        for (path, to, done) in changes {
            change(&path, to.as_deref());
            // Perhaps nobody waits any more.
            let _ = done.send(());
        }
    };
    // Without a thread, whoever ends a transfer does it. What was there before belongs to a parent.
    let started = std::thread::Builder::new().name("ft/notes".into()).spawn(change_all);
    *changer = started.ok().map(|_| (process, &*Box::leak(Box::new(sender))));
}

/// The name of a note, which has the host within it: it is there as a whole or not at all, needs no room on a disk that
/// is full, and no links, which some file systems do not have.
fn name_of(mark: u32, number: u32, host: &str) -> String {
    let host: String = host.bytes().map(|byte| format!("{byte:02x}")).collect();
    format!("{mark}.{number}.{host}")
}

/// By its mark `tx_run` sees that a process lives.
struct Mark {
    /// The process that has opened the file: a child after `fork` opens it anew.
    process: u32,
    /// The byte, by which the notes are called; 0 where the file system has no marks, so that nobody asks for one.
    byte: u32,
    file: File,
    /// Where the file is.
    place: Place,
}

impl Mark {
    fn is_there(&self) -> bool {
        place_of(&self.file) == self.place
    }
}

/// The numbers of a file system and of a file in it.
type Place = Option<(u64, u64)>;

#[cfg(unix)]
fn place_of(file: &File) -> Place {
    use std::os::unix::fs::MetadataExt;
    file.metadata().ok().map(|it| (it.dev(), it.ino()))
}

/// Programs do not know the handles of others.
#[cfg(not(unix))]
fn place_of(_: &File) -> Place {
    None
}

/// Holds a mark, if this process does not hold it yet. Returns its byte.
fn mark(process: u32, path: &Path) -> io::Result<u32> {
    let mut marked = MARKED.lock();
    if let Some(mark) = marked.take() {
        if !mark.is_there() {
            // The program has closed it, with all that it found. Its number may be that of another file by now.
            mem::forget(mark);
        } else if mark.process == process {
            return Ok(marked.insert(mark).byte);
        }
        // Whatever closes the file in this process takes its marks away, so that of the parent is closed first.
    }
    let opened = File::open(path)?;
    // Not in the place of an input or output that the program has closed.
    let file = opened.try_clone()?;
    drop(opened);
    let byte = new_byte(process);
    let held = hold_mark(&file, byte).inspect_err(|error| {
        report::warning(format_args!(
            "tx_run stops what a process of this program leaves only at the end of the whole program: {error:#}"
        ));
    });
    let byte = held.map_or(0, |()| byte);
    let place = place_of(&file);
    *marked = Some(Mark { process, byte, file, place });
    Ok(byte)
}

/// One that no other process has, nor one with the same number earlier, nor the program that has become this one.
fn new_byte(process: u32) -> u32 {
    let mut hasher = DefaultHasher::new();
    (process, SystemTime::now()).hash(&mut hasher);
    // Offsets have 31 bits on some systems.
    ((hasher.finish() >> 33) as u32).max(1)
}

/// Holds a mark that goes when this process ends or becomes another program.
#[cfg(unix)]
fn hold_mark(file: &File, byte: u32) -> io::Result<()> {
    use std::os::fd::AsRawFd;
    // SAFETY: integers, for which all bits 0 are valid.
    let mut mark: libc::flock = unsafe { mem::zeroed() };
    mark.l_type = libc::F_RDLCK as _;
    mark.l_start = byte as _;
    mark.l_len = 1;
    // SAFETY: the file is open, and the mark is this function's. Nobody else has one that excludes it.
    match unsafe { libc::fcntl(file.as_raw_fd(), libc::F_SETLK, &raw const mark) } {
        -1 => Err(io::Error::last_os_error()),
        _ => Ok(()),
    }
}

/// Programs do not become others, and `tx_run` sees each end.
#[cfg(not(unix))]
fn hold_mark(_: &File, _: u32) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_controller_that_is_left_again_and_again_has_one_note() {
        let folder = tempfile::tempdir().unwrap();
        File::create_new(folder.path().join(MARK)).unwrap();
        let begin = |host| Online::with_folder(Some(folder.path()), host);
        // Beside the mark and the file that says that there was a transfer.
        let noted = || fs::read_dir(folder.path()).unwrap().count() - 2;
        for _ in 0..3 {
            drop(begin("a"));
            assert_eq!(noted(), 1);
        }
        let other = begin("b");
        assert_eq!(noted(), 2);
        begin("a").end();
        assert_eq!(noted(), 1);
        other.end();
        assert_eq!(noted(), 0);
    }

    /// What was begun before is no sign that a transfer without a note has ended.
    #[test]
    fn what_can_not_be_noted_has_not_begun_for_tx_run() {
        let folder = tempfile::tempdir().unwrap();
        File::create_new(folder.path().join(MARK)).unwrap();
        let begin = |host: &str| Online::with_folder(Some(folder.path()), host);
        let has_begun = || folder.path().join(BEGUN).exists();
        begin("e").end();
        assert!(has_begun());
        // No system has such long names.
        let lost = begin(&"e".repeat(300));
        assert!(lost.note.is_none() && !has_begun());
    }

    #[test]
    fn a_transfer_that_ends_well_stands_for_one_that_was_lost() {
        let folder = tempfile::tempdir().unwrap();
        File::create_new(folder.path().join(MARK)).unwrap();
        let begin = |host| Online::with_folder(Some(folder.path()), host);
        let (lost, other) = (begin("c"), begin("d"));
        let next = begin("c");
        // As a session does when the next transfer takes its place.
        drop(lost);
        next.end();
        let noted = || fs::read_dir(folder.path()).unwrap().count() - 2;
        assert_eq!(noted(), 1);
        other.end();
        assert_eq!(noted(), 0);
    }
}
