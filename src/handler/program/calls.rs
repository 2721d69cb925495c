//! What the program's threads do with the state that they share with the transfer thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::camera::CameraControl;
use crate::error::Error;
use crate::handler::events::{Source, Step, Subscription};
use crate::handler::parts::area_lock::{name_of, Holder, Waiter};
use crate::handler::parts::clock::TransferClock;
use crate::handler::parts::state::Stop;
use crate::handler::program::lease::{Known, Lease, Purpose};
use crate::handler::shared::CameraCommand;
use crate::handler::shared::{Shared, State};
use crate::handler::sync::{current_thread, thread_id, wait_until, MutexGuard};
use crate::transfer_area::FishX1Transfer;

impl Shared {
    /// Locks the areas and brings them up to date.
    ///
    /// # Panics
    ///
    /// When the thread already has them.
    #[track_caller]
    pub(crate) fn lock(&self, known: Known) -> Lease {
        let mut state = self.state_of_others();
        let lease = self.take(&mut state, known, None);
        MutexGuard::unlock_fair(state);
        lease
    }

    /// Takes the areas, for a thread that may have waited for a window.
    pub(crate) fn take(
        &self,
        state: &mut MutexGuard<'_, State>,
        known: Known,
        reacts_to: Option<u64>,
    ) -> Lease {
        let areas = self.take_areas(state, reacts_to);
        let is_first = state.delivered > known.shown && state.last_response.is_some();
        let purpose = match reacts_to {
            Some(window) => Purpose::Reacts(window),
            None if is_first => Purpose::Looks,
            None => Purpose::Locks,
        };
        Lease::new(state, areas, known, purpose)
    }

    fn take_areas(
        &self,
        state: &mut MutexGuard<'_, State>,
        reacts_to: Option<u64>,
    ) -> (Vec<FishX1Transfer>, u64) {
        let waiter = if reacts_to.is_some() { Waiter::Reacting } else { Waiter::Other };
        let taken = self.wait_for_areas(state, waiter);
        if reacts_to.is_some_and(|window| state.window.is_open_for(window)) {
            let next = state.area_lock.arrive(Waiter::Reacting);
            self.wake_next(next);
        }
        taken
    }

    fn wait_for_areas(
        &self,
        state: &mut MutexGuard<'_, State>,
        waiter: Waiter,
    ) -> (Vec<FishX1Transfer>, u64) {
        if let Some(taken) = state.area_lock.try_take(waiter, Holder::now()) {
            return taken;
        }
        state.area_lock.wait(waiter);
        loop {
            // A hook that does not return must not keep them forever.
            let hook_hangs = state.hook.deadline();
            if wait_until(self.areas_free(waiter), state, hook_hangs) {
                self.give_up_hook(state);
            }
            if let Some(taken) = state.area_lock.take_promised(waiter, Holder::now()) {
                state.area_lock.waited(waiter);
                return taken;
            }
        }
    }

    /// Takes the areas back from a guard; after a panic as they were before it.
    pub(crate) fn release(&self, lease: &mut Lease, panicked: bool) {
        let mut areas = std::mem::take(&mut lease.areas);
        let mut state = self.state();
        // Others may have got new ones from a hook that did not return.
        if state.area_lock.is_current(lease.number) {
            if panicked {
                state.hand_over.restore(&mut areas);
                state.transfer.ask_to_stop(Stop::ProgramPanicked);
            } else {
                state.take_answer(lease, &areas);
            }
            let next = state.area_lock.put_back(areas, lease.number);
            self.wake_next(next);
            match lease.purpose {
                Purpose::Hook => state.hook.returned(thread_id()),
                Purpose::Reacts(window) => state.window.react(window),
                Purpose::Looks | Purpose::Locks => {}
            }
        }
        let goes_on = state.transfer.stop().is_some() || state.next_may_leave();
        // Otherwise a thread that locks again immediately would keep all others out.
        MutexGuard::unlock_fair(state);
        if goes_on {
            // Without the lock, which the transfer thread would be given here before it is awake: this thread,
            // which is about to wait again, would have to wait for it first.
            self.attended.notify_one();
        }
    }

