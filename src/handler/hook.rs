//! The program's calls for the cycle hook.

use std::ops::ControlFlow;

use super::com_handler::TransferAreaComHandler;
use super::hook_slot::Hook;
use super::shared::Shared;
use super::sync::thread_id;
use crate::transfer_area::FishX1Transfer;

impl TransferAreaComHandler {
    /// Has a function called in each cycle, between receiving inputs and sending outputs: the
    /// controller's `SetTransferAreaCompleteCallback`.
    ///
    /// The function gets the areas locked, with the inputs that have just come in; what it writes
    /// goes out in the very next request. With [`ControlFlow::Break`] it stops the machine, as on
    /// the controller with `false`: the transfer ends well, with all motors stopped. When it
    /// panics, the transfer ends with all motors stopped and
    /// [`Error::ProgramPanicked`](crate::Error::ProgramPanicked), and nothing that it wrote in that
    /// cycle goes out.
    ///
    /// It is called from the next response on, in this transfer and those that follow, until it is
    /// replaced or [cleared](Self::clear_cycle_hook), or the handler is dropped. It runs before
    /// threads in [`wait_cycle`](Self::wait_cycle) are woken and events are sent, so these find
    /// what it wrote and have the last word. The reaction window is as long as without it, for
    /// programs that poll.
    ///
    /// It runs in a thread of its own, always the same during a transfer. The exchange stands still
    /// meanwhile, so it has to be quick, a millisecond or so. When it does not return within its
    /// [limit](crate::TransferAreaComHandlerBuilder::hook_limit), half a second unless set otherwise,
    /// the transfer ends with all motors stopped and
    /// [`Error::HookHangs`](crate::Error::HookHangs), and it is never called again. Its thread can't be
    /// stopped from outside, and ends when the function returns.
    ///
    /// Inside it, use the areas that it gets: locking the areas, waiting for a cycle and starting or
    /// stopping the camera panic, because it would wait for itself. Setting and clearing hooks is allowed, and so is ending the transfer or
    /// dropping the handler, which then happens when it has returned.
    ///
    /// While a thread of the program holds a guard, its turn is put off, but not beyond the reaction
    /// window; then it is skipped for that cycle and counted as a
    /// [late reaction](crate::Statistics::late_reactions). Without a window, any guard that is held
    /// when the response comes in makes it miss its turn.
    ///
    /// Blocks while an earlier hook runs, for the limit at most.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler};
    ///
    /// fn run_until_stopped(handler: &TransferAreaComHandler) -> Result<(), Error> {
    ///     handler.set_cycle_hook(|areas| {
    ///         let area = &mut areas[LOCAL_IO];
    ///         area.output.duty[0] = if area.input.uni[0] != 0 { 512 } else { 0 }; // I1, M1
    ///         if area.input.uni[1] != 0 { // I2
    ///             return ControlFlow::Break(());
    ///         }
    ///         ControlFlow::Continue(())
    ///     });
    ///     handler.begin_transfer()?;
    ///     while handler.wait_cycle().is_ok() {}
    ///     handler.end_transfer()
    /// }
    /// ```
    #[doc(alias = "SetTransferAreaCompleteCallback")]
    #[doc(alias = "TransferAreaCallbackFunction")]
    #[doc(alias = "SetFtTaCompleted")]
    #[doc(alias = "tCbTaCompleted")]
    pub fn set_cycle_hook(
        &self,
        hook: impl FnMut(&mut [FishX1Transfer]) -> ControlFlow<()> + Send + 'static,
    ) {
        self.area().shared().put_hook(Some(Box::new(hook)));
    }

    /// Calls the function of [`set_cycle_hook`](Self::set_cycle_hook) no more, and drops it.
    ///
    /// Blocks while it runs, for its limit at most, but not when it is called from inside it. It is not
    /// called again when this has returned; one that hangs may still be running.
    pub fn clear_cycle_hook(&self) {
        self.area().shared().put_hook(None);
    }
}

impl Shared {
    fn put_hook(&self, hook: Option<Hook>) {
        let mut state = self.state();
        let before = state.hook.put(hook);
        while state.hook.old_one_runs_elsewhere(thread_id()) {
            self.hook_turn.wait(&mut state);
        }
        drop(state);
        // Not under the lock, because what it owns is the program's.
        drop(before);
    }
}
