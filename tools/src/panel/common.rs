//! What all controllers of the panel share.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Instant, SystemTime};

use ft_transfer_area::Error;

use super::control_lock::ControlLock;

/// What all parts of the panel share.
#[derive(Debug)]
pub(crate) struct Common {
    pub(crate) control: ControlLock,
    pub(crate) begin: Instant,
    /// When that was, in milliseconds since 1970: a page sees by it that the program was started anew.
    pub(crate) began: u64,
    /// The program ends.
    ending: AtomicBool,
}

impl Common {
    pub(crate) fn new() -> Self {
        let control = ControlLock::default();
        let began = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_millis() as u64;
        Self { control, begin: Instant::now(), began, ending: AtomicBool::new(false) }
    }

    pub(crate) fn end(&self) {
        self.ending.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Relaxed)
    }
}

/// Starts a thread of the panel.
pub(super) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), Error> {
    let thread = thread::Builder::new().name(name.to_owned()).spawn(work);
    thread.map(drop).map_err(|error| Error::ThreadNotStarted { cause: error.into() })
}
