//! Who listens for events, and how they get them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;

use crossbeam_channel::{bounded, Receiver, Sender};

use super::event::{Event, KindSet};
use crate::error::Error;
use crate::handler::sync::{Mutex, MutexGuard};

/// All who listen, for whom one lock is enough: the transfer thread tells, and the program's threads
/// come and go.
#[derive(Debug, Default)]
pub(in crate::handler) struct Listeners(Mutex<List>);

/// The listeners, locked.
#[derive(Debug, Default)]
pub(in crate::handler) struct List {
    listeners: Vec<Listener>,
    /// The newest response.
    response: u64,
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
    pub(in crate::handler) fn lock(&self) -> MutexGuard<'_, List> {
        self.0.lock()
    }

    /// Sends an event that no response tells to all whom it concerns. Does not block.
    pub(in crate::handler) fn tell_all(&self, event: &Event) {
        self.lock().tell(event, u64::MAX);
    }

    /// Adds a listener; gives its channel and the count of what it loses.
    pub(super) fn subscribe(
        &self,
        kinds: KindSet,
        capacity: usize,
    ) -> (Receiver<Event>, Arc<AtomicU64>) {
        let (sender, receiver) = bounded(capacity + 1);
        let lost = Arc::new(AtomicU64::new(0));
        let mut list = self.lock();
        if !list.ended {
            let (lost, since) = (Arc::clone(&lost), list.response);
            list.listeners.push(Listener { kinds, since, sender, capacity, lost });
        }
        (receiver, lost)
    }

    /// Removes the listener with this count.
    pub(super) fn unsubscribe(&self, lost: &Arc<AtomicU64>) {
        self.lock().listeners.retain(|listener| !Arc::ptr_eq(&listener.lost, lost));
    }

    /// Ends all channels, and those that are asked for later.
    pub(in crate::handler) fn end(&self) {
        let mut list = self.lock();
        list.ended = true;
        list.listeners.clear();
    }
}

impl List {
    /// A response has come in; tells of which events somebody wants to hear.
    pub(in crate::handler) fn note_response(&mut self, number: u64) -> KindSet {
        self.response = number;
        self.kinds()
    }

    /// Sends an event of a response to all whom it concerns. Does not block.
    pub(in crate::handler) fn tell(&self, event: &Event, response: u64) {
        for listener in self.listeners.iter().filter(|listener| listener.since < response) {
            if listener.kinds.contains(event.kind()) {
                listener.put(event.clone(), listener.capacity);
            }
        }
    }

    /// Tells all whom it concerns of the end of a transfer. Does not block.
    pub(in crate::handler) fn tell_end(&self, error: Option<Error>) {
        let event = Event::TransferEnded { error };
        let concerned = |listener: &&Listener| listener.kinds.contains(event.kind());
        for listener in self.listeners.iter().filter(concerned) {
            listener.put(event.clone(), listener.capacity + 1);
        }
    }

    fn kinds(&self) -> KindSet {
        self.listeners.iter().fold(KindSet::default(), |set, listener| set.union(listener.kinds))
    }
}

