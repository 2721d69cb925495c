//! The cycle hook's turns, and the thread that it runs in.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::area_lock::Holder;
use super::hook_slot::Begun;
use super::shared::{Shared, State};
use super::state::Stop;
use super::sync::{earlier, thread_id, wait_until};
use super::taken::Taken;
use crate::error::Error;

/// The transfer thread's side of the hook: gives it a turn in each cycle, and goes on without it when
/// it does not return.
pub(super) struct HookThread {
    shared: Arc<Shared>,
    /// How long the reaction window lasts.
    window: Duration,
    /// How long the hook may take.
    limit: Duration,
    /// Started for the first turn.
    thread: Option<JoinHandle<()>>,
}

impl HookThread {
    pub(super) fn new(shared: Arc<Shared>, window: Duration, limit: Duration) -> Self {
        Self { shared, window, limit, thread: None }
    }

    /// Calls the hook, if there is one, with the areas and the response that has just come in, and
    /// waits until it has returned.
    ///
    /// While another thread has the areas, the turn is put off until the reaction window ends. When the
    /// watchdog expires first, the transfer goes on while the hook runs.
    pub(super) fn take_turn(&mut self) -> Result<(), Error> {
        self.start()?;
        if self.give_turn() {
            self.wait_until_done(true);
        }
        Ok(())
    }

    /// Starts the thread if there is a hook and no thread yet.
    fn start(&mut self) -> Result<(), Error> {
        if self.thread.is_some() || !self.shared.state().hook.is_ready() {
            return Ok(());
        }
        let number = self.shared.state().hook.start();
        let shared = Arc::clone(&self.shared);
        let thread = std::thread::Builder::new()
            .name("cycle-hook".to_owned())
            .spawn(move || serve(&shared, number))
            .map_err(Error::not_started)?;
        self.thread = Some(thread);
        Ok(())
    }

    /// Gives the hook a turn, if there is a hook and it gets the areas; returns whether it did.
    fn give_turn(&self) -> bool {
        let shared = &*self.shared;
        let mut state = shared.state();
        if let Some(since) = state.hook.busy_since() {
            self.check_limit(&mut state, since);
            state.statistics.late_reactions += 1;
            return false;
        }
        if !state.hook.is_ready() {
            return false;
        }
        let end = state.window_end(self.window);
        let mut is_over = false;
        while state.transfer.stop().is_none() {
            let holder = Holder { thread: thread_id(), since: Instant::now() };
            if let Some((mut areas, turn)) = state.area_lock.take_for_hook(holder) {
                let elapsed = state.elapsed();
                state.hand_over.bring_up_to_date(&mut areas, elapsed);
                state.hook.call(areas, turn);
                // Not earlier, because the program could not do anything before the response.
                state.watchdog.feed();
                shared.hook_turn.notify_all();
                return true;
            }
            if is_over {
                state.statistics.late_reactions += 1;
                break;
            }
            let deadline = earlier(end, state.watchdog.deadline());
            is_over = wait_until(&shared.attended, &mut state, deadline);
        }
        let next = state.area_lock.pass_hook();
        shared.wake_next(&state, next);
        false
    }

    /// Waits until the hook has returned, or its limit is over; if `watched`, only until the watchdog expires.
    fn wait_until_done(&self, watched: bool) {
        let shared = &*self.shared;
        let mut state = shared.state();
        while let Some(since) = state.hook.busy_since() {
            let end = since.checked_add(self.limit);
            let deadline = if watched { earlier(end, state.watchdog.deadline()) } else { end };
            if !wait_until(&shared.attended, &mut state, deadline) {
                continue;
            }
            if state.hook.busy_since().is_some() {
                self.check_limit(&mut state, since);
            }
            return;
        }
    }

    /// Ends the transfer when the hook has been running for too long.
    fn check_limit(&self, state: &mut State, since: Instant) {
        if since.elapsed() >= self.limit {
            state.transfer.ask_to_stop(Stop::HookHangs(self.limit));
        }
    }

    /// Ends the thread. If the hook does not return, its thread goes on alone, the areas that it has are
    /// replaced so that its writes have no effect, and this returns an error.
    pub(super) fn end(&mut self) -> Result<(), Error> {
        let Some(thread) = self.thread.take() else { return Ok(()) };
        let shared = &*self.shared;
        self.wait_until_done(false);
        let mut state = shared.state();
        let hangs = state.hook.busy_since().is_some();
        // The areas may have been given back already, while the replaced hook is dropped.
        let holds = state.area_lock.holder().is_some_and(|holder| {
            holder.thread == thread_id() || state.hook.runs_in(holder.thread)
        });
        state.hook.end();
        if hangs && holds {
            let areas = state.hand_over.outgoing().to_vec();
            let next = state.area_lock.replace(areas);
            shared.wake_next(&state, next);
        }
        drop(state);
        shared.hook_turn.notify_all();
        if hangs {
            return Err(Error::HookHangs { limit: self.limit });
        }
        // The thread catches the hook's panics, so there is nothing to report here.
        let _ = thread.join();
        Ok(())
    }
}

/// The hook's thread: takes its turns until it is to end.
fn serve(shared: &Shared, number: u64) {
    loop {
        let mut state = shared.state();
        let mut begun = loop {
            if state.hook.is_over(number) {
                return;
            }
            if let Some(begun) = state.hook.begin(thread_id()) {
                break begun;
            }
            shared.hook_turn.wait(&mut state);
        };
        state.area_lock.hand_to(thread_id());
        let taken = Taken::for_hook(&state, std::mem::take(&mut begun.areas), begun.turn);
        drop(state);
        run(shared, &mut begun, taken);
        let replaced = shared.state().hook.returned(begun, thread_id());
        // Not under the lock, because dropping the hook runs code of the program. Within its turn, because
        // it may own the handler, whose drop must not wait for this thread.
        if let Err(payload) = catch_unwind(AssertUnwindSafe(|| drop(replaced))) {
            shared.ask_to_stop(Stop::ProgramPanicked);
            std::mem::forget(payload);
        }
        shared.state().hook.end_turn(thread_id());
        shared.attended.notify_one();
        shared.hook_turn.notify_all();
    }
}

/// Calls the hook and puts the areas back.
fn run(shared: &Shared, begun: &mut Begun, mut taken: Taken) {
    let Some(hook) = &mut begun.hook else { return shared.release(&mut taken, false) };
    let result = catch_unwind(AssertUnwindSafe(|| hook(&mut taken.areas)));
    shared.release(&mut taken, result.is_err());
    match result {
        Ok(goes_on) if goes_on.is_break() => shared.ask_to_stop(Stop::Asked),
        Ok(_) => {}
        // The payload of the panic may panic again when it is dropped.
        Err(payload) => std::mem::forget(payload),
    }
}
