//! The program's handle to the shared areas.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::guard::TransferAreaGuard;
use super::panic_check::PanicCheck;
use super::shared::Shared;
use super::state::Stop;
use super::statistics::Statistics;
use super::taken::{Known, Taken};
use crate::error::Error;

/// A handle to the areas of a [`TransferAreaComHandler`](super::TransferAreaComHandler), for
/// other threads than the one that owns it.
///
/// It may outlive the handler; the areas then keep their last state.
///
/// # When a thread panics
///
/// A panic stops the motors where it can be seen: in a thread that holds a guard, in a cycle hook, and in
/// a thread that owns the handler, a handle or a subscription to events, which the panic drops.
/// The transfer ends with
/// [`Error::ProgramPanicked`], because no other thread does the work of that thread, and what it wrote
/// under a guard that it held is undone. **A panic can't be seen** when a thread only shares a handle or
/// the handler with others, by reference or in an `Arc`, and panics while it holds no guard. So give each
/// thread a handle of its own (`handler.transfer_area()`, or a clone), and use the
/// [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) for the rest.
///
/// # Two controllers
///
/// Each controller has a handler of its own, and their responses come at independent times. A loop that
/// waits for one while it holds the guard of the other answers the other too late; one that waits for them
/// in turn misses responses. [`wait_any`](Self::wait_any) waits for the first response of any of them, and
/// [`lock`](Self::lock) gives the newest inputs of the other without a wait for a response. Or give each
/// controller a thread.
///
/// # When outputs count
///
/// The end of a transfer, a lost connection and the watchdog set all outputs to 0. From then on, until
/// the exchange goes on, what is written through a handle counts only if the handle knows of this:
///
/// - by an error from any of its calls that wait, or from [`feed_watchdog`](Self::feed_watchdog),
/// - by `false` from [`is_running`](Self::is_running), or any call of [`error`](Self::error) after the end,
/// - for the handler itself also by `end_transfer` and `begin_transfer`.
///
/// What is written through other handles meanwhile is thrown away. What one thread learns counts for all
/// threads that share its handle, which is another reason to give each thread its own. So what was written
/// for the time before moves no motor afterwards, and a program that polls reads 0 from its outputs while
/// they are not sent. After the end the timers and the inputs do not change. A configuration always counts.
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
    known: AtomicKnown,
    panicking: PanicCheck,
}

/// What a handle knows. Threads that share the handle share this.
#[derive(Debug, Default)]
struct AtomicKnown {
    returned: AtomicU64,
    shown: AtomicU64,
    interruptions: AtomicU64,
}

impl AtomicKnown {
    fn get(&self) -> Known {
        Known {
            returned: self.returned.load(Ordering::Relaxed),
            shown: self.shown.load(Ordering::Relaxed),
            interruptions: self.interruptions.load(Ordering::Relaxed),
        }
    }
}

impl TransferArea {
    pub(super) fn new(shared: Arc<Shared>) -> Self {
        Self { shared, known: AtomicKnown::default(), panicking: PanicCheck::new() }
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Stops the transfer if the thread has begun to panic since it got this handle.
    pub(super) fn stop_on_panic(&self) {
        if self.panicking.has_begun() {
            self.shared.ask_to_stop(Stop::ProgramPanicked);
        }
    }

    /// Makes a call that tells this handle what it does not know yet, and stores what it knows then.
    pub(super) fn learn<R>(&self, call: impl FnOnce(&mut Known) -> R) -> R {
        let mut known = self.known.get();
        let result = call(&mut known);
        self.has_learned(known);
        result
    }

    /// Stores what a call has told this handle.
    pub(super) fn has_learned(&self, known: Known) {
        self.known.interruptions.fetch_max(known.interruptions, Ordering::Relaxed);
    }

    /// [`Shared::wait_cycle`], so that a panic names the program's line.
    #[track_caller]
    pub(super) fn wait_for_next(
        &self,
        mut known: Known,
        deadline: Option<Instant>,
    ) -> Result<Option<Taken>, Error> {
        let result = self.shared.wait_cycle(&mut known, deadline);
        self.has_learned(known);
        result
    }

    /// What this handle knows.
    pub(super) fn known(&self) -> Known {
        self.known.get()
    }

    /// Locks the areas, with the newest inputs in them.
    ///
    /// Works before, during and after a transfer. Blocks while another thread holds a guard; waiting threads
    /// get the areas one after the other. Meanwhile the exchange goes on with what the last guard left in the
    /// areas; inputs that come in while a guard is held are in the areas at the next lock. A guard that is
    /// forgotten (`mem::forget`) keeps the areas locked for ever.
    ///
    /// # Panics
    ///
    /// When this thread already holds a guard, because it would wait for itself for ever. This stops the
    /// motors, as [any panic under a guard](Self#when-a-thread-panics) does. A guard lives until the end
    /// of its block, or of the statement that locks: `match handler.lock()[0].input.uni[0] { … }` and
    /// `println!` hold it until their end.
    #[must_use = "the areas are locked only as long as the guard lives"]
    #[track_caller]
    pub fn lock(&self) -> TransferAreaGuard<'_> {
        self.guard(self.shared.lock(self.known.get()))
    }