impl Listener {
    /// Puts an event into the channel when that holds fewer than `limit`. Nobody else does so while the
    /// listeners are locked, so there is still room then.
    fn put(&self, event: Event, limit: usize) {
        if self.sender.len() >= limit || self.sender.try_send(event).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use crossbeam_channel::TryRecvError;

    use super::*;
    use crate::handler::events::{EventKind, Events};

    const ENDED: Event = Event::TransferEnded { error: None };

    fn listeners() -> Arc<Listeners> {
        Arc::default()
    }

    fn subscribe(listeners: &Arc<Listeners>, kinds: &[EventKind], capacity: usize) -> Events {
        Events::new(listeners, kinds, capacity, || ())
    }

    fn came(extension: usize) -> Event {
        Event::ExtensionChanged { extension, alive: true }
    }

    fn received(events: &Events) -> Vec<Event> {
        events.receiver().try_iter().collect()
    }

    #[test]
    fn a_full_channel_keeps_what_it_has_and_counts_what_it_has_no_place_for() {
        let listeners = listeners();
        let events = subscribe(&listeners, &EventKind::ALL, 2);
        for extension in 1..=5 {
            listeners.lock().tell(&came(extension), 1);
        }
        assert_eq!(events.lost(), 3);
        assert_eq!(received(&events), [came(1), came(2)]);
        listeners.lock().tell(&came(6), 2);
        assert_eq!((received(&events), events.lost()), (vec![came(6)], 3));
    }

    #[test]
    fn the_end_of_a_transfer_comes_even_into_a_full_channel() {
        let listeners = listeners();
        let events = subscribe(&listeners, &EventKind::ALL, 1);
        listeners.lock().tell(&came(1), 1);
        listeners.lock().tell_end(None);
        assert_eq!(events.lost(), 0);
        // Of the next transfer, while nobody has looked.
        listeners.lock().tell(&came(2), 2);
        listeners.lock().tell_end(Some(Error::ProgramPanicked));
        assert_eq!(events.lost(), 2);
        assert_eq!(received(&events), [came(1), ENDED]);
    }

    #[test]
    fn an_end_takes_no_place_from_others_while_there_is_room() {
        let listeners = listeners();
        let events = subscribe(&listeners, &EventKind::ALL, 2);
        listeners.lock().tell_end(None);
        listeners.lock().tell(&came(1), 1);
        listeners.lock().tell(&came(2), 1);
        listeners.lock().tell_end(None);
        assert_eq!((received(&events), events.lost()), (vec![ENDED, came(1), ENDED], 1));
    }

    #[test]
    fn each_gets_the_kinds_it_asked_for_from_the_next_response_on() {
        let listeners = listeners();
        let ends = subscribe(&listeners, &[EventKind::TransferEnded], 9);
        let extensions = subscribe(&listeners, &[EventKind::ExtensionChanged], 9);
        let nothing = subscribe(&listeners, &[], 9);
        listeners.lock().note_response(5);
        let late = subscribe(&listeners, &EventKind::ALL, 9);
        listeners.lock().tell(&came(1), 5);
        listeners.lock().tell(&came(2), 6);
        listeners.lock().tell_end(None);
        assert_eq!(received(&ends), [ENDED]);
        assert_eq!(received(&extensions), [came(1), came(2)]);
        assert_eq!(received(&nothing), []);
        assert_eq!(received(&late), [came(2), ENDED]);
    }

    #[test]
    fn what_is_compared_is_what_somebody_listens_for() {
        let listeners = listeners();
        let listened = || listeners.lock().kinds();
        let set = |kinds: &[EventKind]| kinds.iter().copied().collect::<KindSet>();
        assert!(listened().is_empty());
        let some = subscribe(&listeners, &[EventKind::InputChanged, EventKind::CounterReset], 1);
        let others = subscribe(&listeners, &[EventKind::CounterReset, EventKind::MotorReached], 1);
        let all = [EventKind::InputChanged, EventKind::CounterReset, EventKind::MotorReached];
        assert_eq!(listened(), set(&all));
        drop(some);
        assert_eq!(listened(), set(&[EventKind::CounterReset, EventKind::MotorReached]));
        drop(others);
        assert!(listened().is_empty());
    }

    #[test]
    fn a_channel_ends_with_its_subscription_and_with_the_handler() {
        let listeners = listeners();
        let events = subscribe(&listeners, &EventKind::ALL, 1);
        let receiver = events.receiver().clone();
        drop(events);
        assert_eq!(receiver.try_recv(), Err(TryRecvError::Disconnected));
        let events = subscribe(&listeners, &EventKind::ALL, 1);
        listeners.lock().tell(&came(1), 1);
        listeners.end();
        assert_eq!(events.recv(), Ok(came(1)), "what is in it can still be received");
        let late = subscribe(&listeners, &EventKind::ALL, 1);
        for ended in [events, late] {
            assert_eq!(ended.receiver().try_recv(), Err(TryRecvError::Disconnected));
        }
        assert!(listeners.lock().kinds().is_empty());
    }
}
