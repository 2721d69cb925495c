//! What a transfer consists of: parts that know neither each other nor a lock; only `hand_over` is built on
//! `unfinished`. They meet in [`shared`](crate::handler::shared).

pub(crate) mod area_lock;
pub(crate) mod clock;
pub(crate) mod hand_over;
pub(crate) mod hook_slot;
pub(crate) mod interruptions;
pub(crate) mod state;
pub(crate) mod unfinished;
pub(crate) mod watchdog;
pub(crate) mod window;
