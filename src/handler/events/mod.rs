//! Events from responses and from the state of the transfer, and a log of all cycles, on channels.

mod channel;
mod cycle_log;
mod event;
mod listeners;
mod log;
mod stall;
mod watch;

pub use channel::Events;
pub(super) use channel::{Source, Step};
pub use cycle_log::CycleLog;
pub(super) use event::KindSet;
pub use event::{Event, EventDetails, EventKind, Joystick, TimedEvent};
pub(super) use listeners::Listeners;
pub(super) use log::Subscription;
pub use log::{LogEntry, Logged, LoggedBeginning, LoggedCycle};
pub(super) use watch::Comparison;
