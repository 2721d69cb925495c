//! What a transfer consists of: parts that know neither each other nor a lock; only `hand_over` is built on
//! `unfinished`. They meet in [`state`](crate::handler::state).

pub(crate) mod camera_work;
pub(crate) mod clock;
pub(crate) mod hand_over;
pub(crate) mod interruptions;
pub(crate) mod phase;
pub(crate) mod responses;
pub(crate) mod tickets;
pub(crate) mod unfinished;
pub(crate) mod watchdog;
