//! A subscription to events: the channel in which they come in.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvError, RecvTimeoutError, TryRecvError};

use super::listeners::Subscription;
use crate::events::{Event, EventKind, TimedEvent};
use crate::handler::parts::phase::Stop;
use crate::handler::shared::Shared;
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
    shared: Arc<Shared>,
    panicking: PanicCheck,
    /// The iterator has given the end of a transfer, and says next that it ends.
    at_end: AtomicBool,
}

/// How often a listener in lock-step checks whether a transfer has begun.
const LOOK: Duration = Duration::from_millis(10);

impl Events {
    /// The largest possible capacity of a channel.
    pub const MAX_CAPACITY: usize = 65_536;

    /// Subscribes.
    pub(crate) fn new(shared: Arc<Shared>, kinds: &[EventKind], capacity: usize) -> Self {
        // Locked meanwhile, so that no response comes between.
        let mut listeners = shared.listeners.lock();
        let since = shared.state().known_now().shown;
        let kinds = kinds.iter().copied().collect();
        let Subscription { receiver, lost } = listeners.subscribe(kinds, capacity, since);
        drop(listeners);
        let (panicking, at_end) = (PanicCheck::new(), AtomicBool::new(false));
        Self { receiver, lost, shared, panicking, at_end }
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
        self.recv_timeout(Duration::MAX).map_err(|_| RecvError)
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
        if self.shared.lock_step {
            return self.recv_in_lock_step(limit);
        }
        self.receiver.recv_timeout(within_clock(limit))
    }

    /// The same in lock-step, where time moves only while a thread waits for a response.
    fn recv_in_lock_step(&self, limit: Duration) -> Result<TimedEvent, RecvTimeoutError> {
        let (begin, real) = (self.shared.state().clock.now(), Instant::now());
        loop {
            // Before the channel is looked into, so that nothing comes unnoticed between both.
            let seen = self.shared.state().known_now();
            match self.receiver.try_recv() {
                Ok(event) => return Ok(event),
                Err(TryRecvError::Disconnected) => return Err(RecvTimeoutError::Disconnected),
                Err(TryRecvError::Empty) => {}
            }
            if !self.shared.step(seen) {
                // There is no transfer.
                match self.receiver.recv_timeout(LOOK.min(limit)) {
                    Err(RecvTimeoutError::Timeout) if real.elapsed() < limit => {}
                    received => return received,
                }
            }
            if self.shared.state().clock.now() - begin > limit {
                return Err(RecvTimeoutError::Timeout);
            }
        }
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
        self.shared.listeners.lock().unsubscribe(&self.lost);
        if self.panicking.has_begun() {
            self.shared.ask_to_stop(Stop::ProgramPanicked);
        }
    }
}
