//! How a recording is made.

#[cfg(doc)]
use ft_transfer_area::CycleLog;

use crate::parts::Parts;

/// How a recording is made.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Options {
    /// How many cycles wait for a slow disk before the next ones are lost; the default 500 is about five seconds,
    /// and takes 5 MB. Fewer than 10 may lose cycles on a fast disk, too.
    pub capacity: usize,
    /// Into several files; `None`, the default, for one.
    pub parts: Option<Parts>,
}

impl Default for Options {
    fn default() -> Self {
        Self { capacity: 500, parts: None }
    }
}

impl Options {
    /// With this number of cycles that wait for a slow disk, 1..=[`CycleLog::MAX_CAPACITY`].
    #[must_use]
    pub fn capacity(self, capacity: usize) -> Self {
        Self { capacity, ..self }
    }

    /// Into several files.
    #[must_use]
    pub fn parts(self, parts: Parts) -> Self {
        Self { parts: Some(parts), ..self }
    }
}
