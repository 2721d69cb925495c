//! The cycle hook: a thread of the program that this library starts.
//!
//! It waits for responses like any other thread of the program, and the rules for guards are the same for
//! it. It only gets the areas before the others.

use std::ops::ControlFlow;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;

use crate::error::Error;
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::parts::area_lock::{Holder, Waiter};
use crate::handler::parts::hook_slot::HookSlot;
use crate::handler::parts::state::Stop;
use crate::handler::program::area::TransferArea;
use crate::handler::program::guard::TransferAreaGuard;
use crate::handler::program::lease::{Known, Lease, Purpose};
use crate::handler::shared::{Shared, State};
use crate::handler::sync::{now, spawn, thread_id, wait_until};

impl TransferAreaComHandler {
    /// Calls a function in each cycle, between receiving inputs and sending outputs: the
    /// controller's `SetTransferAreaCompleteCallback`.
    ///
    /// This starts a thread of the program that calls the function with what
    /// [`wait_cycle`](TransferArea::wait_cycle) would return:
    ///
    /// - for each response the areas, locked, with the inputs that have just come in. What the function
    ///   writes goes out in the very next request, if it returns within the [reaction
    ///   window](crate::TransferAreaComHandlerBuilder::reaction_window).
    /// - once for each time that the outputs were stopped,
    ///   [`Error::ConnectionLost`] or [`Error::WatchdogExpired`]. What it writes counts again afterwards.
    ///
    /// If it returns [`ControlFlow::Break`], it stops the machine, as `false` does on the controller: the
    /// transfer ends without an error, with all motors stopped. If it panics, the transfer ends with all
    /// motors stopped and [`Error::ProgramPanicked`], and what it wrote under that guard does not go out.
    ///
    /// It is called from the next response on, in this transfer and the following ones, until it is
    /// replaced or [cleared](Self::clear_cycle_hook), or the handler is dropped. It gets the areas before
    /// threads in `wait_cycle`, listeners for events and threads that lock, so these find what it wrote and
    /// can overwrite it. It is not called for the last response of a transfer. It does not shorten the
    /// reaction window for programs that poll.
    ///
    /// Nothing waits for the function longer than the reaction window: while it runs, sleeps or hangs, the
    /// exchange goes on, and every stop reaches the controller. If the next response comes in before it has
    /// returned, or before another thread has released the areas, its call for the earlier one is left out
    /// and counted in [`missed_hook_calls`](crate::Statistics::missed_hook_calls). When a call takes longer
    /// than its [limit](crate::TransferAreaComHandlerBuilder::hook_limit), half a second by default, the
    /// transfer ends with all motors stopped and [`Error::HookHangs`], the areas are taken away from it, and
    /// it is never called again. Its thread can't be stopped from outside; it ends when the function
    /// returns.
    ///
    /// The function may do what any thread of the program may do that has a guard, such as ending the
    /// transfer, starting the camera, setting another hook, or dropping the handler. Locking the areas and
    /// waiting panic there, as under any guard.
    ///
    /// `std::process::exit` in the function ends the program without a last exchange, so motors may go on: return
    /// [`ControlFlow::Break`], and exit after `end_transfer`. A function that owns its own handler, in an `Arc`,
    /// keeps it and its transfer for ever: give it a `Weak` or a [`TransferArea`].
    ///
    /// Blocks while an earlier hook runs, for the limit at most; inside a hook it does not block.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler};
    ///
    /// fn run_until_stopped(handler: &TransferAreaComHandler) -> Result<(), Error> {
    ///     handler.set_cycle_hook(|areas| {
    ///         // After a lost connection this machine just goes on.
    ///         let Ok(areas) = areas else { return ControlFlow::Continue(()) };
    ///         let area = &mut areas[LOCAL_IO];
    ///         area.output.duty[0] = if area.input.uni[0] != 0 { 512 } else { 0 }; // I1, M1
    ///         if area.input.uni[1] != 0 { // I2
    ///             return ControlFlow::Break(());
    ///         }
    ///         ControlFlow::Continue(())
    ///     })?;
    ///     handler.begin_transfer()?;
    ///     while handler.wait_cycle().is_ok() {}
    ///     handler.end_transfer()
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::ThreadNotStarted`]; then no hook is set.
    #[doc(alias = "SetTransferAreaCompleteCallback")]
    #[doc(alias = "TransferAreaCallbackFunction")]
    #[doc(alias = "SetFtTaCompleted")]
    #[doc(alias = "tCbTaCompleted")]
    pub fn set_cycle_hook(
        &self,
        hook: impl FnMut(Result<&mut TransferAreaGuard<'_>, Error>) -> ControlFlow<()> + Send + 'static,
    ) -> Result<(), Error> {
        let shared = self.area().shared();
        let version = shared.replace_hook(HookSlot::set);
        let thread = HookThread { area: self.area().clone(), version };
        if let Err(error) = spawn("cycle-hook", move || thread.run(hook)) {
            let mut state = shared.state();
            state.hook.thread_ends(version);
            if !state.hook.is_over(version) {
                state.hook.clear();
            }
            return Err(Error::not_started(error));
        }
        Ok(())
    }

    /// Stops calling the function of [`set_cycle_hook`](Self::set_cycle_hook), and drops it.
    ///
    /// Blocks while the function runs, for its limit at most; inside the function it does not block. After
    /// this has returned, the function is not called again; one that hangs may still be running.
    pub fn clear_cycle_hook(&self) {
        self.area().shared().replace_hook(HookSlot::clear);
    }
}

/// The thread that calls the program's function.
struct HookThread {
    area: TransferArea,
    /// Which hook it is.
    version: u64,
}

impl HookThread {
    fn run<H>(self, mut hook: H)
    where
        H: FnMut(Result<&mut TransferAreaGuard<'_>, Error>) -> ControlFlow<()>,
    {
        let shared = Arc::clone(self.area.shared());
        while let Some(call) = self.area.learn(|known| shared.next_call(self.version, known)) {
            // The guard has stopped its transfer already. Another one may have begun since.
            let has_guard = call.is_ok();
            if catch(|| self.call(&mut hook, call)).is_err() && !has_guard {
                shared.ask_to_stop(Stop::ProgramPanicked);
            }
            shared.call_ends();
        }
        // The program's values are dropped like in a call, because that runs its code, too.
        shared.begin_last_call(self.version);
        if catch(|| drop(hook)).is_err() {
            shared.ask_to_stop(Stop::ProgramPanicked);
        }
        shared.call_ends();
        let version = self.version;
        // A handle of a thread that has ended is gone.
        drop(self);
        shared.state().hook.thread_ends(version);
        shared.wake_hook();
    }

    fn call<H>(&self, hook: &mut H, call: Result<Lease, Error>)
    where
        H: FnMut(Result<&mut TransferAreaGuard<'_>, Error>) -> ControlFlow<()>,
    {
        let shared = self.area.shared();
        let transfer = shared.number();
        // A panic drops the guard, which undoes what was written.
        let mut guard = call.map(|lease| self.area.guard(lease));
        let areas = guard.as_mut().map_err(|error| error.clone());
        if hook(areas).is_break() {
            // Before the next request can leave.
            shared.end_by_hook(transfer);
        }
    }
}

/// Runs code of the program; whether it has panicked.
fn catch(code: impl FnOnce()) -> Result<(), ()> {
    catch_unwind(AssertUnwindSafe(code)).map_err(|payload| {
        // It may panic again when it is dropped.
        std::mem::forget(payload);
    })
}

impl Shared {
    /// Sets another hook or none, and waits until the threads of earlier ones have ended, unless this is one.
    /// Returns the version.
    fn replace_hook(&self, replace: fn(&mut HookSlot) -> u64) -> u64 {
        let mut state = self.state();
        let version = replace(&mut state.hook);
        self.wake_next(state.area_lock.arrive(Waiter::Hook));
        self.wake_hook();
        self.attended.notify_one();
        while state.hook.has_older(version, thread_id()) {
            let deadline = state.hook.deadline();
            if wait_until(self.areas_free(Waiter::Hook), &mut state, deadline) {
                self.give_up_hook(&mut state);
            }
        }
        version
    }

    /// Waits for the next call of this hook; `None` when it was replaced or cleared.
    pub(crate) fn next_call(
        &self,
        version: u64,
        known: &mut Known,
    ) -> Option<Result<Lease, Error>> {
        let mut state = self.state();
        loop {
            if let ControlFlow::Break(call) = self.try_call(&mut state, version, known) {
                self.wake_next(state.area_lock.hook_waits(false));
                return call;
            }
            self.areas_free(Waiter::Hook).wait(&mut state);
        }
    }

    /// Begins a call, if there is a reason for one and the areas are free.
    fn try_call(
        &self,
        state: &mut State,
        version: u64,
        known: &mut Known,
    ) -> ControlFlow<Option<Result<Lease, Error>>> {
        if state.hook.is_over(version) {
            return ControlFlow::Break(None);
        }
        if !state.hook.is_free() {
            return ControlFlow::Continue(());
        }
        if let Err(error) = state.tell_news(known) {
            self.begin_call(state, version, false);
            return ControlFlow::Break(Some(Err(error)));
        }
        let is_due = state.hook.is_due() && state.transfer.stop().is_none();
        let areas = is_due.then(|| state.area_lock.take_for_hook(Holder::now())).flatten();
        self.wake_next(state.area_lock.hook_waits(is_due && areas.is_none()));
        let Some(areas) = areas else { return ControlFlow::Continue(()) };
        self.begin_call(state, version, true);
        ControlFlow::Break(Some(Ok(Lease::new(state, areas, *known, Purpose::Hook))))
    }

    /// A call begins. Whoever waits for its end learns that it has a limit from now on.
    fn begin_call(&self, state: &mut State, version: u64, answers: bool) {
        state.hook.begin(thread_id(), version, answers);
        if state.looks_again.is_none_or(|at| Some(at) > state.hook.deadline()) {
            self.attended.notify_one();
        }
        self.areas_free(Waiter::Reacting).notify_all();
        self.areas_free(Waiter::Other).notify_all();
    }

    /// A call in this thread has ended. A guard that it had has already said so.
    fn call_ends(&self) {
        let mut state = self.state();
        state.hook.returned(thread_id());
        if state.next_may_leave() {
            self.attended.notify_one();
        }
        self.wake_hook();
    }

    /// The hook ends the transfer of this number.
    fn end_by_hook(&self, transfer: u64) {
        let mut state = self.state();
        if state.transfer.number() == transfer {
            state.transfer.ask_to_stop(Stop::Asked);
            self.attended.notify_one();
        }
    }

    /// A hook that is over is about to be dropped. This counts as a call, unless another hook runs.
    fn begin_last_call(&self, version: u64) {
        let mut state = self.state();
        if state.hook.is_free() {
            self.begin_call(&mut state, version, false);
        }
    }

    // What the transfer thread calls.

    /// Lets the cycle hook answer the newest response. It comes first, so that the others find what it wrote.
    pub(crate) fn call_hook(&self, state: &mut State) {
        if state.transfer.stop().is_some() {
            return;
        }
        let left_out = state.hook.call_for_response();
        state.statistics.missed_hook_calls += u64::from(left_out);
        if state.hook.is_about_to_take() {
            state.area_lock.expect(Waiter::Hook, 1);
            // A hook whose thread does not run is not a sign of life.
            if !left_out {
                state.feed_for_waiting();
            }
            self.wake_hook();
        }
    }

    /// If the cycle hook has not returned within its limit, ends the transfer and goes on without it: the
    /// areas that it has are replaced, and it is never called again.
    pub(crate) fn give_up_hook(&self, state: &mut State) {
        if state.hook.deadline().is_none() {
            return;
        }
        let Some(thread) = state.hook.give_up(now()) else { return };
        state.transfer.ask_to_stop(Stop::HookHangs(state.hook.limit()));
        if state.area_lock.is_held_by(thread) {
            let areas = state.hand_over.replacement();
            self.wake_next(state.area_lock.replace(areas));
        }
        self.wake_hook();
        self.attended.notify_one();
    }
}
