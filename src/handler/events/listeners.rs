//! Who listens for events, and how they get them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;

use crossbeam_channel::{bounded, Sender};

use super::{Event, Events, KindSet};
use crate::error::Error;
use crate::handler::shared::Shared;

#[derive(Debug, Default)]
pub(in crate::handler) struct Listeners {
    list: Vec<Listener>,
    /// Whether the handler is gone.
    ended: bool,
}

#[derive(Debug)]
struct Listener {
    kinds: KindSet,
    /// The last response before it subscribed.
    since: u64,
    /// Has one more place than `capacity`, for the end of the transfer.
    sender: Sender<Event>,
    capacity: usize,
    /// Tells it from others, too.
    lost: Arc<AtomicU64>,
}

impl Listeners {
    /// Sends an event of a response to all whom it concerns. Does not block.
    pub(in crate::handler) fn tell(&self, event: &Event, cycle: u64) {
        for listener in self.list.iter().filter(|listener| listener.since < cycle) {
            if listener.kinds.contains(event.kind()) {
                listener.put(event.clone(), listener.capacity);
            }
        }
    }

    /// Tells all whom it concerns of the end of a transfer. Does not block.
    pub(in crate::handler) fn tell_end(&self, error: Option<Error>) {
        let event = Event::TransferEnded { error };
        for listener in self.list.iter().filter(|listener| listener.kinds.contains(event.kind())) {
            listener.put(event.clone(), listener.capacity + 1);
        }
    }

    fn kinds(&self) -> KindSet {
        self.list.iter().fold(KindSet::default(), |set, listener| set.union(listener.kinds))
    }
}

impl Listener {
    /// Puts an event into the channel when that holds fewer than `limit`. The transfer thread is
    /// the only one that does so, so there is still room then.
    fn put(&self, event: Event, limit: usize) {
        if self.sender.len() >= limit || self.sender.try_send(event).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Shared {
    pub(super) fn subscribe(self: &Arc<Self>, kinds: KindSet, capacity: usize) -> Events {
        let (sender, receiver) = bounded(capacity + 1);
        let lost = Arc::new(AtomicU64::new(0));
        let mut listeners = self.listeners.lock();
        if !listeners.ended {
            let mut mail = self.mail.lock();
            let lost = Arc::clone(&lost);
            listeners.list.push(Listener { kinds, since: mail.cycle, sender, capacity, lost });
            mail.listened = listeners.kinds();
        }
        drop(listeners);
        Events { receiver, lost, shared: Arc::clone(self) }
    }

    pub(super) fn unsubscribe(&self, lost: &Arc<AtomicU64>) {
        let mut listeners = self.listeners.lock();
        listeners.list.retain(|listener| !Arc::ptr_eq(&listener.lost, lost));
        self.mail.lock().listened = listeners.kinds();
    }

    /// Ends all channels, and those that are asked for later.
    pub(in crate::handler) fn end_listening(&self) {
        let mut listeners = self.listeners.lock();
        listeners.ended = true;
        listeners.list.clear();
        self.mail.lock().listened = KindSet::default();
    }
}
