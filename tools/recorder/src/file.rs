//! A file into which only one recording is written at a time; for `txt`, too.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Opens a file. Until it is closed, [`open_alone`] of others is refused. Does not wait.
pub fn open_alone(options: &OpenOptions, path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    {
        use rustix::fs::{flock, FlockOperation};
        use rustix::io::Errno;

        let file = options.open(path)?;
        // Not all file systems have locks, and any number of programs may write into a device.
        if file.metadata()?.is_file()
            && flock(&file, FlockOperation::NonBlockingLockExclusive) == Err(Errno::WOULDBLOCK)
        {
            return Err(is_written());
        }
        Ok(file)
    }
    #[cfg(windows)]
    {
        use std::os::windows::fs::OpenOptionsExt;

        // A lock would forbid others to read.
        const SHARE_READ: u32 = 1;
        const SHARE_DELETE: u32 = 4;
        const SHARING_VIOLATION: i32 = 32;

        let file = options.clone().share_mode(SHARE_READ | SHARE_DELETE).open(path);
        file.map_err(|error| match error.raw_os_error() {
            Some(SHARING_VIOLATION) => is_written(),
            _ => error,
        })
    }
}

fn is_written() -> io::Error {
    io::Error::new(ErrorKind::ResourceBusy, "another recording is being written into it")
}

/// Makes a file, as [`open_alone`]. Nobody finds it before it is locked, unless the file system has no links.
pub(crate) fn create_alone(path: &Path) -> io::Result<File> {
    if cfg!(unix) {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let (beside, made) = make_beside(&path.with_extension(number.to_string()))?;
        let linked = fs::hard_link(&beside, path);
        let _ = fs::remove_file(&beside);
        match linked {
            Ok(()) => return Ok(made),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => return Err(error),
            Err(_) => {}
        }
    }
    open_alone(OpenOptions::new().write(true).create_new(true), path)
}

/// Makes a file with the name beside this one.
fn make_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let beside = beside(path);
    // A process with the same number was perhaps killed.
    let _ = fs::remove_file(&beside);
    let made = open_alone(OpenOptions::new().write(true).create_new(true), &beside)?;
    Ok((beside, made))
}

/// Keeps a file from others until another one has its place. The error says that somebody writes into it; `None` is
/// for one that nobody may write, and for what is no file.
pub fn hold(path: &Path) -> io::Result<Option<File>> {
    if !path.is_file() {
        return Ok(None);
    }
    match open_alone(OpenOptions::new().write(true), path) {
        Err(error) if error.kind() == ErrorKind::ResourceBusy => Err(error),
        held => Ok(held.ok()),
    }
}

/// Gives a file this name, unless somebody writes into the one that has it.
pub(crate) fn rename(file: &Path, to: &Path) -> io::Result<()> {
    // Windows replaces no open file everywhere.
    let _held = hold(to)?.filter(|_| cfg!(unix));
    fs::rename(file, to)
}

/// Opens an empty file with this name. A file that has it already is replaced, so that who reads it keeps it.
pub(crate) fn create(path: &Path) -> io::Result<File> {
    let path = &*place_of(path);
    if path.exists() && !path.is_file() {
        // Such as a pipe.
        return File::create(path);
    }
    loop {
        let file = open_alone(OpenOptions::new().write(true).create(true).truncate(false), path)?;
        // It may have been replaced before it was locked.
        if !is_at(&file, path) {
            continue;
        }
        if file.metadata()?.len() == 0 {
            return Ok(file);
        }
        // As where only the file may be written, and nothing beside it, or where Windows replaces no open file.
        return replace(path, &file).or_else(|_| file.set_len(0).map(|()| file));
    }
}

/// A new file in place of this one, with its owner and mode.
fn replace(path: &Path, old: &File) -> io::Result<File> {
    let (beside, new) = make_beside(path)?;
    let replaced = make_like(&new, old).and_then(|()| fs::rename(&beside, path));
    if let Err(error) = replaced {
        let _ = fs::remove_file(&beside);
        return Err(error);
    }
    Ok(new)
}

#[cfg(unix)]
fn make_like(new: &File, old: &File) -> io::Result<()> {
    use std::os::unix::fs::{fchown, MetadataExt};
    let old = old.metadata()?;
    fchown(new, Some(old.uid()), Some(old.gid()))?;
    new.set_permissions(old.permissions())
}

#[cfg(windows)]
fn make_like(_: &File, _: &File) -> io::Result<()> {
    Ok(())
}

/// Whether this open file has this name. Only Unix says so.
#[cfg(unix)]
pub fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let [held, there] =
        [file.metadata(), path.metadata()].map(|of| of.map(|it| (it.dev(), it.ino())));
    // What can't be asked is no other file.
    held.is_err() || there.is_err() || held.ok() == there.ok()
}

#[cfg(windows)]
pub fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// Where a new file is to come: a link to a file stays a link.
pub fn place_of(path: &Path) -> PathBuf {
    let file = if path.is_symlink() { path.canonicalize().ok() } else { None };
    file.unwrap_or_else(|| path.to_owned())
}

/// A name beside this file, of which no other recording makes use.
pub fn beside(file: &Path) -> PathBuf {
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.new", std::process::id()));
    file.with_file_name(name)
}
