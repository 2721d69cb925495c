//! The folder in which a program is compiled. It goes with this process; what one that was killed has left, the next one
//! removes.

use std::io::{self, ErrorKind};
use std::path::Path;
use std::{env, fs};

use tempfile::TempDir;

use crate::Sentence;

const PREFIX: &str = "tx_run";
/// How many letters and digits follow.
const RANDOM: usize = 6;

pub(crate) struct BuildFolder {
    folder: TempDir,
    #[cfg(unix)]
    _locks: [std::fs::File; 2],
}

impl BuildFolder {
    pub(crate) fn new() -> Result<Self, Sentence> {
        Self::make().map_err(|error| {
            let folder = env::temp_dir();
            format!("no folder can be made in {}: {error}{}", folder.display(), remedy()).into()
        })
    }

    fn make() -> io::Result<Self> {
        #[cfg(unix)]
        unix::remove_left(&env::temp_dir());
        let folder = tempfile::Builder::new().prefix(PREFIX).rand_bytes(RANDOM).tempdir()?;
        Ok(Self {
            #[cfg(unix)]
            _locks: unix::lock(folder.path())?,
            folder,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// The error, with the place where room is missing if that is why: compilers say it of their own files only.
    pub(crate) fn with_its_fault(&self, error: Sentence) -> Sentence {
        match self.fault() {
            Some(fault) => {
                let folder = env::temp_dir();
                format!("{error:#}; {} has no room left: {fault}{}", folder.display(), remedy())
                    .into()
            }
            None => error,
        }
    }

    /// Why nothing more can be written here.
    fn fault(&self) -> Option<io::Error> {
        /// Less than what any source is compiled to.
        static ROOM: [u8; 64 << 10] = [0; 64 << 10];
        let path = self.path().join("room");
        let written = fs::write(&path, ROOM);
        // It goes with the folder.
        let _ = fs::remove_file(path);
        let is_full = |error: &io::Error| {
            matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
        };
        written.err().filter(is_full)
    }
}

/// What helps where no room is.
fn remedy() -> &'static str {
    if cfg!(windows) {
        "; make room, or name another folder in the variable TMP"
    } else {
        "; make room, or name another folder in the variable TMPDIR"
    }
}

#[cfg(unix)]
mod unix {
    use std::fs::{self, DirEntry, File};
    use std::io::{self, Read, Write};
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::MetadataExt;
    use std::path::Path;
    use std::time::Duration;

    use super::{PREFIX, RANDOM};

    /// A file that is locked as long as the process lives that compiles in its folder.
    const LOCK: &str = "lock";
    /// What it is called until it is whole.
    const NEW: &str = "new";
    /// How long that takes at most.
    const MADE: Duration = Duration::from_secs(60);
    /// What is in it. A folder of somebody else may have a file with this name, too.
    const TEXT: &str = "tx_run compiles a program here\n";

    pub(super) fn lock(folder: &Path) -> io::Result<[File; 2]> {
        // What removes old files, such as systemd-tmpfiles, leaves a locked folder alone: a program may run for weeks.
        let whole = File::open(folder)?;
        let new = folder.join(NEW);
        let mut lock = File::create(&new)?;
        // A system of files without locks does not matter. Nobody sees it unlocked.
        take(&whole);
        take(&lock);
        lock.write_all(TEXT.as_bytes())?;
        fs::rename(new, folder.join(LOCK))?;
        Ok([whole, lock])
    }

    /// Locks a file, unless another process has. Whether it has worked.
    pub(super) fn take(file: &File) -> bool {
        // SAFETY: a call without pointers, and the file is open.
        unsafe { libc::flock(file.as_raw_fd(), libc::LOCK_EX | libc::LOCK_NB) == 0 }
    }

    /// Removes what others of this user have left in this folder. Nothing depends on it, so errors do not matter.
    pub(super) fn remove_left(place: &Path) {
        // SAFETY: a call without pointers.
        let own = unsafe { libc::geteuid() };
        let Ok(entries) = fs::read_dir(place) else { return };
        for entry in entries.flatten() {
            // Of the entry itself, not of what a link leads to.
            let is_own = is_name(entry.file_name().as_encoded_bytes())
                && entry.metadata().is_ok_and(|it| it.is_dir() && it.uid() == own);
            if !is_own {
                continue;
            }
            match lock_in(&entry.path()) {
                Some(lock) if take(&lock) => remove_but_lock(&entry.path()),
                Some(_) => continue,
                None if is_old(&entry) => {}
                None => continue,
            }
            remove_empty(&entry.path());
        }
    }

    /// The lock goes last: who is killed meanwhile leaves a folder that is known.
    fn remove_but_lock(folder: &Path) {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry.file_name() == LOCK {
                continue;
            }
            let is_folder = entry.file_type().is_ok_and(|it| it.is_dir());
            let _ = match is_folder {
                true => fs::remove_dir_all(entry.path()),
                false => fs::remove_file(entry.path()),
            };
        }
        let _ = fs::remove_file(folder.join(LOCK));
    }

    /// Removes a folder with nothing in it, or nothing but a lock that was never there whole.
    fn remove_empty(folder: &Path) {
        let new = folder.join(NEW);
        let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|it| it.file_name());
        let is_alone = names.map(|name| name == NEW).collect::<Vec<_>>() == [true];
        let is_small = fs::symlink_metadata(&new)
            .is_ok_and(|it| it.is_file() && it.len() <= TEXT.len() as u64);
        if is_alone && is_small {
            let _ = fs::remove_file(new);
        }
        let _ = fs::remove_dir(folder);
    }

