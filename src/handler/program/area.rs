//! The program's handle to the shared areas.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use crate::error::Error;
use crate::events::EventKind;
use crate::handler::events::{CycleLog, Events};
use crate::handler::parts::phase::Stop;
use crate::handler::program::guard::TransferAreaGuard;
use crate::handler::program::known::{AtomicKnown, Known};
use crate::handler::shared::Shared;
use crate::handler::state::Lease;
use crate::handler::sync::PanicCheck;
use crate::statistics::Statistics;
use crate::terminals::Motor;

/// A handle to the areas of a [`TransferAreaComHandler`](crate::TransferAreaComHandler), for
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
/// thread a handle of its own (`handler.areas().clone()`, or a clone), and use the
/// [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) for the rest.
///
/// # Two controllers
///
/// Each controller has a handler of its own, and their responses come at independent times. A loop that
/// waits for one while it holds the guard of the other answers the other too late; one that waits for them
/// in turn misses responses. So give each controller a thread; in it, [`lock`](Self::lock) of the other's handle
/// reads and writes there without a wait for a response. Threads that hold guards of several controllers must lock
/// them in the same order.
///
/// # When outputs count
///
/// The end of a transfer, a lost connection and the watchdog set all outputs to 0. From then on, until
/// the exchange goes on, or after the watchdog until one handle knows, what is written through a handle counts only if
/// the handle knows of this:
///
/// - by an error from any of its calls that wait, or from [`feed_watchdog`](Self::feed_watchdog),
/// - by `false` from [`is_running`](Self::is_running), or any call of [`error`](Self::error) after the end,
/// - for the handler itself also by `end_transfer` and `begin_transfer`.
///
/// What is written through other handles meanwhile is discarded. What one thread learns counts for all
/// threads that share its handle, which is another reason to give each thread its own. So what was written
/// for the time before moves no motor afterwards, and a program that polls reads 0 from its outputs while
/// they are not sent. After the end the timers and the inputs do not change. A configuration always counts.
///
/// ```
/// use ft_transfer_area::prelude::*;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.7.2").build()?;
/// let areas = handler.areas();
/// let others = areas.clone();
/// std::thread::spawn(move || others.lock()[LOCAL_IO].output.duty[O1] = 512).join().unwrap();
/// assert_eq!(areas.lock()[LOCAL_IO].output.duty[O1], 512);
/// # Ok(())
/// # }
/// ```
pub struct TransferAreas {
    shared: Arc<Shared>,
    /// What this handle knows.
    pub(super) known: AtomicKnown,
    panicking: PanicCheck,
}

