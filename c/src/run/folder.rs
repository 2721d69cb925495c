//! The folder in which a program is compiled. It goes with this process; what one that was killed has left, the next one
//! removes.

use std::io;
use std::path::Path;

use tempfile::TempDir;

const PREFIX: &str = "tx_run";

pub(crate) struct BuildFolder {
    folder: TempDir,
    #[cfg(unix)]
    _lock: std::fs::File,
}

impl BuildFolder {
    pub(crate) fn new() -> io::Result<Self> {
        #[cfg(unix)]
        unix::remove_left();
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir()?;
        Ok(Self {
            #[cfg(unix)]
            _lock: unix::lock(folder.path())?,
            folder,
        })
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
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

    pub(super) fn lock(folder: &Path) -> io::Result<File> {
        let new = folder.join("new");
        let lock = File::create(&new)?;
        // A system of files without locks does not matter. Nobody sees it unlocked.
        take(&lock);
        fs::rename(new, folder.join(LOCK))?;
        Ok(lock)
    }

    /// Locks a file, unless another process has. Whether it has worked.
    fn take(file: &File) -> bool {
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
