//! The cycle hook: the program's part of each cycle that runs in the transfer thread.

use std::ops::ControlFlow;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};

use super::mail::Stop;
use super::shared::Shared;
use super::TransferAreaComHandler;
use crate::transfer_area::FishX1Transfer;

type Hook = Box<dyn FnMut(&mut [FishX1Transfer]) -> ControlFlow<()> + Send>;

/// While it waits for the areas, the transfer thread looks so often whether it is to stop.
const LOOK_ROUND: Duration = Duration::from_millis(1);

/// Where the program leaves its hook.
#[derive(Default)]
pub(super) struct HookSlot(Mutex<Option<Hook>>);

impl HookSlot {
    /// Puts a hook in, or none. Waits while the present one runs.
    fn put(&self, hook: Option<Hook>) {
        let before = std::mem::replace(&mut *self.0.lock(), hook);
        // Not under the lock, because what it owns is the program's.
        drop(before);
    }
}

impl TransferAreaComHandler {
    /// Has the transfer thread call a function in each cycle, between receiving inputs and sending
    /// outputs: the controller's `SetTransferAreaCompleteCallback`.
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
    /// The exchange stands still while it runs, so it has to be quick, a millisecond or so, and
    /// must not wait: from inside it, locking the areas, waiting for a cycle and setting or
    /// clearing a hook wait for ever. While a thread of the program holds a guard, its turn is put
    /// off, but not beyond the reaction window; then it is skipped for that cycle and counted as a
    /// [late reaction](crate::Statistics::late_reactions). Without a window, any guard that is held
    /// when the response comes in makes it miss its turn.
    ///
    /// Blocks while an earlier hook runs.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler};
    ///
    /// fn run_until_stopped(handler: &mut TransferAreaComHandler) -> Result<(), Error> {
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
        self.area.shared().hook.put(Some(Box::new(hook)));
    }

    /// Calls the function of [`set_cycle_hook`](Self::set_cycle_hook) no more, and drops it.
    ///
    /// Blocks while it runs; it does not run again when this has returned.
    pub fn clear_cycle_hook(&self) {
        self.area.shared().hook.put(None);
    }
}

impl Shared {
    /// Runs the hook, if there is one, on the areas with the response that has just come in.
    pub(super) fn run_hook(&self, window: Duration) {
        if self.hook.0.lock().is_none() {
            return;
        }
        let Some(mut areas) = self.lock_for_hook(window) else { return };
        let mut slot = self.hook.0.lock();
        let Some(hook) = slot.as_mut() else { return };
        self.mail.lock().bring_up_to_date(&mut areas);
        let result = catch_unwind(AssertUnwindSafe(|| hook(&mut areas)));
        let mut mail = self.mail.lock();
        match result {
            Ok(goes_on) => {
                mail.take_out(&areas);
                if goes_on.is_break() {
                    mail.ask_to_stop(Stop::Asked);
                }
            }
            Err(_) => mail.stop_half_written(),
        }
    }

    /// Locks the areas, unless the reaction window ends first or the transfer is to stop.
    fn lock_for_hook(&self, window: Duration) -> Option<MutexGuard<'_, Vec<FishX1Transfer>>> {
        let end = self.mail.lock().window_end(window);
        loop {
            let rest = end.map(|end| end.saturating_duration_since(Instant::now()));
            let areas = self.areas.try_lock_for(rest.unwrap_or(LOOK_ROUND).min(LOOK_ROUND));
            let mut mail = self.mail.lock();
            if mail.stop.is_some() {
                return None;
            }
            if areas.is_some() {
                return areas;
            }
            if rest == Some(Duration::ZERO) {
                mail.statistics.late_reactions += 1;
                return None;
            }
        }
    }
}
