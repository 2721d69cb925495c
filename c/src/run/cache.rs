//! Compiled files of earlier runs, in the user's folder for caches.
//!
//! An entry is one file, which is replaced as a whole, so several `tx_run` may use the cache at once. Its name is the
//! [`Key`] of all that the compiled file depends on. One that is damaged, or has the name of
//! another one, does not count.

use std::env;
use std::fs::{self, DirBuilder, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use twox_hash::XxHash3_128;

use crate::key::Key;
use crate::read;
use crate::say;

/// The beginning of each entry: another version of this program may have another form.
const BEGINNING: &[u8] = b"tx_run 5\n";
/// How much is kept: some programs of the size of a factory.
const LIMIT: u64 = 512 << 20;
/// When a file that was not finished belongs to nobody any more.
const ABANDONED: Duration = Duration::from_secs(24 * 60 * 60);
/// The beginning of the names of files that are being written.
const UNFINISHED: &str = "new-";

/// The cache, or none when this user has no folder for it.
pub(crate) struct Cache {
    folder: Option<PathBuf>,
    begun: SystemTime,
    limit: u64,
}

impl Cache {
    /// That of the user: in `XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches`, or `%LOCALAPPDATA%`.
    pub(crate) fn of_user() -> Self {
        let folder = folder_of_user().map(|folder| folder.join("tx_run"));
        Self::in_folder(folder.as_deref(), LIMIT)
    }

    /// Without a folder that nobody else can write, nothing is kept: what lies there is run.
    fn in_folder(folder: Option<&Path>, limit: u64) -> Self {
        let folder = folder.and_then(|folder| match own::make(folder) {
            Ok(folder) => folder,
            Err(why) => {
                say(&format!("everything is compiled anew, because {why}"));
                None
            }
        });
        Self { folder, begun: SystemTime::now(), limit }
    }

    pub(crate) fn is_there(&self) -> bool {
        self.folder.is_some()
    }

    fn place(&self, key: Key) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{:032x}", key.0)))
    }

    /// Writes what the source with this key was compiled to, and returns what the compiler said then; `None`
    /// when it has to be compiled.
    pub(crate) fn take(&self, key: Key, object: &Path) -> Option<Vec<u8>> {
        let place = self.place(key)?;
        own::check_entry(&place).ok()?;
        let entry = fs::read(&place).ok()?;
        let entry = Entry::parse(key, &entry)?;
        fs::write(object, entry.object).ok()?;
        // What was used last is kept longest. One that can't be touched is only younger than it should be.
        let _ = File::options().write(true).open(place).and_then(|it| it.set_modified(self.begun));
        Some(entry.messages.to_vec())
    }

    /// Keeps what a source was compiled to, and what the compiler has said, such as warnings. A cache that can't be
    /// written is only slow.
    pub(crate) fn add(&self, key: Key, object: &Path, messages: &[u8]) {
        let (Some(folder), Some(place)) = (&self.folder, self.place(key)) else { return };
        let write = || -> io::Result<()> {
            let mut rest = format!("{}\n", messages.len()).into_bytes();
            rest.extend_from_slice(messages);
            read::more(File::open(object)?, &mut rest)?;
            let mut file = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(folder)?;
            file.write_all(BEGINNING)?;
            file.write_all(format!("{:032x}\n", check_of(key, &rest)).as_bytes())?;
            file.write_all(&rest)?;
            file.persist(place)?;
            Ok(())
        };
        let _ = write();
    }

    /// Removes what was not used for longest, if there is too much, and what was never finished.
    pub(crate) fn tidy(&self) {
        let entries = self.folder.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten();
        let mut all: Vec<(SystemTime, u64, PathBuf)> = Vec::new();
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let known = entry.metadata().and_then(|data| Ok((data.modified()?, data.len())));
            let Ok((used, size)) = known else { continue };
            if name.starts_with(UNFINISHED) {
                if is_abandoned(used, self.begun) {
                    let _ = fs::remove_file(entry.path());
                }
            } else if name.len() == 32 {
                all.push((used, size, entry.path()));
            }
        }
        let mut size: u64 = all.iter().map(|(_, size, _)| size).sum();
        if size <= self.limit {
            return;
        }
        all.sort();
        for (_, its, place) in all {
            // With some room, so that the next run does not have to do it again.
            if size <= self.limit / 4 * 3 {
                break;
            }
            // Another run may have removed it.
            let _ = fs::remove_file(place);
            size -= its;
        }
    }
}

