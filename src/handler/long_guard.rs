//! Guards that are kept for so long that the program may not know it.

use std::time::Duration;

use crate::handler::parts::tickets::Hold;
use crate::handler::sync::{now, Thread};
use crate::notices;

/// A guard that was held for this time is reported, because its thread may wait in a loop for an input that
/// can't change under the guard.
pub(crate) const GUARD_IS_LONG: Duration = Duration::from_secs(1);

/// Warns the program of its guard, in another thread; the sentence begins with the controller. Without a logger the
/// warning goes to the standard error.
pub(crate) fn warn_of(hold: &Hold, peer: &str, watchdog_expired: bool) {
    let effect = if watchdog_expired { ", and the watchdog has stopped the motors" } else { "" };
    notices::warn_always(
        module_path!(),
        format_args!(
            "{peer}{} has held a guard of the transfer areas for {:.1?}{effect}: while it is held, its inputs do \
             not change, and what was written is not sent; drop the guard and lock again in each round of \
             a loop that waits for an input, or use wait_until",
            name_of(&hold.thread),
            now() - hold.since,
        ),
    );
}

/// How a message names a thread.
pub(crate) fn name_of(thread: &Thread) -> String {
    thread.name().map_or("a thread without a name".into(), |name| format!("the thread {name:?}"))
}
