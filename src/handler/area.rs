//! The program's side of the shared areas: handle and guard.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

use parking_lot::MutexGuard;

use super::mail::Stop;
use super::shared::Shared;
use super::wait::deadline_after;
use super::Statistics;
use crate::error::Error;
use crate::transfer_area::FishX1Transfer;

/// A handle to the areas of a [`TransferAreaComHandler`](super::TransferAreaComHandler), for
/// other threads than the one that owns it.
///
/// It lives as long as one likes; after the handler is dropped the areas keep their last state.
/// When a thread that owns a handle or holds a guard panics, the transfer ends with all motors
/// stopped and [`Error::ProgramPanicked`], because nobody minds what that thread minded.
///
/// ```
/// use ft_transfer_area::transfer_area::LOCAL_IO;
/// use ft_transfer_area::TransferAreaComHandler;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.7.2").build()?;
/// let area = handler.transfer_area();
/// std::thread::spawn(move || area.lock()[LOCAL_IO].output.duty[0] = 512).join().unwrap();
/// assert_eq!(handler.lock()[LOCAL_IO].output.duty[0], 512);
/// # Ok(())
/// # }
/// ```
pub struct TransferArea {
    shared: Arc<Shared>,
    /// The newest cycle that this handle's `wait_cycle` has returned.
    seen: AtomicU64,
    panicking: PanicCheck,
}

impl TransferArea {
    /// Areas in the kit's default configuration.
    pub(super) fn new(count: usize) -> Self {
        Self::with_shared(Arc::new(Shared::new(count)), 0)
    }

    fn with_shared(shared: Arc<Shared>, seen: u64) -> Self {
        Self { shared, seen: AtomicU64::new(seen), panicking: PanicCheck::new() }
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Stops the transfer when the thread has begun to panic since it got this handle.
    pub(super) fn stop_on_panic(&self) {
        if self.panicking.has_begun() {
            self.shared.ask_to_stop(Stop::ProgramPanicked);
        }
    }

    /// Locks the areas, with the newest inputs in them.
    ///
    /// Works before, during and after a transfer. Blocks while another thread holds a guard. The
    /// exchange goes on meanwhile with what the areas last held; inputs that come in while the
    /// guard is held are there at the next lock. A thread that locks again while it holds a guard
    /// waits for itself for ever.
    #[must_use = "the areas are locked only as long as the guard lives"]
    pub fn lock(&self) -> TransferAreaGuard<'_> {
        self.guard(None)
    }

    /// Waits for the next response and returns the areas locked, with its inputs in them.
    ///
    /// What is written under this guard goes out in the very next request, when the guard is
    /// dropped within the reaction window; when all threads that waited for the response have
    /// dropped theirs, the request leaves at once. A call within the window returns the response
    /// that opened it, unless this handle has returned it before.
    ///
    /// Blocks until a response comes in or the transfer ends, so at most as long as the transfer's
    /// time limits and its reaction window allow; then as long as another thread holds a guard. A
    /// thread that holds a guard itself waits for ever.
    ///
    /// # Errors
    ///
    /// [`Error::NotStarted`] without a transfer, or the error that ended it.
    pub fn wait_cycle(&self) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait(None)
    }

    /// Does the same as [`wait_cycle`](Self::wait_cycle), but waits not longer than `limit`.
    ///
    /// The lock itself may take longer, when another thread holds a guard.
    ///
    /// # Errors
    ///
    /// [`Error::WaitTimedOut`] when no response came in time; the transfer goes on. Otherwise as
    /// `wait_cycle`.
    pub fn wait_cycle_for(&self, limit: Duration) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait(Some(limit))
    }

    fn wait(&self, limit: Option<Duration>) -> Result<TransferAreaGuard<'_>, Error> {
        let deadline = limit.and_then(deadline_after);
        let cycle = self.shared.wait_cycle(self.seen.load(Ordering::Relaxed), deadline)?;
        let timed_out = || Error::WaitTimedOut { limit: limit.unwrap_or_default() };
        let guard = self.guard(Some(cycle.ok_or_else(timed_out)?));
        self.note_seen(&guard);
        Ok(guard)
    }

    /// Remembers that this handle has returned the guard's response.
    pub(super) fn note_seen(&self, guard: &TransferAreaGuard<'_>) {
        self.seen.store(guard.cycle, Ordering::Relaxed);
    }

    /// Locks the areas for a thread that may have waited for a response.
    pub(super) fn guard(&self, reacts_to: Option<u64>) -> TransferAreaGuard<'_> {
        let (areas, cycle) = self.shared.lock(reacts_to);
        let panicking = PanicCheck::new();
        TransferAreaGuard { shared: &self.shared, areas, cycle, reacts_to, panicking }
    }

    /// Waits until the controller has the configuration that the areas hold now.
    ///
    /// A configuration goes out by itself when its `config_id` changes; this only waits for it.
    /// Blocks for two responses, as [`wait_cycle`](Self::wait_cycle) does for one.
    ///
    /// # Errors
    ///
    /// [`Error::NotStarted`] without a transfer, or the error that ended it.
    #[doc(alias = "UpdateConfig")]
    pub fn update_config(&self) -> Result<(), Error> {
        // The request under way may have left before the last change; the one after it goes out
        // behind the configuration.
        for _ in 0..2 {
            drop(self.wait_cycle()?);
        }
        Ok(())
    }

    /// Figures of the transfer that runs, or of the last one.
    pub fn statistics(&self) -> Statistics {
        self.shared.statistics()
    }
}

