//! Guards that are kept for so long that the program may not know it.

use std::time::Duration;

use crate::handler::parts::area_lock::{name_of, Holder};
use crate::handler::shared::State;
use crate::notices;

/// A guard that was held for this time is reported, because its thread may wait in a loop for an input that
/// can't change under the guard.
pub(crate) const GUARD_IS_LONG: Duration = Duration::from_secs(1);

/// A guard that is reported.
pub(crate) struct LongGuard {
    holder: Holder,
    /// Whether the watchdog has just expired.
    expired: bool,
}

impl State {
    /// The current guard, if the program is to be warned of it now: once for each guard.
    pub(crate) fn guard_to_warn_of(&mut self, expired: bool) -> Option<LongGuard> {
        let holder = self.area_lock.holder()?;
        let lease = self.area_lock.lease();
        let held = holder.held();
        let is_long = held >= GUARD_IS_LONG || expired && held >= self.watchdog.limit() / 2;
        if !is_long || self.warned_lease == lease {
            return None;
        }
        let holder = holder.clone();
        self.warned_lease = lease;
        Some(LongGuard { holder, expired })
    }
}

impl LongGuard {
    /// Warns the program, in another thread. Without a logger the warning goes to the standard error.
    pub(crate) fn warn(&self) {
        let effect = if self.expired { ", and the watchdog has stopped the motors" } else { "" };
        notices::warn_always(
            module_path!(),
            format_args!(
                "{} has held a guard of the transfer areas for {:.1?}{effect}: while it is held, its inputs do \
                 not change, and what was written is not sent; drop the guard and lock again in each round of \
                 a loop that waits for an input, or use wait_until",
                name_of(&self.holder.thread),
                self.holder.held(),
            ),
        );
    }
}
