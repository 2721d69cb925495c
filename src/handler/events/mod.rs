//! Events: what responses and the state of the transfer tell, on channels.

mod channel;
mod event;
mod listeners;
mod watch;

pub use channel::Events;
pub(super) use event::KindSet;
pub use event::{Event, EventKind, Joystick};
pub(super) use listeners::Listeners;
pub(super) use watch::Comparison;
