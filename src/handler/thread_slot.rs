//! The transfer's thread, for those that wait for its end.

use super::sync::{JoinHandle, Mutex};

/// Has the thread as soon as its transfer runs: who sees the transfer running finds its thread here.
#[derive(Debug, Default)]
pub(super) struct ThreadSlot(Mutex<Option<(u64, JoinHandle<()>)>>);

impl ThreadSlot {
    /// Starts the thread of the transfer with this number. Others wait meanwhile.
    pub(super) fn start<E>(
        &self,
        number: u64,
        start: impl FnOnce() -> Result<JoinHandle<()>, E>,
    ) -> Result<(), E> {
        let mut slot = self.0.lock();
        *slot = Some((number, start()?));
        Ok(())
    }

    /// Waits for the threads of transfers up to this number. Others that do so wait, too.
    pub(super) fn join(&self, number: u64) {
        let mut slot = self.0.lock();
        if let Some((_, thread)) = slot.take_if(|(of, _)| *of <= number) {
            // The thread catches its own panics, so there is nothing to report here.
            let _ = thread.join();
        }
    }
}
