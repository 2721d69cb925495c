//! What a transfer consists of: parts that know neither each other nor a lock. They meet in
//! [`shared`](crate::handler::shared).

pub(in crate::handler) mod area_lock;
pub(in crate::handler) mod clock;
pub(in crate::handler) mod hand_over;
pub(in crate::handler) mod hook_slot;
pub(in crate::handler) mod interruptions;
pub(in crate::handler) mod state;
pub(in crate::handler) mod unfinished;
pub(in crate::handler) mod watchdog;
pub(in crate::handler) mod window;
