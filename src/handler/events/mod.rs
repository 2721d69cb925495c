//! Events and logs on channels: who listens, and what the program receives from.

mod channel;
mod cycle_log;
mod listeners;
mod log;

pub use channel::Events;
pub use cycle_log::CycleLog;
pub(super) use listeners::Listeners;