impl Clone for TransferArea {
    fn clone(&self) -> Self {
        Self::with_shared(Arc::clone(&self.shared), self.seen.load(Ordering::Relaxed))
    }
}

impl fmt::Debug for TransferArea {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TransferArea").field("statistics", &self.statistics()).finish()
    }
}

impl Drop for TransferArea {
    fn drop(&mut self) {
        self.stop_on_panic();
    }
}

/// The areas, locked: a slice with the master at
/// [`LOCAL_IO`](crate::transfer_area::LOCAL_IO) and the extensions behind it.
///
/// Dropping it lets what was written go out with the next request, all of it or nothing.
pub struct TransferAreaGuard<'a> {
    shared: &'a Shared,
    areas: MutexGuard<'a, Vec<FishX1Transfer>>,
    /// The newest response that is in the areas.
    cycle: u64,
    /// The response for which the thread waited.
    reacts_to: Option<u64>,
    panicking: PanicCheck,
}

impl TransferAreaGuard<'_> {
    /// The newest response that needs no waiting for any more. One that came in while this thread
    /// did not expect it does: its window waits for somebody still.
    pub(super) fn attended(&self) -> u64 {
        let expected = self.reacts_to == Some(self.cycle);
        if expected {
            self.cycle
        } else {
            self.cycle.saturating_sub(1)
        }
    }
}

impl Deref for TransferAreaGuard<'_> {
    type Target = [FishX1Transfer];

    fn deref(&self) -> &Self::Target {
        &self.areas
    }
}

impl DerefMut for TransferAreaGuard<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.areas
    }
}

impl fmt::Debug for TransferAreaGuard<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.areas.iter()).finish()
    }
}

impl Drop for TransferAreaGuard<'_> {
    fn drop(&mut self) {
        // A panic may have left half of what belongs together in the areas.
        let areas = (!self.panicking.has_begun()).then_some(self.areas.as_slice());
        self.shared.release(areas, self.reacts_to);
    }
}

/// Tells a panic that began after this was made from one that was under way already, as when a
/// destructor uses the area while its thread unwinds.
#[derive(Debug)]
struct PanicCheck {
    before: bool,
}

impl PanicCheck {
    fn new() -> Self {
        Self { before: std::thread::panicking() }
    }

    fn has_begun(&self) -> bool {
        !self.before && std::thread::panicking()
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{catch_unwind, AssertUnwindSafe};

    use super::*;

    fn config_id(areas: &[FishX1Transfer]) -> u8 {
        areas[0].state.config_id
    }

    /// Panics before all of a new configuration is written.
    fn panic_half_way(area: &TransferArea) {
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            let mut areas = area.lock();
            areas[0].state.config_id = 2;
            panic!("before the configuration is written");
        }));
        panicked.unwrap_err();
    }

    #[test]
    fn what_a_panic_has_left_half_written_goes_out_by_no_other_guard_either() {
        let area = TransferArea::new(1);
        area.shared().begin(0);
        panic_half_way(&area);
        drop(area.lock());
        assert_eq!(config_id(&area.shared().outgoing()), 1);
        area.shared().finish(Err(Error::ProgramPanicked), &[FishX1Transfer::default()]);

        // What the program writes now is whole again.
        area.lock()[0].state.config_id = 3;
        assert_eq!(config_id(&area.shared().outgoing()), 3);
        area.shared().begin(0);
        area.lock()[0].state.config_id = 4;
        assert_eq!(config_id(&area.shared().outgoing()), 4);
    }
}
