//! The cycle hook: a thread in `wait_cycle` that this library starts.
//!
//! Its ticket differs from others in three things: it comes first among those that want the areas, it neither ends the
//! reaction window early nor moves the time in lock-step, and it is there from one call to the next.

use std::ops::ControlFlow;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;

use crate::error::Error;
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::parts::phase::Stop;
use crate::handler::parts::tickets::{Stage, TicketId};
use crate::handler::program::area::TransferAreas;
use crate::handler::program::guard::TransferAreaGuard;
use crate::handler::state::Lease;
use crate::handler::sync::{spawn, thread_id};

impl TransferAreaComHandler {
    /// Calls a function in each cycle, between receiving inputs and sending outputs: the
    /// controller's `SetTransferAreaCompleteCallback`.
    ///
    /// This starts a thread that calls the function with what [`wait_cycle`](TransferAreas::wait_cycle) returns:
    ///
    /// - for each response the areas, locked, with the inputs that have just come in. What the function
    ///   writes goes out in the very next request, if it returns within the [reaction
    ///   window](crate::TransferAreaComHandlerBuilder::reaction_window). A function that takes longer is called again
    ///   with the next response; [`cycle`](TransferAreaGuard::cycle) shows how many it has missed.
    /// - once for each time that the outputs were stopped,
    ///   [`Error::ConnectionLost`] or [`Error::WatchdogExpired`]. What it writes counts again afterwards. A watchdog
    ///   that expired before this call counts, too, if no call has returned its error yet.
    ///
    /// If it returns [`ControlFlow::Break`], it stops the machine, as `false` does on the controller: the
    /// transfer ends without an error, with all motors stopped. If it panics, the transfer ends with all
    /// motors stopped and [`Error::ProgramPanicked`], and what it wrote under that guard does not go out.
    ///
    /// It is called from the next response on, in this transfer and the following ones, until it is
    /// replaced or [cleared](Self::clear_cycle_hook), or the handler is dropped. It gets the areas before
    /// other threads, so these find what it wrote and can overwrite it. It does not shorten the
    /// reaction window for programs that poll.
    ///
    /// Only one hook runs at a time: another one is called when the earlier one has returned.
    ///
    /// Nothing waits for the function longer than the reaction window: while it runs, sleeps or hangs, the
    /// exchange goes on, and every stop reaches the controller. A call that keeps the areas for longer than half a
    /// second, or the limit of the [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) if there is one, is
    /// treated like a watchdog that expires: all motors stop, waits of all threads return
    /// [`Error::WatchdogExpired`], and when the function returns, what it wrote does not count and it is called
    /// with this error. Until it returns, [`lock`](TransferAreas::lock) waits for it, as for any guard.
    ///
    /// The function may do what any thread of the program may do that has a guard, such as ending the
    /// transfer, setting another hook, or dropping the handler. Locking the areas panics there, as under any guard, and so
    /// does waiting for a response. Starting the camera takes longer than the areas may be kept.
    ///
    /// `std::process::exit` in the function ends the program without a last exchange, so motors may go on: return
    /// [`ControlFlow::Break`], and exit after `end_transfer`. A function that owns its own handler, in an `Arc`,
    /// keeps it and its transfer for ever: give it a `Weak` or a [`TransferAreas`].
    ///
    /// Blocks while an earlier hook runs, for half a second at most; inside a hook it does not block.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// use ft_transfer_area::prelude::*;
    ///
    /// fn run_until_stopped(handler: &TransferAreaComHandler) -> Result<(), Error> {
    ///     let areas = handler.areas();
    ///     handler.set_cycle_hook(|now| {
    ///         // After a lost connection this machine just goes on.
    ///         let Ok(now) = now else { return ControlFlow::Continue(()) };
    ///         let area = &mut now[LOCAL_IO];
    ///         area.output.duty[O1] = if area.input.uni[I1] != 0 { 512 } else { 0 }; // M1
    ///         if area.input.uni[I2] != 0 {
    ///             return ControlFlow::Break(());
    ///         }
    ///         ControlFlow::Continue(())
    ///     })?;
    ///     handler.begin_transfer()?;
    ///     while areas.wait_cycle().is_ok() {}
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
        let shared = self.areas().shared();
        let Some((ticket, known)) = shared.replace_hook(true) else { return Ok(()) };
        let area = TransferAreas::new(Arc::clone(shared));
        area.known.learn(known);
        // Without a thread it is dropped here, and the ticket with it.
        let thread = HookThread { area, ticket };
        let hook = Box::new(hook);
        spawn("ft/hook", move || thread.run(hook)).map(drop).map_err(Error::not_started)
    }

    /// Stops calling the function of [`set_cycle_hook`](Self::set_cycle_hook), and drops it.
    ///
    /// Blocks while the function runs, or while what it owns is dropped, for half a second at most; inside the function
    /// it does not block. After this has returned, the function is not called again; one that hangs may still be
    /// running.
    pub fn clear_cycle_hook(&self) {
        self.areas().shared().replace_hook(false);
    }
}