/// Whether a file that was changed then will not be finished any more. Its time may be any.
fn is_abandoned(changed: SystemTime, now: SystemTime) -> bool {
    changed.checked_add(ABANDONED).is_some_and(|end| end < now)
}

/// The user's folder for caches.
fn folder_of_user() -> Option<PathBuf> {
    let variable = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    if cfg!(windows) {
        return variable("LOCALAPPDATA");
    }
    let home = || variable("HOME");
    if cfg!(target_os = "macos") {
        return home().map(|home| home.join("Library/Caches"));
    }
    variable("XDG_CACHE_HOME").or_else(|| home().map(|home| home.join(".cache")))
}

/// An entry that is not damaged.
struct Entry<'a> {
    messages: &'a [u8],
    object: &'a [u8],
}

impl<'a> Entry<'a> {
    fn parse(key: Key, bytes: &'a [u8]) -> Option<Self> {
        let (check, rest) = line_of(bytes.strip_prefix(BEGINNING)?)?;
        if u128::from_str_radix(check, 16).ok()? != check_of(key, rest) {
            return None;
        }
        let (length, rest) = line_of(rest)?;
        let (messages, object) = rest.split_at_checked(length.parse().ok()?)?;
        Some(Self { messages, object })
    }
}

/// Shows whether what is kept under this key is damaged, or belongs to another one.
fn check_of(key: Key, rest: &[u8]) -> u128 {
    let mut hasher = XxHash3_128::new();
    hasher.write(&key.0.to_le_bytes());
    hasher.write(rest);
    hasher.finish_128()
}

/// The first line, and what follows it.
fn line_of(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((std::str::from_utf8(&bytes[..end]).ok()?, &bytes[end + 1..]))
}

/// Folders and files that only this user writes.
#[cfg(unix)]
mod own {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt};

    use super::*;

    /// Write permissions of others than the owner, and the bit by which a folder lets them change only what is theirs.
    const OTHERS_WRITE: u32 = 0o022;
    const STICKY: u32 = 0o1000;

    /// Makes a folder that is this user's alone; its name without links before the last part. Nothing is made in a
    /// folder of another user, as root could. `None` when it can't be made, a sentence when it must not be used.
    pub(super) fn make(folder: &Path) -> Result<Option<PathBuf>, String> {
        let (Some(above), Some(name)) = (folder.parent(), folder.file_name()) else {
            return Ok(None);
        };
        let real = above.ancestors().find_map(|place| {
            let rest = above.strip_prefix(place).ok()?;
            Some(fs::canonicalize(place).ok()?.join(rest).join(name))
        });
        let Some(folder) = real else { return Ok(None) };
        check(&folder)?;
        if DirBuilder::new().mode(0o700).recursive(true).create(&folder).is_err() {
            return Ok(None);
        }
        check(&folder)?;
        Ok(Some(folder))
    }

    /// A sentence when others can put something into this folder, or another one in its place. What is not there does
    /// not count.
    fn check(folder: &Path) -> Result<(), String> {
        // SAFETY: a call without arguments.
        let me = unsafe { libc::geteuid() };
        for place in folder.ancestors() {
            let name = place.display();
            let data = match fs::symlink_metadata(place) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                data => data.map_err(|error| format!("{name}: {error}"))?,
            };
            let is_it = place == folder;
            if !data.is_dir() {
                return Err(format!("{name} is no folder"));
            }
            if data.uid() != me && (is_it || data.uid() != 0) {
                return Err(format!("{name} belongs to another user"));
            }
            let is_sticky = !is_it && data.mode() & STICKY != 0;
            if data.mode() & OTHERS_WRITE != 0 && !is_sticky {
                return Err(format!("others can write to {name}; chmod go-w takes that from them"));
            }
        }
        Ok(())
    }

    /// An error for what others have left from the time when they could write here.
    pub(super) fn check_entry(place: &Path) -> io::Result<()> {
        let data = fs::symlink_metadata(place)?;
        // SAFETY: a call without arguments.
        let is_own = data.is_file() && data.uid() == unsafe { libc::geteuid() };
        if !is_own || data.mode() & OTHERS_WRITE != 0 || data.nlink() != 1 {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        Ok(())
    }
}

/// On Windows the folder lies in the user's own.
#[cfg(not(unix))]
mod own {
    use super::*;

    pub(super) fn make(folder: &Path) -> Result<Option<PathBuf>, String> {
        Ok(DirBuilder::new().recursive(true).create(folder).is_ok().then(|| folder.to_owned()))
    }

    pub(super) fn check_entry(_: &Path) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests;
