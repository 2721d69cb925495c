//! Compiled files of earlier runs, in the user's folder for caches.
//!
//! An entry is one file, which is replaced as a whole, so several `tx_run` may use the cache at once. Its name is
//! made of what is known before a source is compiled. In it are the headers that the compiler has read, with their
//! contents at that time: only when all are as they were is the entry used. One that is damaged does not count.

use std::collections::HashMap;
use std::env;
use std::fs::{self, File};
use std::hash::Hash;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime};

use twox_hash::XxHash3_128;

/// The beginning of each entry: another version of this program may have another form.
const BEGINNING: &[u8] = b"tx_run 1\n";
/// How much is kept: some programs of the size of a factory.
const LIMIT: u64 = 512 << 20;
/// When a file that was not finished belongs to nobody any more.
const ABANDONED: Duration = Duration::from_secs(24 * 60 * 60);
/// The beginning of the names of files that are being written.
const UNFINISHED: &str = "new-";

/// What is known before a source is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key(u128);

impl Key {
    pub(crate) fn of(what: &impl Hash) -> Self {
        let mut hasher = Hasher(XxHash3_128::new());
        what.hash(&mut hasher);
        Self(hasher.0.finish_128())
    }
}

/// A number for a text, another one for each other text.
pub(crate) fn content_of(text: &[u8]) -> u128 {
    XxHash3_128::oneshot(text)
}

/// Takes in whatever can be hashed.
struct Hasher(XxHash3_128);

impl std::hash::Hasher for Hasher {
    fn write(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
    }

    fn finish(&self) -> u64 {
        self.0.finish_128() as u64
    }
}

/// A source that was compiled.
pub(crate) struct Compiled<'a> {
    pub(crate) object: &'a Path,
    /// What the compiler has read.
    pub(crate) read: &'a [PathBuf],
    /// What it has said, such as warnings.
    pub(crate) messages: &'a [u8],
}

/// The cache, or none when this user has no folder for it.
pub(crate) struct Cache {
    folder: Option<PathBuf>,
    begun: SystemTime,
    limit: u64,
    /// Contents of files, each of which is read once.
    contents: Mutex<HashMap<PathBuf, Option<u128>>>,
}

impl Cache {
    /// That of the user: in `XDG_CACHE_HOME` or `~/.cache`, `~/Library/Caches`, or `%LOCALAPPDATA%`.
    pub(crate) fn of_user() -> Self {
        Self::in_folder(folder_of_user().map(|folder| folder.join("tx_run")), LIMIT)
    }

    fn in_folder(folder: Option<PathBuf>, limit: u64) -> Self {
        let folder = folder.filter(|folder| fs::create_dir_all(folder).is_ok());
        Self { folder, begun: SystemTime::now(), limit, contents: Mutex::default() }
    }

    fn place(&self, key: Key) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{:032x}", key.0)))
    }

    /// Writes what the source with this key was compiled to, and returns what the compiler said then; `None`
    /// when it has to be compiled.
    pub(crate) fn take(&self, key: Key, object: &Path) -> Option<Vec<u8>> {
        let place = self.place(key)?;
        let entry = fs::read(&place).ok()?;
        let entry = Entry::parse(&entry)?;
        let is_same =
            |(path, content): &(&str, u128)| self.content(Path::new(path)) == Some(*content);
        if !entry.read.iter().all(is_same) {
            return None;
        }
        fs::write(object, entry.object).ok()?;
        // What was used last is kept longest. One that can't be touched is only younger than it should be.
        let _ = File::options().write(true).open(place).and_then(|it| it.set_modified(self.begun));
        Some(entry.messages.to_vec())
    }

    /// Keeps what a source was compiled to. A cache that can't be written is only slow.
    pub(crate) fn add(&self, key: Key, compiled: &Compiled<'_>) {
        let (Some(folder), Some(place)) = (&self.folder, self.place(key)) else { return };
        let Some(bytes) = self.entry(compiled) else { return };
        let write = || -> io::Result<()> {
            let mut file = tempfile::Builder::new().prefix(UNFINISHED).tempfile_in(folder)?;
            file.write_all(&bytes)?;
            file.persist(place)?;
            Ok(())
        };
        let _ = write();
    }

    /// The bytes of an entry; `None` when it would not be known what was read.
    fn entry(&self, compiled: &Compiled<'_>) -> Option<Vec<u8>> {
        let mut head = format!("{}\n{}\n", compiled.read.len(), compiled.messages.len());
        for path in compiled.read {
            // One that has changed meanwhile may be another one than the compiler has read.
            let changed = fs::metadata(path).and_then(|data| data.modified()).ok()?;
            let name = path.to_str().filter(|name| !name.contains('\n'))?;
            if changed >= self.begun {
                return None;
            }
            head += &format!("{:032x} {name}\n", self.content(path)?);
        }
        let mut rest = head.into_bytes();
        rest.extend_from_slice(compiled.messages);
        rest.extend(fs::read(compiled.object).ok()?);
        let check = format!("{:032x}\n", content_of(&rest));
        Some([BEGINNING, check.as_bytes(), &rest].concat())
    }

    /// A number for what is in a file now; `None` when it can't be read.
    fn content(&self, path: &Path) -> Option<u128> {
        let known = self.contents.lock().unwrap_or_else(|it| it.into_inner()).get(path).copied();
        known.unwrap_or_else(|| {
            let content = fs::read(path).ok().map(|bytes| content_of(&bytes));
            let mut contents = self.contents.lock().unwrap_or_else(|it| it.into_inner());
            contents.insert(path.to_owned(), content);
            content
        })
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
                if used + ABANDONED < self.begun {
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
    read: Vec<(&'a str, u128)>,
    messages: &'a [u8],
    object: &'a [u8],
}

impl<'a> Entry<'a> {
    fn parse(bytes: &'a [u8]) -> Option<Self> {
        let (check, mut rest) = line_of(bytes.strip_prefix(BEGINNING)?)?;
        if u128::from_str_radix(check, 16).ok()? != content_of(rest) {
            return None;
        }
        let mut next = || {
            let (line, behind) = line_of(rest)?;
            rest = behind;
            Some(line)
        };
        let count: usize = next()?.parse().ok()?;
        let length: usize = next()?.parse().ok()?;
        let mut read = Vec::new();
        for _ in 0..count {
            let (content, path) = next()?.split_once(' ')?;
            read.push((path, u128::from_str_radix(content, 16).ok()?));
        }
        let (messages, object) = rest.split_at_checked(length)?;
        Some(Self { read, messages, object })
    }
}

/// The first line, and what follows it.
fn line_of(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((std::str::from_utf8(&bytes[..end]).ok()?, &bytes[end + 1..]))
}

/// The files in a dependency file, which is written for make.
pub(crate) fn dependencies(text: &str) -> Vec<PathBuf> {
    let Some((_, text)) = text.split_once(": ") else { return Vec::new() };
    let mut files = Vec::new();
    let mut name = String::new();
    let mut rest = text.chars().peekable();
    while let Some(next) = rest.next() {
        match (next, rest.peek().copied()) {
            ('\\', Some(escaped @ (' ' | '#'))) | ('$', Some(escaped @ '$')) => {
                name.push(escaped);
                rest.next();
            }
            ('\\', Some('\n' | '\r')) => {}
            (' ' | '\n' | '\r', _) => files.extend(Some(std::mem::take(&mut name))),
            (other, _) => name.push(other),
        }
    }
    files.push(name);
    files.into_iter().filter(|name| !name.is_empty()).map(PathBuf::from).collect()
}

#[cfg(test)]
mod tests;
