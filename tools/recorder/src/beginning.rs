//! Recordings that wait for their file to take the beginning.

use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};

use ft_transfer_area::IoError;

/// How many recordings may wait for files that take nothing. Each has a thread until its file does.
const BEGINNINGS: usize = 64;

/// How many begin now.
static BEGIN: AtomicUsize = AtomicUsize::new(0);

/// A recording that begins, and is counted here.
pub(crate) struct Beginning(&'static AtomicUsize);

impl Beginning {
    pub(crate) fn begin() -> Result<Self, IoError> {
        Self::counted(&BEGIN)
    }

    fn counted(count: &'static AtomicUsize) -> Result<Self, IoError> {
        // Dropped, it counts no more.
        let this = Self(count);
        match count.fetch_add(1, Ordering::Relaxed) {
            0..BEGINNINGS => Ok(this),
            _ => Err(io::Error::new(
                io::ErrorKind::WouldBlock,
                format!("{BEGINNINGS} earlier recordings still wait for files that take nothing"),
            )
            .into()),
        }
    }
}

impl Drop for Beginning {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_so_many_recordings_wait_for_files_that_take_nothing() {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let all: Vec<_> = (0..BEGINNINGS).map(|_| Beginning::counted(&COUNT).unwrap()).collect();
        let error = Beginning::counted(&COUNT).err().unwrap();
        assert!(format!("{error:#}").contains("64 earlier recordings still wait"), "{error:#}");
        drop(all);
        assert!(Beginning::counted(&COUNT).is_ok(), "they have begun");
    }
}
