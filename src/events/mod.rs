//! What a program can learn of a transfer: the events between two responses, and the entries of a log of all cycles.
//! Plain data and comparisons, without locks and channels.

mod comparison;
mod event;
mod logged;
mod stall;

pub(crate) use comparison::Comparison;
pub(crate) use event::KindSet;
pub use event::{Event, EventDetails, EventKind, Joystick, TimedEvent};
pub use logged::{LogEntry, Logged, LoggedBeginning, LoggedCycle};
pub(crate) use stall::Stalls;