    /// Adds a log of all cycles.
    pub(crate) fn add_log(&self, capacity: usize) -> Subscription {
        // Locked meanwhile, so that no beginning and no response comes between.
        let mut listeners = self.listeners.lock();
        let running = self.state().beginning();
        listeners.add_log(capacity, running)
    }

    /// The state, for a thread that is going to wait. Panics when this thread has the areas, because it
    /// would wait for itself forever.
    #[track_caller]
    pub(crate) fn state_of_others(&self) -> MutexGuard<'_, State> {
        let state = self.state();
        if !state.area_lock.is_held_by(thread_id()) {
            return state;
        }
        let held = state.area_lock.holder().map(Holder::held);
        drop(state);
        panic_of_holder(held.unwrap_or_default())
    }

    /// Waits for a response that is newer than the last one that the handle has returned, and locks the areas
    /// with its inputs; `None` when the deadline comes first.
    ///
    /// # Panics
    ///
    /// When the thread has the areas.
    #[track_caller]
    pub(crate) fn wait_cycle(
        &self,
        known: &mut Known,
        deadline: Option<Instant>,
    ) -> Result<Option<Lease>, Error> {
        let mut state = self.state_of_others();
        let response = self.wait_for_response(&mut state, known, deadline)?;
        let lease = response.map(|response| self.take(&mut state, *known, Some(response)));
        MutexGuard::unlock_fair(state);
        Ok(lease)
    }

    /// Locks the areas with the newest inputs. Waits only if there were none yet in this transfer. The rest
    /// is as for [`wait_cycle`](Self::wait_cycle). The next request waits for the calling thread, if it has
    /// not gone out yet.
    #[track_caller]
    pub(crate) fn look(
        &self,
        known: &mut Known,
        deadline: Option<Instant>,
    ) -> Result<Option<Lease>, Error> {
        let mut state = self.state_of_others();
        state.tell_news(known)?;
        state.check_running(known)?;
        if state.last_response.is_none() {
            drop(state);
            return self.wait_cycle(known, deadline);
        }
        let reacts_to = state.join_window();
        let lease = self.take(&mut state, *known, reacts_to);
        MutexGuard::unlock_fair(state);
        Ok(Some(lease))
    }

    /// The program is alive; returns an error that the handle has not been told yet.
    pub(crate) fn feed_watchdog(&self, known: &mut Known) -> Result<(), Error> {
        let mut state = self.state();
        state.watchdog.feed();
        state.tell_news(known)?;
        state.check_running(known)
    }

    /// The clock for time limits, with its current time.
    pub(crate) fn clock(&self) -> TransferClock {
        self.state().clock
    }

    /// How long the transfer has been running, or how long the last one ran.
    pub(crate) fn elapsed(&self) -> Duration {
        self.state().elapsed()
    }

    /// Whether a transfer is running.
    pub(crate) fn is_running(&self, known: &mut Known) -> bool {
        self.state().check_running(known).is_ok()
    }

    /// The handle's owner begins a transfer, so it knows that the last one has ended.
    pub(crate) fn acknowledge(&self, known: &mut Known) {
        known.interruptions = self.state().interruptions.count();
    }

    /// Asks the current transfer to end; returns its number, or that of the last one.
    pub(crate) fn ask_to_end(&self) -> u64 {
        let mut state = self.state();
        state.transfer.ask_to_stop(Stop::Asked);
        self.attended.notify_one();
        state.transfer.number()
    }

    /// The number of the current transfer, or of the last one.
    pub(crate) fn number(&self) -> u64 {
        self.state().transfer.number()
    }

    /// Waits while a thread connects for the transfer of this number.
    pub(crate) fn wait_until_begun(&self, number: u64) {
        let mut state = self.state();
        while state.transfer.is_beginning() && state.transfer.number() == number {
            self.arrived.wait(&mut state);
        }
    }

    /// The error that ended the last transfer, until the next begins.
    pub(crate) fn error(&self, known: &mut Known) -> Option<Error> {
        let state = self.state();
        state.check_running(known).err().and_then(|_| state.transfer.error())
    }

    /// Returns an error with the reason if no transfer is running.
    pub(crate) fn check_running(&self) -> Result<(), Error> {
        self.state().transfer.check_running()
    }

    /// Makes the transfer thread send a command, and waits until that is done, also across a gap.
    pub(crate) fn run_command(&self, command: CameraCommand) -> Result<(), Error> {
        let mut state = self.state();
        state.transfer.check_running()?;
        state.command = Some(command);
        if state.clock.is_lock_step() {
            self.attended.notify_one();
        }
        while state.command.is_some() && state.transfer.is_running() {
            self.arrived.wait(&mut state);
        }
        state.transfer.check_running()
    }

    /// Makes this stream end with the transfer; immediately if the transfer has already ended.
    pub(crate) fn set_camera(&self, camera: Arc<CameraControl>) {
        let mut state = self.state();
        if !state.transfer.is_running() {
            drop(state);
            return camera.stop();
        }
        if !state.transfer.is_exchanging() {
            // A gap has begun since the camera's server was started.
            camera.pause();
        }
        state.camera = Some(camera);
    }

    pub(crate) fn ask_to_stop(&self, stop: Stop) {
        self.state().transfer.ask_to_stop(stop);
        self.attended.notify_one();
    }
}

