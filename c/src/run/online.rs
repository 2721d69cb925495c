//! Which controllers the program has left with motors on. Its library writes down when a transfer has begun, and when
//! its last exchange has switched all outputs off.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{self, Path, PathBuf};

use ft_transfer_area::Error;

use crate::stop;

/// The environment variable with the file.
pub(crate) const VARIABLE: &str = "FT_TXT_TRANSFERS";

/// What the program and its children write down.
pub(crate) struct Online {
    pub(crate) path: PathBuf,
    file: File,
    /// What the notes that were read have left.
    left: BTreeMap<String, String>,
}

impl Online {
    pub(crate) fn new(folder: &Path) -> io::Result<Self> {
        // The program may change its folder.
        let path = path::absolute(folder.join("transfers"))?;
        let file = File::options().read(true).write(true).create_new(true).open(&path)?;
        Ok(Self { path, file, left: BTreeMap::new() })
    }

    /// The transfers that have begun and not ended, with their hosts. Those that were stopped from here, or could not be, are left
    /// no more.
    fn left(&mut self) -> &BTreeMap<String, String> {
        let mut notes = String::new();
        // Nobody but the library writes it, whole lines. What was read before is not read again.
        let _ = self.file.read_to_string(&mut notes);
        for note in notes.lines() {
            match (note.strip_prefix('+').and_then(|begun| begun.split_once(' ')), note.get(1..)) {
                (Some((id, host)), _) => _ = self.left.insert(id.to_owned(), host.to_owned()),
                (None, Some(id)) => _ = self.left.remove(id),
                (None, None) => {}
            }
        }
        &self.left
    }

    /// Sends a last exchange to each controller that was left, except to this one.
    pub(crate) fn stop_left(&mut self, but: Option<&str>) -> Vec<Result<(), Error>> {
        self.left();
        let left = std::mem::take(&mut self.left);
        let mut hosts: Vec<&str> = left.values().map(String::as_str).collect();
        hosts.sort_unstable();
        hosts.dedup();
        let hosts = hosts.into_iter().filter(|host| Some(*host) != but);
        hosts.map(stop::stop).collect()
    }

    /// Whether transfers are left that no process has any more: the program has ended, or has become another one.
    #[cfg(unix)]
    pub(crate) fn is_left(&mut self) -> bool {
        !self.left().is_empty() && !self.is_marked()
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
        let mut mark: libc::flock = unsafe { std::mem::zeroed() };
        mark.l_type = libc::F_WRLCK as _;
        // SAFETY: the file is open, and the mark is this function's. It only asks.
        let asked = unsafe { libc::fcntl(self.file.as_raw_fd(), libc::F_GETLK, &raw mut mark) };
        asked == -1 || mark.l_type != libc::F_UNLCK as _
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn what_has_begun_and_not_ended_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let mut online = Online::new(folder.path()).unwrap();
        let left = |online: &mut Online| online.left().values().cloned().collect::<Vec<_>>();
        assert_eq!(left(&mut online), [""; 0]);
        let mut library = File::options().append(true).open(&online.path).unwrap();
        library.write_all(b"+7.0 auto\n+7.1 10.0.0.7:65000\n-7.0\n\n-9.9\n").unwrap();
        assert_eq!(left(&mut online), ["10.0.0.7:65000"]);
        assert!(online.stop_left(Some("10.0.0.7:65000")).is_empty());
        assert_eq!(left(&mut online), [""; 0]);
    }
}
