//! What the recorder's thread and the program share.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use ft_transfer_area::IoError;

/// What a recording has so far, or in all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Totals {
    /// Cycles in the file.
    pub cycles: u64,
    /// Entries, most of them cycles, that were lost because the disk was too slow.
    pub lost: u64,
    /// Pictures of the camera in the file.
    pub frames: u64,
    /// Pictures that were lost because the disk was too slow.
    pub lost_frames: u64,
    /// About how large the file is; of a recording in parts, the newest one.
    pub bytes: u64,
}

/// What the recorder's thread and the program share.
#[derive(Debug, Default)]
pub(crate) struct State {
    /// The file, of several the newest.
    pub(crate) path: Mutex<PathBuf>,
    pub(crate) recorded: Mutex<Totals>,
    /// How many bytes the file has.
    pub(crate) bytes: AtomicU64,
    pub(crate) lost_frames: AtomicU64,
    /// The bytes of the pictures that wait.
    pub(crate) frame_bytes: AtomicUsize,
    pub(crate) failure: Mutex<Option<IoError>>,
}

impl State {
    pub(crate) fn path(&self) -> PathBuf {
        self.path.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(crate) fn set_path(&self, path: &Path) {
        path.clone_into(&mut self.path.lock().unwrap_or_else(PoisonError::into_inner));
    }

    pub(crate) fn recorded(&self) -> Totals {
        let recorded = *self.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        let lost_frames = self.lost_frames.load(Ordering::Relaxed);
        Totals { lost_frames, bytes: self.bytes.load(Ordering::Relaxed), ..recorded }
    }

    pub(crate) fn failure(&self) -> Option<IoError> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