impl State {
    /// Takes what a guard leaves in the areas.
    fn take_answer(&mut self, lease: &Lease, areas: &[FishX1Transfer]) {
        let counts = lease.outputs_count && self.interruptions.count() == lease.interruptions;
        let reacts = match lease.purpose {
            Purpose::Hook | Purpose::Reacts(_) => true,
            Purpose::Looks => self.hand_over.differs(areas),
            Purpose::Locks => false,
        };
        if !self.window.note_answer(lease.newest) && reacts && self.transfer.stop().is_none() {
            self.statistics.late_reactions += 1;
        }
        self.hand_over.take(areas, counts);
        self.watchdog.feed();
    }

    /// Makes the next request wait for the calling thread, which is going to take the areas; returns the
    /// window's number, unless it is closed.
    pub(crate) fn join_window(&mut self) -> Option<u64> {
        let window = self.window.join()?;
        self.area_lock.expect_one_more();
        Some(window)
    }

    /// Returns as an error the next interruption that a handle has not been told.
    pub(crate) fn tell_news(&mut self, known: &mut Known) -> Result<(), Error> {
        let Some((number, error)) = self.interruptions.next_after(known.interruptions) else {
            return Ok(());
        };
        known.interruptions = number;
        self.watchdog.acknowledge(number);
        Err(error)
    }

    /// Returns an error with the reason if no transfer is running; the handle then knows it.
    pub(crate) fn check_running(&self, known: &mut Known) -> Result<(), Error> {
        self.transfer.check_running().inspect_err(|_| {
            if !self.transfer.is_beginning() {
                known.interruptions = self.interruptions.count();
            }
        })
    }
}

#[track_caller]
fn panic_of_holder(held: Duration) -> ! {
    panic!(
        "{} has had the transfer areas locked for {held:?} and locks them again, so it \
         would wait for itself forever; a guard lives until the end of its block, or of its whole \
         statement (also `match`, `if let` and `println!`): keep it in a variable and use that, or copy \
         the value that you need and drop the guard first",
        name_of(&current_thread()),
    )
}

/// A subscription belongs to the transfer.
impl Source for Arc<Shared> {
    fn panicked(&self) {
        self.ask_to_stop(Stop::ProgramPanicked);
    }

    fn step(&self) -> Step {
        Shared::step(self)
    }

    fn now(&self) -> Instant {
        self.clock().now()
    }
}
