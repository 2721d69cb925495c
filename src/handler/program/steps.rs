//! What the program's threads do with the state that they share with the transfer thread.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crate::camera::CameraControl;
use crate::error::Error;
use crate::handler::long_guard::name_of;
use crate::handler::parts::camera_work::CameraCommand;
use crate::handler::parts::phase::Stop;
use crate::handler::parts::tickets::{Stage, TicketId};
use crate::handler::program::known::Known;
use crate::handler::shared::Shared;
use crate::handler::state::{Lease, State};
use crate::handler::sync::{current_thread, now, thread_id, wait_until, MutexGuard};

/// How long setting and clearing a cycle hook waits for the one before. The models' time moves at random.
const PATIENCE: Duration =
    if cfg!(all(test, shuttle)) { Duration::MAX } else { Duration::from_millis(500) };

/// How long the last exchange may take before a second panic aborts the program.
const LAST_EXCHANGE: Duration =
    if cfg!(all(test, shuttle)) { Duration::MAX } else { Duration::from_secs(3) };

impl Shared {
    /// Locks the areas and brings them up to date.
    ///
    /// # Panics
    ///
    /// When the thread already has them.
    #[track_caller]
    pub(crate) fn lock(&self, known: Known) -> Lease {
        let mut state = self.state_of_others();
        let ticket = state.queue();
        loop {
            if let Some(lease) = state.take(ticket, known) {
                MutexGuard::unlock_fair(state);
                return lease;
            }
            self.waker(ticket).wait(&mut state);
        }
    }

