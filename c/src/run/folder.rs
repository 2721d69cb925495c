//! The folder in which a program is compiled. It goes with this process; what one that was killed has left, the next one
//! removes.

use std::io::{self, ErrorKind};
use std::path::Path;
use std::{env, fs};

use tempfile::TempDir;

use crate::Sentence;

const PREFIX: &str = "tx_run";

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
        unix::remove_left();
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir()?;
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
    use std::env;
    use std::fs::{self, File};
    use std::io;
    use std::os::fd::AsRawFd;
    use std::os::unix::fs::MetadataExt;
    use std::path::Path;

    use super::PREFIX;

    /// A file that is locked as long as the process lives that compiles in its folder.
    const LOCK: &str = "lock";

    pub(super) fn lock(folder: &Path) -> io::Result<[File; 2]> {
        // What removes old files, such as systemd-tmpfiles, leaves a locked folder alone: a program may run for weeks.
        let whole = File::open(folder)?;
        let new = folder.join("new");
        let lock = File::create(&new)?;
        // A system of files without locks does not matter. Nobody sees it unlocked.
        take(&whole);
        take(&lock);
        fs::rename(new, folder.join(LOCK))?;
        Ok([whole, lock])
    }

    /// Locks a file, unless another process has. Whether it has worked.
    pub(super) fn take(file: &File) -> bool {
        // SAFETY: a call without pointers, and the file is open.
        unsafe { libc::flock(file.as_raw_fd(), libc::LOCK_EX | libc::LOCK_NB) == 0 }
    }

    /// Removes what others of this user have left. Nothing depends on it, so errors do not matter.
    pub(super) fn remove_left() {
        // SAFETY: a call without pointers.
        let own = unsafe { libc::geteuid() };
        let Ok(entries) = fs::read_dir(env::temp_dir()) else { return };
        for entry in entries.flatten() {
            let is_named = entry.file_name().as_encoded_bytes().starts_with(PREFIX.as_bytes());
            // Of the entry itself, not of what a link leads to.
            let is_own =
                is_named && entry.metadata().is_ok_and(|it| it.is_dir() && it.uid() == own);
            let lock = is_own.then(|| File::open(entry.path().join(LOCK)).ok()).flatten();
            if lock.is_some_and(|lock| take(&lock)) {
                let _ = fs::remove_dir_all(entry.path());
            }
        }
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
        assert!(unix::take(&other));
    }
}