impl TransferAreas {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        Self { shared, known: AtomicKnown::default(), panicking: PanicCheck::new() }
    }

    pub(crate) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Stops the transfer if the thread has begun to panic since it got this handle.
    pub(crate) fn stop_on_panic(&self) {
        if self.panicking.has_begun() {
            self.shared.ask_to_stop(Stop::ProgramPanicked);
        }
    }

    /// Makes a call from which this handle learns what it does not know yet, and stores what it knows then.
    #[track_caller]
    pub(crate) fn learn<R>(&self, call: impl FnOnce(&mut Known) -> R) -> R {
        let mut known = self.known.get();
        let result = call(&mut known);
        self.known.learn(known);
        result
    }

    /// The guard of areas that this thread has taken.
    pub(crate) fn guard(&self, lease: Lease) -> TransferAreaGuard<'_> {
        self.known.learn(Known { shown: lease.response, ..Known::default() });
        TransferAreaGuard::new(&self.shared, lease)
    }

    /// The guard that a wait returns: the next wait waits for a newer response.
    pub(crate) fn returned(&self, lease: Lease) -> TransferAreaGuard<'_> {
        self.known.learn(Known { returned: lease.response, ..Known::default() });
        self.guard(lease)
    }

    /// Locks the areas, with the newest inputs in them.
    ///
    /// Works before, during and after a transfer. Blocks while another thread holds a guard; waiting threads
    /// get the areas one after the other. Meanwhile the exchange goes on with what the last guard left in the
    /// areas; inputs that come in while a guard is held are in the areas at the next lock. A guard that is
    /// forgotten (`mem::forget`) keeps the areas locked forever.
    ///
    /// # Panics
    ///
    /// When this thread already holds a guard, because it would wait for itself forever. This stops the
    /// motors, as [any panic under a guard](Self#when-a-thread-panics) does. A guard lives until the end
    /// of its block, or of the statement that locks: `match areas.lock()[0].input.uni[I1] { … }` and
    /// `println!` hold it until their end.
    #[doc(alias = "GetTransferAreasArrayAddr")]
    #[doc(alias = "GetKeLibTransferAreaMainAddress")]
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
    /// thread holds a guard, unless the outputs are stopped meanwhile or the transfer ends.
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
    #[doc(alias = "PrgTic")]
    #[track_caller]
    pub fn wait_cycle(&self) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait(None)
    }

    /// Does the same as [`wait_cycle`](Self::wait_cycle), but does not wait longer than `limit`;
    /// [`Duration::MAX`] means no limit.
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
        let deadline = limit.and_then(|limit| self.shared.state().clock.deadline_after(limit));
        let mut known = self.known.get();
        // Not in a closure, so that a panic names the program's line.
        let after = known.returned;
        let lease = self.shared.wait_cycle(&mut known, after, deadline);
        self.known.learn(known);
        let timed_out = || Error::WaitTimedOut { limit: limit.unwrap_or_default() };
        Ok(self.returned(lease?.ok_or_else(timed_out)?))
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

    /// Asks the transfer to end, with all motors stopped by a last exchange, and does not wait for that:
    /// [`end_transfer`](crate::TransferAreaComHandler::end_transfer) does. For a thread that must not wait, and for a
    /// value that waits when it is dropped: it calls this before. Does nothing without a transfer.
    pub fn ask_to_end(&self) {
        self.stop_on_panic();
        self.shared.ask_to_stop(Stop::Asked);
    }

    /// Whether a transfer is running: from `begin_transfer` until it ends, by `end_transfer` or by an error,
    /// which [`error`](Self::error) then returns. Also while a lost connection is being re-established.
    #[doc(alias = "ftxIsTransferActiv")]
    #[doc(alias = "MotorIOLib_ThreadIsRunning")]
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.learn(|known| self.shared.state().check_running(known)).is_ok()
    }

    /// The error that ended the last transfer, until the next `begin_transfer`.
    pub fn error(&self) -> Option<Error> {
        self.learn(|known| {
            let state = self.shared.state();
            state.check_running(known).err().and_then(|_| state.transfer.error())
        })
    }

    /// Statistics of the current transfer, or of the last one.
    #[doc(alias = "GetTrapStatistic")]
    pub fn statistics(&self) -> Statistics {
        self.shared.state().statistics
    }
}

/// The clone knows what this handle knows.
impl Clone for TransferAreas {
    fn clone(&self) -> Self {
        let known = self.known.clone();
        Self { shared: Arc::clone(&self.shared), known, panicking: PanicCheck::new() }
    }
}

impl fmt::Debug for TransferAreas {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TransferAreas").field("statistics", &self.statistics()).finish()
    }
}

impl Drop for TransferAreas {
    fn drop(&mut self) {
        self.stop_on_panic();
    }
}