    /// Waits for the next response and returns the areas locked, with its inputs in them.
    ///
    /// What is written under this guard goes out in the very next request, if the guard is
    /// dropped within the reaction window. When all threads that waited for the response have
    /// dropped their guards, the request goes out immediately. A call within the window returns the
    /// response that opened it, unless this handle has returned it before.
    ///
    /// Blocks until a response comes in or the transfer ends, so at most as long as the transfer's
    /// time limits, its reaction window and its [limit for
    /// reconnecting](crate::TransferAreaComHandlerBuilder::reconnect) allow; then as long as another
    /// thread holds a guard.
    ///
    /// # Errors
    ///
    /// [`Error::NotStarted`] without a transfer, or the error that ended it. [`Error::ConnectionLost`]
    /// and [`Error::WatchdogExpired`] come once to each handle for each time that the outputs were stopped;
    /// the transfer goes on, and the program can go on, too.
    ///
    /// # Panics
    ///
    /// When this thread holds a guard, as [`lock`](Self::lock).
    #[track_caller]
    pub fn wait_cycle(&self) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait(None)
    }

    /// Does the same as [`wait_cycle`](Self::wait_cycle), but does not wait longer than `limit`;
    /// [`Duration::MAX`] is no limit.
    ///
    /// The lock itself may take longer when another thread holds a guard.
    ///
    /// # Errors
    ///
    /// [`Error::WaitTimedOut`] when no response came in time; the transfer goes on. Otherwise as
    /// `wait_cycle`.
    ///
    /// # Panics
    ///
    /// When this thread holds a guard, as [`lock`](Self::lock).
    #[track_caller]
    pub fn wait_cycle_for(&self, limit: Duration) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait(Some(limit))
    }

    #[track_caller]
    fn wait(&self, limit: Option<Duration>) -> Result<TransferAreaGuard<'_>, Error> {
        let deadline = limit.and_then(|limit| self.shared.clock().deadline_after(limit));
        let taken = self.wait_for_next(self.known(), deadline)?;
        let timed_out = || Error::WaitTimedOut { limit: limit.unwrap_or_default() };
        let guard = self.guard(taken.ok_or_else(timed_out)?);
        self.note_returned(guard.window());
        Ok(guard)
    }

    /// Stores that a wait of this handle has returned a guard of this window. Another thread that shares the
    /// handle may have returned a newer one meanwhile.
    pub(super) fn note_returned(&self, window: u64) {
        self.known.returned.fetch_max(window, Ordering::Relaxed);
    }

    /// The guard of areas that this thread has taken.
    pub(super) fn guard(&self, taken: Taken) -> TransferAreaGuard<'_> {
        self.known.shown.fetch_max(taken.newest, Ordering::Relaxed);
        TransferAreaGuard::new(&self.shared, taken)
    }

    /// Waits until the controller has the configuration that the areas hold now.
    ///
    /// A configuration goes out by itself when its `config_id` changes; this only waits for that.
    /// Blocks for two responses, as [`wait_cycle`](Self::wait_cycle) does for one.
    ///
    /// # Errors
    ///
    /// As [`wait_cycle`](Self::wait_cycle).
    ///
    /// # Panics
    ///
    /// When this thread holds a guard, as [`lock`](Self::lock).
    #[doc(alias = "UpdateConfig")]
    #[track_caller]
    pub fn update_config(&self) -> Result<(), Error> {
        // The current request may have left before the last change; the one after it goes out
        // after the configuration.
        for _ in 0..2 {
            drop(self.wait_cycle()?);
        }
        Ok(())
    }

    /// Tells the [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) that the program is alive,
    /// and returns what the program does not know yet. Does not wait. For programs that poll, also without a
    /// watchdog.
    ///
    /// # Errors
    ///
    /// [`Error::WatchdogExpired`] and [`Error::ConnectionLost`], once to each handle each time: all
    /// outputs were set to 0; set them again and go on. [`Error::NotStarted`] without a transfer, or the
    /// error that ended it.
    pub fn feed_watchdog(&self) -> Result<(), Error> {
        self.learn(|known| self.shared.feed_watchdog(known))
    }

    /// Whether a transfer is running: from `begin_transfer` until it ends, by `end_transfer` or by an error,
    /// which [`error`](Self::error) then returns. Also while a lost connection is made again.
    #[doc(alias = "ftxIsTransferActiv")]
    #[doc(alias = "MotorIOLib_ThreadIsRunning")]
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.learn(|known| self.shared.is_running(known))
    }

    /// The error that ended the last transfer, until the next `begin_transfer`.
    pub fn error(&self) -> Option<Error> {
        self.learn(|known| self.shared.error(known))
    }

    /// Statistics of the current transfer, or of the last one.
    pub fn statistics(&self) -> Statistics {
        self.shared.statistics()
    }
}

/// The clone knows what this handle knows.
impl Clone for TransferArea {
    fn clone(&self) -> Self {
        let Known { returned, shown, interruptions } = self.known.get();
        let known = AtomicKnown {
            returned: returned.into(),
            shown: shown.into(),
            interruptions: interruptions.into(),
        };
        Self { shared: Arc::clone(&self.shared), known, panicking: PanicCheck::new() }
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

#[cfg(all(test, not(shuttle)))]
mod tests {
    use crate::TransferAreaComHandler;

    #[test]
    fn a_wait_that_ends_late_does_not_make_a_newer_response_new_again() {
        let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
        let area = handler.transfer_area();
        area.note_returned(2);
        // Of another thread that shares the handle.
        area.note_returned(1);
        assert_eq!(area.known().returned, 2);
    }
}
