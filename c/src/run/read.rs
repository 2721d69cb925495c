//! Reads no more than programs have, and paths in any character set.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Far more than a source has with all its headers.
pub(crate) const MOST: usize = 100 << 20;

/// Reads a file.
pub(crate) fn file(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    more(File::open(path)?, &mut bytes)?;
    Ok(bytes)
}

/// Reads all that comes behind what was read before; an error if both together are too much.
pub(crate) fn more(from: impl Read, bytes: &mut Vec<u8>) -> io::Result<()> {
    let room = (MOST + 1).saturating_sub(bytes.len());
    from.take(room as u64).read_to_end(bytes)?;
    match bytes.len() > MOST {
        true => Err(too_much("it has more than 100 MB")),
        false => Ok(()),
    }
}

pub(crate) fn too_much(sentence: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, sentence)
}

/// The path with this name, if the system can have it.
pub(crate) fn path(name: &[u8]) -> Option<PathBuf> {
    #[cfg(unix)]
    let name = <std::ffi::OsStr as std::os::unix::ffi::OsStrExt>::from_bytes(name);
    #[cfg(not(unix))]
    let name = std::str::from_utf8(name).ok()?;
    Some(name.into())
}