impl TransferAreas {
    /// Subscribes to events of these kinds, on a channel that holds up to `capacity` of them,
    /// 1..=[`Events::MAX_CAPACITY`]. This replaces FtTxtLib's callbacks; see [`Event`](crate::Event).
    ///
    /// Events come for changes after this call, from a response or from the state of the transfer. An event
    /// comes after the change is in the areas: a listener that locks them finds it there, and what it writes
    /// within the reaction window goes out in the next request. Threads in
    /// [`wait_cycle`](Self::wait_cycle) that are done sooner end the window sooner, so to answer
    /// immediately, wait there instead.
    ///
    /// The transfer thread does not wait for a listener. While the channel is full, new events are
    /// dropped and [counted](Events::lost); those in it stay, in order.
    ///
    /// [`Event::TransferEnded`](crate::Event::TransferEnded) comes to every listener, also to one that has
    /// not asked for it, so that no loop waits forever. There is one more place for it in the channel: it
    /// comes even when the channel is full, unless that of an earlier transfer is still in it.
    ///
    /// If the handler was already dropped, the channel has ended.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        Error::check_range("capacity for events", capacity, 1..=Events::MAX_CAPACITY as i64)?;
        Ok(Events::new(Arc::clone(&self.shared), kinds, capacity))
    }

    /// Logs every cycle from now on, for a recorder: each request with the response to it, and the beginnings,
    /// gaps and ends of transfers. The channel holds up to `capacity` cycles, 1..=[`CycleLog::MAX_CAPACITY`],
    /// each of about 4 kB; a few other entries have more room.
    ///
    /// The transfer thread does not wait for a log, and allocates nothing for a cycle. While the channel is
    /// full, new entries are lost; the next one that fits [says how many](crate::LogEntry::lost).
    ///
    /// If a transfer is running, the first entry is its beginning. If the handler was already dropped, the
    /// channel has ended.
    ///
    /// ```
    /// use ft_transfer_area_simulator::SimulatedTxt;
    /// use ft_transfer_area::prelude::*;
    /// use ft_transfer_area::Logged;
    ///
    /// # fn run() -> Result<(), Box<dyn std::error::Error>> {
    /// let txt = SimulatedTxt::builder().start()?;
    /// let handler = TransferAreaComHandler::builder(txt.address().to_string()).build()?;
    /// let areas = handler.areas();
    /// let log = areas.cycle_log(500)?; // five seconds
    /// handler.begin_transfer()?;
    /// areas.wait_cycle()?.iter_mut().for_each(|area| area.output.duty[O1] = 512);
    /// handler.end_transfer()?;
    /// drop(handler);
    ///
    /// let entries: Vec<Logged> = log.map(|entry| entry.what).collect();
    /// let Some(Logged::Began(began)) = entries.first() else { panic!("it begins so") };
    /// assert_eq!(began.device_name, "TX2013");
    /// let cycles = entries.iter().filter(|entry| matches!(entry, Logged::Cycle(_)));
    /// assert!(cycles.count() >= 2, "the last one stops the motors");
    /// # Ok(())
    /// # }
    /// # run().unwrap();
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    pub fn cycle_log(&self, capacity: usize) -> Result<CycleLog, Error> {
        Error::check_range("capacity for a log", capacity, 1..=CycleLog::MAX_CAPACITY as i64)?;
        Ok(CycleLog::new(Arc::clone(&self.shared), capacity))
    }

    /// Sends [`Event::MotorStalled`](crate::Event::MotorStalled) when a motor should turn but its counter does
    /// not change for `limit`. With [`Duration::MAX`], the default, this event is never sent.
    ///
    /// This is for motors with an encoder at the counter of the same number; for others an unchanged counter
    /// means nothing. The time is measured between responses, and starts with the response to the first
    /// request that makes the motor turn. Choose a limit above the time that the motor needs to start, about
    /// 100 ms; zero sends it with that response. The limit is the same for all
    /// listeners, and stays for later transfers. It is checked only while there is a listener for this kind
    /// of event.
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use ft_transfer_area::prelude::*;
    /// use ft_transfer_area::{Event, EventKind};
    ///
    /// /// Drives M1 against its stop, which has no switch; returns whether it got there in time.
    /// fn drive_to_stop(areas: &TransferAreas) -> Result<bool, Error> {
    ///     areas.set_stall_limit(LOCAL_IO, M1, Duration::from_millis(300))?;
    ///     let events = areas.events(&[EventKind::MotorStalled, EventKind::TransferEnded], 10)?;
    ///     areas.lock()[LOCAL_IO].output.duty[O1] = 200;
    ///     let received = events.recv_timeout(Duration::from_secs(10));
    ///     areas.lock()[LOCAL_IO].output.duty[O1] = 0;
    ///     Ok(received.is_ok_and(|received| matches!(received.event, Event::MotorStalled { .. })))
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist.
    pub fn set_stall_limit(&self, area: usize, motor: Motor, limit: Duration) -> Result<(), Error> {
        self.check_area(area)?;
        self.shared().listeners.lock().set_stall_limit(area, motor, limit);
        Ok(())
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::Known;
    use crate::TransferAreaComHandler;

    #[test]
    fn a_wait_that_ends_late_does_not_make_a_newer_response_new_again() {
        let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
        let area = handler.areas().clone();
        area.known.learn(Known { returned: 2, ..Known::default() });
        // Of another thread that shares the handle.
        area.known.learn(Known { returned: 1, ..Known::default() });
        assert_eq!(area.known.get().returned, 2);
    }
}
