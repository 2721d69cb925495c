//! Events and logs on channels: who listens, and what the program receives from.

mod channel;
mod cycle_log;
mod listeners;
mod log;

pub use channel::Events;
pub(super) use channel::{Source, Step};
pub use cycle_log::CycleLog;
pub(super) use listeners::Listeners;
pub(super) use log::Subscription;
