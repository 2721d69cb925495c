//! A subscription to events: the channel in which they come in.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::{Iter, Receiver, RecvError, RecvTimeoutError};

use super::event::{Event, EventKind};
use super::listeners::Listeners;
use crate::handler::panic_check::PanicCheck;

/// Events of the kinds that were subscribed to, in the order in which they happened; made by
/// [`TransferAreaComHandler::events`](crate::TransferAreaComHandler::events).
///
/// The subscription outlasts a transfer's end and is there for the next one. The channel ends when
/// the handler is dropped, so that a loop over it ends. Dropping this unsubscribes; when a panic drops
/// it, the transfer [ends with all motors stopped](crate::TransferArea#when-a-thread-panics).
///
/// ```
/// use std::thread;
///
/// use ft_transfer_area::tx::Input;
/// use ft_transfer_area::{Error, Event, EventKind, TransferAreaComHandler};
///
/// fn print_switches(handler: &TransferAreaComHandler) -> Result<(), Error> {
///     let events = handler.events(&[EventKind::InputChanged, EventKind::TransferEnded], 100)?;
///     thread::spawn(move || {
///         for event in &events {
///             match event {
///                 Event::InputChanged { input: Input::I1, pressed: true, .. } => println!("I1!"),
///                 Event::TransferEnded { error: Some(error) } => println!("{error}"),
///                 _ => {}
///             }
///         }
///         println!("{} events were lost", events.lost());
///     });
///     Ok(())
/// }
/// ```
pub struct Events {
    receiver: Receiver<Event>,
    lost: Arc<AtomicU64>,
    listeners: Arc<Listeners>,
    panicking: PanicCheck,
    /// Stops the transfer.
    on_panic: Box<dyn Fn() + Send + Sync>,
}

impl Events {
    /// The most events that a channel can be made to hold.
    pub const MAX_CAPACITY: usize = 65_536;

    /// Subscribes. When the thread that owns this panics, `on_panic` is called.
    pub(in crate::handler) fn new(
        listeners: &Arc<Listeners>,
        kinds: &[EventKind],
        capacity: usize,
        on_panic: impl Fn() + Send + Sync + 'static,
    ) -> Self {
        let (receiver, lost) = listeners.subscribe(kinds.iter().copied().collect(), capacity);
        let (listeners, panicking) = (Arc::clone(listeners), PanicCheck::new());
        Self { receiver, lost, listeners, panicking, on_panic: Box::new(on_panic) }
    }

    /// The channel itself, for `select!`, for waiting in other ways, and for other threads.
    pub fn receiver(&self) -> &Receiver<Event> {
        &self.receiver
    }

    /// The next event. Blocks until there is one.
    ///
    /// # Errors
    ///
    /// When the handler was dropped and all events have been received.
    pub fn recv(&self) -> Result<Event, RecvError> {
        self.receiver.recv()
    }

    /// The next event. Blocks up to `limit`.
    ///
    /// # Errors
    ///
    /// When there was none in time, or the handler was dropped and all events have been received.
    pub fn recv_timeout(&self, limit: Duration) -> Result<Event, RecvTimeoutError> {
        self.receiver.recv_timeout(limit)
    }

    /// How many events were dropped so far because the channel was full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// Each step blocks until there is an event; the end comes when the handler was dropped.
impl<'a> IntoIterator for &'a Events {
    type Item = Event;
    type IntoIter = Iter<'a, Event>;

    fn into_iter(self) -> Self::IntoIter {
        self.receiver.iter()
    }
}

impl fmt::Debug for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { receiver, lost, .. } = self;
        f.debug_struct("Events")
            .field("receiver", receiver)
            .field("lost", lost)
            .finish_non_exhaustive()
    }
}

impl Drop for Events {
    fn drop(&mut self) {
        self.listeners.unsubscribe(&self.lost);
        if self.panicking.has_begun() {
            (self.on_panic)();
        }
    }
}
