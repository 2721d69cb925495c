//! The program's calls that subscribe to events.

use std::sync::Arc;

use super::area::TransferArea;
use super::com_handler::TransferAreaComHandler;
use super::events::{EventKind, Events};
use super::state::Stop;
use crate::error::Error;

impl TransferArea {
    /// Subscribes to events of these kinds, on a channel that holds up to `capacity` of them,
    /// 1..=[`Events::MAX_CAPACITY`]. Takes what FtTxtLib's callbacks told; see [`Event`](crate::Event).
    ///
    /// An event is told when what a response or the end of the transfer says differs from what was
    /// known when this was called. It comes after that is in the areas: a listener that locks them
    /// finds it there, and what it writes goes out in the next request when it does so within the
    /// reaction window. Threads in [`wait_cycle`](Self::wait_cycle) that are done sooner end
    /// that sooner, so a listener that is to answer at once had better wait there.
    ///
    /// The transfer thread does not wait for a listener. While the channel is full, new events are
    /// dropped and [counted](Events::lost); those in it stay, in order. For
    /// [`Event::TransferEnded`](crate::Event::TransferEnded) there is one more place, so that it comes
    /// even then, unless that of an earlier transfer is still in it.
    ///
    /// There is nothing to be had from a handle whose handler is gone: the channel has ended.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        Error::check_range("capacity for events", capacity, 1..=Events::MAX_CAPACITY as i64)?;
        let shared = Arc::clone(self.shared());
        let stop = move || shared.ask_to_stop(Stop::ProgramPanicked);
        Ok(Events::new(&self.shared().listeners, kinds, capacity, stop))
    }
}

impl TransferAreaComHandler {
    /// Subscribes to events. See [`TransferArea::events`].
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        self.area().events(kinds, capacity)
    }
}
