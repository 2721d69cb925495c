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
    pub(in crate::handler) fn tell(&self, event: &Event, response: u64) {
        for listener in self.list.iter().filter(|listener| listener.since < response) {
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
            listeners.list.push(Listener { kinds, since: mail.delivered, sender, capacity, lost });
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

#[cfg(test)]
mod tests {
    use crossbeam_channel::TryRecvError;

    use super::*;
    use crate::handler::events::EventKind;

    const ENDED: Event = Event::TransferEnded { error: None };

    fn shared() -> Arc<Shared> {
        Arc::new(Shared::new(1))
    }

    fn subscribe(shared: &Arc<Shared>, kinds: &[EventKind], capacity: usize) -> Events {
        shared.subscribe(kinds.iter().copied().collect(), capacity)
    }

    fn came(extension: usize) -> Event {
        Event::ExtensionChanged { extension, alive: true }
    }

    fn received(events: &Events) -> Vec<Event> {
        events.receiver().try_iter().collect()
    }

    #[test]
    fn a_full_channel_keeps_what_it_has_and_counts_what_it_has_no_place_for() {
        let shared = shared();
        let events = subscribe(&shared, &EventKind::ALL, 2);
        for extension in 1..=5 {
            shared.listeners.lock().tell(&came(extension), 1);
        }
        assert_eq!(events.lost(), 3);
        assert_eq!(received(&events), [came(1), came(2)]);
        shared.listeners.lock().tell(&came(6), 2);
        assert_eq!((received(&events), events.lost()), (vec![came(6)], 3));
    }

    #[test]
    fn the_end_of_a_transfer_comes_even_into_a_full_channel() {
        let shared = shared();
        let events = subscribe(&shared, &EventKind::ALL, 1);
        shared.listeners.lock().tell(&came(1), 1);
        shared.listeners.lock().tell_end(None);
        assert_eq!(events.lost(), 0);
        // Of the next transfer, while nobody has looked.
        shared.listeners.lock().tell(&came(2), 2);
        shared.listeners.lock().tell_end(Some(Error::ProgramPanicked));
        assert_eq!(events.lost(), 2);
        assert_eq!(received(&events), [came(1), ENDED]);
    }

    #[test]
    fn an_end_takes_no_place_from_others_while_there_is_room() {
        let shared = shared();
        let events = subscribe(&shared, &EventKind::ALL, 2);
        shared.listeners.lock().tell_end(None);
        shared.listeners.lock().tell(&came(1), 1);
        shared.listeners.lock().tell(&came(2), 1);
        shared.listeners.lock().tell_end(None);
        assert_eq!((received(&events), events.lost()), (vec![ENDED, came(1), ENDED], 1));
    }

    #[test]
    fn each_gets_the_kinds_it_asked_for_from_the_next_response_on() {
        let shared = shared();
        let ends = subscribe(&shared, &[EventKind::TransferEnded], 9);
        let extensions = subscribe(&shared, &[EventKind::ExtensionChanged], 9);
        let nothing = subscribe(&shared, &[], 9);
        shared.mail.lock().delivered = 5;
        let late = subscribe(&shared, &EventKind::ALL, 9);
        shared.listeners.lock().tell(&came(1), 5);
        shared.listeners.lock().tell(&came(2), 6);
        shared.listeners.lock().tell_end(None);
        assert_eq!(received(&ends), [ENDED]);
        assert_eq!(received(&extensions), [came(1), came(2)]);
        assert_eq!(received(&nothing), []);
        assert_eq!(received(&late), [came(2), ENDED]);
    }

    #[test]
    fn what_is_compared_is_what_somebody_listens_for() {
        let shared = shared();
        let listened = || shared.mail.lock().listened;
        let set = |kinds: &[EventKind]| kinds.iter().copied().collect::<KindSet>();
        assert!(listened().is_empty());
        let some = subscribe(&shared, &[EventKind::InputChanged, EventKind::CounterReset], 1);
        let others = subscribe(&shared, &[EventKind::CounterReset, EventKind::MotorReached], 1);
        let all = [EventKind::InputChanged, EventKind::CounterReset, EventKind::MotorReached];
        assert_eq!(listened(), set(&all));
        drop(some);
        assert_eq!(listened(), set(&[EventKind::CounterReset, EventKind::MotorReached]));
        drop(others);
        assert!(listened().is_empty());
    }

    #[test]
    fn a_channel_ends_with_its_subscription_and_with_the_handler() {
        let shared = shared();
        let events = subscribe(&shared, &EventKind::ALL, 1);
        let receiver = events.receiver().clone();
        drop(events);
        assert_eq!(receiver.try_recv(), Err(TryRecvError::Disconnected));
        let events = subscribe(&shared, &EventKind::ALL, 1);
        shared.listeners.lock().tell(&came(1), 1);
        shared.end_listening();
        assert_eq!(events.recv(), Ok(came(1)), "what is in it can still be received");
        let late = subscribe(&shared, &EventKind::ALL, 1);
        for ended in [events, late] {
            assert_eq!(ended.receiver().try_recv(), Err(TryRecvError::Disconnected));
        }
        assert!(shared.mail.lock().listened.is_empty());
    }
}
