//! A subscription to events: the channel in which they come in.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvError, RecvTimeoutError, TryRecvError};

use super::listeners::Listeners;
use crate::events::{Event, EventKind, TimedEvent};
use crate::handler::program::known::Known;
use crate::handler::sync::PanicCheck;
use crate::pause::within_clock;

/// Events of the kinds that were subscribed to, in the order in which they happened; made by
/// [`TransferAreas::events`](crate::TransferAreas::events).
///
/// It is an iterator, by value and by reference: each step blocks until there is an event, and a `for` loop
/// ends after [`Event::TransferEnded`](crate::Event::TransferEnded), or when the handler was dropped. The
/// subscription stays for the next transfer, and so does [`recv`](Self::recv).
/// Dropping this unsubscribes; when a panic drops it, the transfer [ends with all motors
/// stopped](crate::TransferAreas#when-a-thread-panics).
///
/// ```
/// use std::thread;
///
/// use ft_transfer_area::prelude::*;
/// use ft_transfer_area::{Event, EventKind};
///
/// fn print_switches(areas: &TransferAreas) -> Result<(), Error> {
///     let events = areas.events(&[EventKind::InputChanged], 100)?;
///     thread::spawn(move || {
///         for received in &events {
///             match received.event {
///                 Event::InputChanged { input: I1, pressed: true, .. } => {
///                     println!("I1 in cycle {}!", received.cycle);
///                 }
///                 Event::TransferEnded { error: Some(error), .. } => println!("{error:#}"),
///                 _ => {}
///             }
///         }
///         println!("{} events were lost", events.lost());
///     });
///     Ok(())
/// }
/// ```
pub struct Events {
    receiver: Receiver<TimedEvent>,
    lost: Arc<AtomicU64>,
    listeners: Arc<Listeners>,
    panicking: PanicCheck,
    source: Box<dyn Source>,
    /// The iterator has given the end of a transfer, and says next that it ends.
    at_end: AtomicBool,
}

/// How often a listener in lock-step checks whether a transfer has begun.
const LOOK: Duration = Duration::from_millis(10);

/// How a wait in lock-step has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// A response or an error has come.
    Done,
    /// Nothing has come, because there is no transfer.
    NoTransfer,
}

/// What a subscription needs from its transfer.
pub(crate) trait Source: Send + Sync {
    /// The thread that owns the subscription panics.
    fn panicked(&self);

    /// In lock-step: what has happened so far, for [`step`](Self::step). `None` without lock-step.
    fn seen(&self) -> Option<Known>;

    /// In lock-step, where time moves only while a thread waits: waits until more has happened than was `seen`.
    fn step(&self, seen: Known) -> Step;

    /// The current time, for limits.
    fn now(&self) -> Instant;
}

impl Events {
    /// The largest possible capacity of a channel.
    pub const MAX_CAPACITY: usize = 65_536;

    /// Subscribes.
    pub(crate) fn new(
        listeners: &Arc<Listeners>,
        kinds: &[EventKind],
        capacity: usize,
        source: impl Source + 'static,
    ) -> Self {
        let (receiver, lost) = listeners.subscribe(kinds.iter().copied().collect(), capacity);
        let (listeners, panicking) = (Arc::clone(listeners), PanicCheck::new());
        let (source, at_end) = (Box::new(source), AtomicBool::new(false));
        Self { receiver, lost, listeners, panicking, source, at_end }
    }

    /// The channel itself, for [`select!`](crate::channel::select), for other ways to wait, and for other
    /// threads. In [lock-step](crate::TransferAreaComHandlerBuilder::lock_step) waiting on it does not move
    /// the time.
    pub fn receiver(&self) -> &Receiver<TimedEvent> {
        &self.receiver
    }

    /// The next event. Blocks until there is one.
    ///
    /// # Errors
    ///
    /// When the handler was dropped and all events have been received.
    pub fn recv(&self) -> Result<TimedEvent, RecvError> {
        // Before the channel is looked into, so that nothing comes unnoticed between both.
        while let Some(seen) = self.source.seen() {
            match self.receiver.try_recv() {
                Ok(event) => return Ok(event),
                Err(TryRecvError::Disconnected) => return Err(RecvError),
                Err(TryRecvError::Empty) => {}
            }
            match self.source.step(seen) {
                Step::Done => {}
                Step::NoTransfer => match self.receiver.recv_timeout(LOOK) {
                    Ok(event) => return Ok(event),
                    Err(RecvTimeoutError::Disconnected) => return Err(RecvError),
                    Err(RecvTimeoutError::Timeout) => {}
                },
            }
        }
        self.receiver.recv()
    }

    /// The next event, if there is one already. Does not block.
    ///
    /// # Errors
    ///
    /// When there is none, or the handler was dropped and all events have been received.
    pub fn try_recv(&self) -> Result<TimedEvent, TryRecvError> {
        self.receiver.try_recv()
    }

    /// The next event. Blocks up to `limit`, with [`Duration::MAX`] forever.
    ///
    /// # Errors
    ///
    /// When no event came in time, or the handler was dropped and all events have been received.
    pub fn recv_timeout(&self, limit: Duration) -> Result<TimedEvent, RecvTimeoutError> {
        let (begin, real) = (self.source.now(), Instant::now());
        while let Some(seen) = self.source.seen() {
            match self.receiver.try_recv() {
                Ok(event) => return Ok(event),
                Err(TryRecvError::Disconnected) => return Err(RecvTimeoutError::Disconnected),
                Err(TryRecvError::Empty) => {}
            }
            match self.source.step(seen) {
                Step::Done => {}
                Step::NoTransfer => match self.receiver.recv_timeout(LOOK.min(limit)) {
                    Err(RecvTimeoutError::Timeout) if real.elapsed() < limit => {}
                    received => return received,
                },
            }
            if self.source.now() - begin > limit {
                return Err(RecvTimeoutError::Timeout);
            }
        }
        self.receiver.recv_timeout(within_clock(limit))
    }

    /// How many events were dropped because the channel was full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Iterator for Events {
    type Item = TimedEvent;

    fn next(&mut self) -> Option<TimedEvent> {
        (&*self).next()
    }
}

impl Iterator for &Events {
    type Item = TimedEvent;

    fn next(&mut self) -> Option<TimedEvent> {
        if self.at_end.swap(false, Ordering::Relaxed) {
            return None;
        }
        let received = self.recv().ok()?;
        let ended = matches!(received.event, Event::TransferEnded { .. });
        self.at_end.store(ended, Ordering::Relaxed);
        Some(received)
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
            self.source.panicked();
        }
    }
}