/// The program's function.
type Hook = dyn FnMut(Result<&mut TransferAreaGuard<'_>, Error>) -> ControlFlow<()> + Send;

/// The thread that calls the program's function.
struct HookThread {
    area: TransferAreas,
    ticket: TicketId,
}

impl HookThread {
    fn run(self, mut hook: Box<Hook>) {
        let shared = self.area.shared();
        shared.state().tickets.hook_begins(self.ticket, thread_id());
        while let Some((call, transfer)) = self.next_call() {
            // The guard has stopped its transfer already. Another one may have begun since.
            let has_guard = call.is_ok();
            if catch(|| self.call(&mut hook, call, transfer)).is_err() && !has_guard {
                shared.ask_to_stop(Stop::ProgramPanicked);
            }
        }
        // Before the ticket, so that whoever waits for the end of this hook finds what it owned dropped.
        if catch(|| drop(hook)).is_err() {
            shared.ask_to_stop(Stop::ProgramPanicked);
        }
    }

    fn call(&self, hook: &mut Hook, call: Result<Lease, Error>, transfer: u64) {
        // A panic drops the guard, which undoes what was written.
        let mut guard = call.map(|lease| self.area.returned(lease));
        let areas = guard.as_mut().map_err(|error| error.clone());
        if hook(areas).is_break() {
            // Before the next request can leave.
            self.end_transfer(transfer);
        }
    }

    /// Waits for the next call, and returns the number of its transfer; `None` when the hook was replaced or cleared.
    fn next_call(&self) -> Option<(Result<Lease, Error>, u64)> {
        let shared = self.area.shared();
        let mut state = shared.state();
        while state.tickets.hook() == Some(self.ticket) {
            let call = self.area.learn(|known| state.hook_call(self.ticket, known));
            if let Some(call) = call {
                if call.is_err() {
                    shared.hook_makes_way(&state);
                }
                return Some((call, state.transfer.number()));
            }
            if state.next_may_leave() {
                shared.attended.notify_one();
            }
            shared.waker(self.ticket).wait(&mut state);
        }
        state.tickets.change(self.ticket, Stage::Away);
        shared.hook_makes_way(&state);
        None
    }

    /// The hook ends the transfer of this number. Another one may have begun since its call.
    fn end_transfer(&self, transfer: u64) {
        let shared = self.area.shared();
        let mut state = shared.state();
        if state.transfer.number() == transfer {
            state.transfer.ask_to_stop(Stop::Asked);
            shared.attended.notify_one();
        }
    }
}

impl Drop for HookThread {
    fn drop(&mut self) {
        let shared = self.area.shared();
        let mut state = shared.state();
        state.tickets.end_hook(self.ticket);
        shared.hook_makes_way(&state);
    }
}

/// Runs code of the program; whether it has panicked.
fn catch(code: impl FnOnce()) -> Result<(), ()> {
    catch_unwind(AssertUnwindSafe(code)).map_err(|payload| {
        // It may panic again when it is dropped.
        std::mem::forget(payload);
    })
}