    /// Whether nobody can be making it just now.
    fn is_old(folder: &DirEntry) -> bool {
        let changed = folder.metadata().and_then(|it| it.modified()).ok();
        let age = changed.and_then(|changed| changed.elapsed().ok());
        age.is_some_and(|age| age >= MADE)
    }

    /// Whether a folder of `tx_run` may have this name.
    fn is_name(name: &[u8]) -> bool {
        let random = name.strip_prefix(PREFIX.as_bytes()).unwrap_or_default();
        random.len() == RANDOM && random.iter().all(u8::is_ascii_alphanumeric)
    }

    /// The file that is locked, if `tx_run` has written it. Opening a pipe would wait.
    fn lock_in(folder: &Path) -> Option<File> {
        let path = folder.join(LOCK);
        fs::symlink_metadata(&path).ok().filter(|it| it.is_file())?;
        let (lock, mut text) = (File::open(path).ok()?, String::new());
        (&lock).take(TEXT.len() as u64 + 1).read_to_string(&mut text).ok()?;
        (text == TEXT).then_some(lock)
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_locked_as_long_as_it_is_used() {
        let folder = BuildFolder::new().unwrap();
        let other = fs::File::open(folder.path()).unwrap();
        assert!(!unix::take(&other));
        let BuildFolder { folder: _kept, _locks } = folder;
        drop(_locks);
        // A process that another test starts just now has the lock, too, until it is that program.
        let deadline = std::time::Instant::now() + std::time::Duration::from_secs(30);
        while !unix::take(&other) {
            assert!(std::time::Instant::now() < deadline, "it is still locked");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }

    #[test]
    fn what_was_left_is_removed_and_no_folder_of_somebody_else() {
        let place = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let folder = place.path().join(name);
            fs::create_dir(&folder).unwrap();
            folder
        };
        let left = make("tx_runleft01");
        drop(unix::lock(&left).unwrap());
        let living = make("tx_runliving");
        let _locks = unix::lock(&living).unwrap();
        let kept = [make("tx_run_programs"), make("tx_runlonger1"), make("tx_runs-own!")];
        for folder in &kept {
            drop(unix::lock(folder).unwrap());
        }
        let others = [make("tx_runother1"), make("tx_runother2"), make("tx_runother3")];
        fs::write(others[0].join("lock"), "").unwrap();
        fs::create_dir(others[1].join("lock")).unwrap();
        std::os::unix::fs::symlink(kept[0].join("lock"), others[2].join("lock")).unwrap();
        // Killed while they were made or removed.
        let cut_off = [make("tx_runcutoff"), make("tx_runempty1"), make("tx_runnewest")];
        fs::write(cut_off[0].join("new"), "tx_run").unwrap();
        for folder in &cut_off[..2] {
            let old = std::time::SystemTime::now() - std::time::Duration::from_secs(61);
            fs::File::open(folder).unwrap().set_modified(old).unwrap();
        }
        fs::write(left.join("program"), "").unwrap();
        unix::remove_left(place.path());
        assert!(!left.exists());
        assert_eq!(cut_off.each_ref().map(|it| it.exists()), [false, false, true]);
        for folder in kept.iter().chain(&others).chain([&living]) {
            assert!(folder.join("lock").exists(), "{}", folder.display());
        }
    }
}
