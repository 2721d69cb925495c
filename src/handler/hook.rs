//! The program's calls for the cycle hook.

use std::ops::ControlFlow;

use super::com_handler::TransferAreaComHandler;
use super::hook_slot::Hook;
use super::shared::Shared;
use super::sync::thread_id;
use crate::transfer_area::FishX1Transfer;

impl TransferAreaComHandler {
    /// Calls a function in each cycle, between receiving inputs and sending outputs: the
    /// controller's `SetTransferAreaCompleteCallback`.
    ///
    /// The function gets the areas locked, with the inputs that have just come in; what it writes
    /// goes out in the very next request. If it returns [`ControlFlow::Break`], it stops the machine, as
    /// `false` does on the controller: the transfer ends without an error, with all motors stopped. If it
    /// panics, the transfer ends with all motors stopped and
    /// [`Error::ProgramPanicked`](crate::Error::ProgramPanicked), and what it wrote in that
    /// cycle does not go out.
    ///
    /// It is called from the next response on, in this transfer and the following ones, until it is
    /// replaced or [cleared](Self::clear_cycle_hook), or the handler is dropped. It runs before
    /// threads in [`wait_cycle`](Self::wait_cycle) are woken and events are sent, so these find
    /// what it wrote and can overwrite it. It does not shorten the reaction window for programs that poll.
    ///
    /// It runs in a thread of its own, always the same during a transfer. The exchange waits meanwhile, so
    /// it has to be quick: about a millisecond. When it does not return within its
    /// [limit](crate::TransferAreaComHandlerBuilder::hook_limit), half a second by default,
    /// the transfer ends with all motors stopped and
    /// [`Error::HookHangs`](crate::Error::HookHangs), and it is never called again. Its thread can't be
    /// stopped from outside; it ends when the function returns.
    ///
    /// Inside the function, use the areas that it gets. Locking the areas, waiting for a cycle, and starting
    /// or stopping the camera panic there, because it would wait for itself. It may set and clear hooks, end
    /// the transfer and drop the handler; the transfer then ends when the function has returned.
    ///
    /// While a thread of the program holds a guard, the call is delayed, but not beyond the reaction
    /// window; then it is skipped for that cycle and counted as a
    /// [late reaction](crate::Statistics::late_reactions). Without a window, it is skipped if any guard is
    /// held when the response comes in.
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

    /// Stops calling the function of [`set_cycle_hook`](Self::set_cycle_hook), and drops it.
    ///
    /// Blocks while the function runs, for its limit at most; inside the function it does not block. After
    /// this has returned, the function is not called again; one that hangs may still be running.
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
        // Not under the lock, because dropping it runs code of the program.
        drop(before);
    }
}