    /// The state, for a thread that is going to wait. Panics when this thread has the areas, because it
    /// would wait for itself forever.
    #[track_caller]
    pub(crate) fn state_of_others(&self) -> MutexGuard<'_, State> {
        let state = self.state();
        match state.held_by(thread_id()) {
            None => state,
            Some(since) => {
                let held = now() - since;
                self.end_before_abort(state);
                panic_of_holder(held)
            }
        }
    }

    /// The same for a thread that is going to wait for a response: the hook would wait for its own call.
    #[track_caller]
    fn state_to_wait(&self) -> MutexGuard<'_, State> {
        let state = self.state_of_others();
        let is_called = state.tickets.is_called(thread_id());
        if is_called {
            self.end_before_abort(state);
            panic!(
                "the cycle hook waits for a response in its own call, which would wait for itself; \
                 return, and the hook is called with the response"
            );
        }
        state
    }

    /// This thread is going to panic. When it already does, that aborts the program, and nothing more is dropped: so
    /// its motors are stopped here.
    fn end_before_abort(&self, mut state: MutexGuard<'_, State>) {
        if !thread::panicking() {
            return;
        }
        state.transfer.ask_to_stop(Stop::ProgramPanicked);
        self.attended.notify_one();
        let deadline = now().checked_add(LAST_EXCHANGE);
        while state.transfer.is_running() {
            if wait_until(&self.changed, &mut state, deadline) {
                break;
            }
        }
    }

    /// Takes the areas back from a guard; after a panic as they were before it.
    pub(crate) fn release(&self, lease: &mut Lease, panicked: bool) {
        let mut state = self.state();
        state.put_back(lease, panicked);
        self.wake_first(&state);
        let goes_on = state.transfer.stop().is_some() || state.next_may_leave();
        // Otherwise a thread that locks again immediately would keep all others out.
        MutexGuard::unlock_fair(state);
        if goes_on {
            // Without the lock, which the transfer thread would be given here before it is awake: this thread,
            // which is about to wait again, would have to wait for it first.
            self.attended.notify_one();
        }
    }

    /// Waits for a response that comes `after` this one, and locks the areas with its inputs; `None` when the deadline
    /// comes first.
    ///
    /// # Panics
    ///
    /// When the thread has the areas.
    #[track_caller]
    pub(crate) fn wait_cycle(
        &self,
        known: &mut Known,
        after: u64,
        deadline: Option<Instant>,
    ) -> Result<Option<Lease>, Error> {
        let mut state = self.state_to_wait();
        let ticket = state.begin_wait(known, after)?;
        if !self.wait_for_response(&mut state, ticket, known, deadline)? {
            return Ok(None);
        }
        self.take(state, ticket, known).map(Some)
    }

    /// Locks the areas with the newest inputs. Waits only if there were none yet on this connection. The rest
    /// is as for [`wait_cycle`](Self::wait_cycle). The next request waits for the calling thread, if it has
    /// not gone out yet.
    #[track_caller]
    pub(crate) fn look(
        &self,
        known: &mut Known,
        deadline: Option<Instant>,
    ) -> Result<Option<Lease>, Error> {
        let mut state = self.state_to_wait();
        match state.queue_to_look(known)? {
            Some(ticket) => self.take(state, ticket, known).map(Some),
            None => {
                drop(state);
                self.wait_cycle(known, known.returned, deadline)
            }
        }
    }

    /// Takes the areas for a thread that has a response, unless it is interrupted before.
    fn take(
        &self,
        mut state: MutexGuard<'_, State>,
        ticket: TicketId,
        known: &mut Known,
    ) -> Result<Lease, Error> {
        loop {
            if let Some(lease) = state.take(ticket, *known) {
                MutexGuard::unlock_fair(state);
                return Ok(lease);
            }
            if let Some(Stage::Interrupted) = state.tickets.stage(ticket) {
                return Err(self.interrupted(&mut state, ticket, known));
            }
            self.waker(ticket).wait(&mut state);
        }
    }

    /// Waits for a response; returns whether it came before the deadline. Otherwise the ticket is gone.
    fn wait_for_response(
        &self,
        state: &mut MutexGuard<'_, State>,
        ticket: TicketId,
        known: &mut Known,
        deadline: Option<Instant>,
    ) -> Result<bool, Error> {
        if self.lock_step {
            self.attended.notify_one();
        }
        // In lock-step only responses move the time.
        let by_clock = deadline.filter(|_| !self.lock_step);
        let mut timed_out = false;
        loop {
            match state.tickets.stage(ticket) {
                Some(Stage::Wants { .. }) if !state.is_too_late(deadline) => return Ok(true),
                Some(Stage::Waiting) if !timed_out => {
                    timed_out = wait_until(self.waker(ticket), state, by_clock);
                }
                Some(Stage::Interrupted) => return Err(self.interrupted(state, ticket, known)),
                _ => {
                    self.leave_line(state, ticket);
                    return Ok(false);
                }
            }
        }
    }

    /// In lock-step, for a listener: waits until more has happened than was `seen`. Does not wait without a transfer, and
    /// returns whether there is one.
    pub(crate) fn step(&self, mut seen: Known) -> bool {
        let mut state = self.state_to_wait();
        if !state.transfer.is_running() {
            return false;
        }
        if let Some(ticket) = state.begin_step(seen) {
            // An error comes as an event, too.
            if let Ok(true) = self.wait_for_response(&mut state, ticket, &mut seen, None) {
                self.leave_line(&mut state, ticket);
            }
        }
        true
    }

    /// The thread does not wait any more, and answers nothing.
    fn leave_line(&self, state: &mut State, ticket: TicketId) {
        state.tickets.remove(ticket);
        self.make_way(state);
    }

    /// A thread does not want the areas any more: another one may be first, or the request may leave.
    fn make_way(&self, state: &State) {
        self.wake_first(state);
        if state.next_may_leave() {
            self.attended.notify_one();
        }
    }

    /// The error for which a wait is over.
    fn interrupted(&self, state: &mut State, ticket: TicketId, known: &mut Known) -> Error {
        self.leave_line(state, ticket);
        // Without one, another transfer has begun meanwhile.
        state.report(known).err().unwrap_or(Error::NotStarted)
    }

    /// The program is alive; returns an error that the handle does not know yet.
    pub(crate) fn feed_watchdog(&self, known: &mut Known) -> Result<(), Error> {
        let mut state = self.state();
        state.feed_watchdog();
        state.report(known)
    }

    /// Asks the current transfer to end; returns its number, or that of the last one.
    pub(crate) fn ask_to_stop(&self, stop: Stop) -> u64 {
        let mut state = self.state();
        state.transfer.ask_to_stop(stop);
        self.attended.notify_one();
        state.transfer.number()
    }

    /// Waits while a thread connects for the transfer of this number.
    pub(crate) fn wait_until_begun(&self, number: u64) {
        let mut state = self.state();
        while state.transfer.is_beginning() && state.transfer.number() == number {
            self.changed.wait(&mut state);
        }
    }

    /// This thread begins to start or stop the camera. In lock-step, a thread that has the areas may wait for another
    /// one's command now.
    pub(crate) fn come_to_camera(&self) {
        self.state().camera.come(thread_id());
        self.attended.notify_one();
    }

    /// The thread has started or stopped the camera.
    pub(crate) fn leave_camera(&self) {
        self.state().camera.go(thread_id());
    }

    /// Makes the transfer thread send a command, and waits until that is done, also across a gap.
    pub(crate) fn run_command(&self, command: CameraCommand) -> Result<(), Error> {
        let mut state = self.state();
        state.transfer.check_running()?;
        let number = state.transfer.number();
        state.camera.ask(command);
        if self.lock_step {
            self.attended.notify_one();
        }
        let goes_on =
            |state: &State| state.transfer.is_running() && state.transfer.number() == number;
        while state.camera.is_asked() && goes_on(&state) {
            self.changed.wait(&mut state);
        }
        if goes_on(&state) {
            return Ok(());
        }
        // Another transfer may have begun meanwhile.
        state.transfer.check_running().and(Err(Error::NotStarted))
    }

    /// Makes this stream end with the transfer; immediately if the transfer has already ended.
    pub(crate) fn set_camera(&self, stream: Arc<CameraControl>) {
        let mut state = self.state();
        if !state.transfer.is_running() {
            stream.stop();
        } else if !state.transfer.is_exchanging() {
            // A gap has begun since the camera's server was started.
            stream.pause();
        }
        state.camera.stream = Some(stream);
    }

    /// Sets another hook or none, and waits until the threads of earlier ones have ended, unless this is one.
    /// Returns the ticket of the new one, and what it knows.
    pub(crate) fn replace_hook(&self, set: bool) -> Option<(TicketId, Known)> {
        let mut state = self.state();
        if let Some(before) = state.tickets.clear_hook() {
            self.wake(before);
        }
        let set = set.then(|| (state.tickets.set_hook(), state.known_to_new_hook()));
        // It has a limit from now on.
        self.attended.notify_one();
        let newest = state.tickets.newest();
        let deadline = now().checked_add(PATIENCE);
        while state.tickets.has_hook_before(newest, thread_id()) {
            if wait_until(&self.changed, &mut state, deadline) {
                break;
            }
        }
        set
    }

    /// The hook does not want the areas any more, or its thread has ended: the next hook may begin.
    pub(crate) fn hook_makes_way(&self, state: &State) {
        self.changed.notify_all();
        state.tickets.hook().into_iter().for_each(|next| self.wake(next));
        self.make_way(state);
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
