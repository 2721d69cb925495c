//! A recorder whose file stands still.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

use ft_transfer_area::TransferAreaComHandler;
use ft_transfer_area_recorder::{Options, Recorder};
use tempfile::TempDir;

/// A recorder, and what goes with its file. The recorder is dropped first.
pub(crate) struct Recording {
    pub(crate) recorder: Recorder,
    pub(crate) place: Place,
}

/// Where a recorder writes, until this is dropped.
pub(crate) struct Place {
    /// Both ends of a pipe.
    _pipe: Option<File>,
    _folder: TempDir,
}

impl Recording {
    /// Begins to record a handler into a file.
    pub(crate) fn start(handler: &TransferAreaComHandler) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let recorder = Recorder::start(handler, path, Options::default()).unwrap();
        Self { recorder, place: Place { _pipe: None, _folder: folder } }
    }

    /// Begins to record a handler into a full pipe; `None` where files can't stand still.
    pub(crate) fn still(handler: &TransferAreaComHandler) -> Option<Self> {
        Self::into_full_pipe(|path| Recorder::start(handler, path, Options::default()).unwrap())
    }

    /// The same with another recorder.
    pub(crate) fn into_full_pipe(record: impl FnOnce(&Path) -> Recorder) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let mut pipe = pipe(&path)?;
        let recorder = record(&path);
        loop {
            match pipe.write(&[0; 4096]) {
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => panic!("{error}"),
            }
        }
        Some(Self { recorder, place: Place { _pipe: Some(pipe), _folder: folder } })
    }
}

/// Makes a pipe with a name, and opens it so that nothing waits for another end.
#[cfg(unix)]
fn pipe(path: &Path) -> Option<File> {
    use std::fs::OpenOptions;
    use std::os::unix::fs::OpenOptionsExt;

    nix::unistd::mkfifo(path, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let flags = nix::fcntl::OFlag::O_NONBLOCK.bits();
    Some(OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).unwrap())
}

#[cfg(not(unix))]
fn pipe(_path: &Path) -> Option<File> {
    None
}
