//! Events from responses and from the state of the transfer, on channels.

mod channel;
mod event;
mod listeners;
mod stall;
mod watch;

pub use channel::Events;
pub(super) use channel::{Source, Step};
pub(super) use event::KindSet;
pub use event::{Event, EventKind, Joystick, TimedEvent};
pub(super) use listeners::Listeners;
pub(super) use watch::Comparison;
