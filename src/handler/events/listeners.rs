//! The listeners for events, and how they get them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, Sender};

use super::log::Logs;
use crate::events::{
    Comparison, Event, EventKind, KindSet, LogEntry, Logged, LoggedBeginning, Stalls, TimedEvent,
};
use crate::terminals::Motor;

/// The program's end of a new channel.
pub(super) struct Subscription<T> {
    pub(super) receiver: Receiver<T>,
    /// How many events or entries were lost; also identifies the channel.
    pub(super) lost: Arc<AtomicU64>,
}

/// All listeners and logs. One lock is enough: the transfer thread sends, and the program's threads subscribe and
/// unsubscribe.
#[derive(Debug, Default)]
pub(crate) struct Listeners {
    listeners: Vec<Listener>,
    /// Whether the handler was dropped.
    ended: bool,
    stalls: Stalls,
    pub(crate) logs: Logs,
    /// That the connection is lost, as long as it is.
    gap: Option<TimedEvent>,
}

#[derive(Debug)]
struct Listener {
    kinds: KindSet,
    /// The last response before it subscribed.
    since: u64,
    /// Has one more place than `capacity`, for the end of the transfer.
    sender: Sender<TimedEvent>,
    capacity: usize,
    /// Also identifies the listener.
    lost: Arc<AtomicU64>,
}

impl Listeners {
    /// Adds a listener for events after this response.
    pub(super) fn subscribe(
        &mut self,
        kinds: KindSet,
        capacity: usize,
        since: u64,
    ) -> Subscription<TimedEvent> {
        let (sender, receiver) = bounded(capacity + 1);
        let lost = Arc::new(AtomicU64::new(0));
        if !self.ended {
            let lost = Arc::clone(&lost);
            self.listeners.push(Listener { kinds, since, sender, capacity, lost });
        }
        Subscription { receiver, lost }
    }

    /// Removes the listener with this count.
    pub(super) fn unsubscribe(&mut self, lost: &Arc<AtomicU64>) {
        self.listeners.retain(|listener| !Arc::ptr_eq(&listener.lost, lost));
    }

    /// Ends all channels, including those of later subscriptions.
    pub(crate) fn end(&mut self) {
        self.ended = true;
        self.listeners.clear();
        self.logs.clear();
    }

    /// Adds a log. If a transfer runs already, its first entry is this beginning.
    pub(super) fn add_log(
        &mut self,
        capacity: usize,
        running: Option<LoggedBeginning>,
    ) -> Subscription<LogEntry> {
        if self.ended {
            return Logs::default().add(capacity, std::iter::empty());
        }
        let gap = self.gap.clone().map(Logged::Event);
        self.logs.add(capacity, running.map(Logged::Began).into_iter().chain(gap))
    }

    /// Sets the limit after which a motor's standstill is an event; with [`Duration::MAX`] never.
    pub(crate) fn set_stall_limit(&mut self, area: usize, motor: Motor, limit: Duration) {
        self.stalls.set_limit(area, motor, limit);
    }

    /// Sends the events of a response, which came in at this time as the transfer's `cycle`, to all listeners
    /// for their kinds. Does not block.
    pub(crate) fn send_response(
        &mut self,
        comparison: &Comparison<'_>,
        response: u64,
        cycle: u64,
        arrived: Instant,
    ) {
        let Self { listeners, stalls, .. } = self;
        let send = |event| send(listeners, &TimedEvent { event, cycle, arrived }, response);
        comparison.for_each_event(send);
        if comparison.kinds.contains(EventKind::MotorStalled) {
            stalls.look(comparison, response, arrived, send);
        }
    }

    /// Sends an event that comes from no response to all listeners for its kind, and to all logs. Does not
    /// block.
    pub(crate) fn send_all(&mut self, event: &TimedEvent) {
        match event.event {
            Event::ConnectionLost { .. } => self.gap = Some(event.clone()),
            Event::ConnectionRestored { .. } => self.gap = None,
            _ => {}
        }
        send(&self.listeners, event, u64::MAX);
        self.logs.note(&Logged::Event(event.clone()));
    }

    /// Sends the end of a transfer to all listeners, whatever they listen for, and to all logs. Does not block.
    pub(crate) fn send_end(&mut self, event: &TimedEvent) {
        self.gap = None;
        self.logs.note(&Logged::Event(event.clone()));
        for listener in &self.listeners {
            listener.put(event.clone(), listener.capacity + 1);
        }
    }

    /// The kinds of events that have listeners.
    pub(crate) fn kinds(&self) -> KindSet {
        self.listeners.iter().fold(KindSet::default(), |set, listener| set.union(listener.kinds))
    }
}

/// Sends an event of a response to all listeners for its kind. Does not block.
fn send(listeners: &[Listener], event: &TimedEvent, response: u64) {
    for listener in listeners.iter().filter(|listener| listener.since < response) {
        if listener.kinds.contains(event.event.kind()) {
            listener.put(event.clone(), listener.capacity);
        }
    }
}

impl Listener {
    /// Puts an event into the channel if that holds fewer than `limit`. No other thread does so while the
    /// listeners are locked, so there is still room.
    fn put(&self, event: TimedEvent, limit: usize) {
        if self.sender.len() >= limit || self.sender.try_send(event).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use crossbeam_channel::TryRecvError;

    use super::*;
    use crate::error::Error;
    use crate::events::Event;
    use crate::exchange::Inputs;
    use crate::handler::events::Events;
    use crate::handler::shared::Shared;

    const ENDED: Event = Event::TransferEnded { error: None };

    fn shared() -> Arc<Shared> {
        Arc::new(Shared::new(1, None, false))
    }

    fn subscribe(shared: &Arc<Shared>, kinds: &[EventKind], capacity: usize) -> Events {
        Events::new(Arc::clone(shared), kinds, capacity)
    }

    /// Sends the event that this extension has changed, from this response.
    fn send_change(shared: &Shared, extension: usize, response: u64) {
        send(&shared.listeners.lock().listeners, &now(came(extension)), response);
    }

    fn send_end(shared: &Shared, end: Event) {
        shared.listeners.lock().send_end(&now(end));
    }

    fn came(extension: usize) -> Event {
        Event::ExtensionChanged { extension, alive: true }
    }

    fn now(event: Event) -> TimedEvent {
        TimedEvent { event, cycle: 1, arrived: Instant::now() }
    }

    fn received(events: &Events) -> Vec<Event> {
        events.receiver().try_iter().map(|received| received.event).collect()
    }

    #[test]
    fn a_full_channel_keeps_its_events_and_counts_the_lost_ones() {
        let shared = shared();
        let events = subscribe(&shared, EventKind::ALL, 2);
        for extension in 1..=5 {
            send_change(&shared, extension, 1);
        }
        assert_eq!(events.lost(), 3);
        assert_eq!(received(&events), [came(1), came(2)]);
        send_change(&shared, 6, 2);
        assert_eq!((received(&events), events.lost()), (vec![came(6)], 3));
    }

    #[test]
    fn the_end_of_a_transfer_comes_even_into_a_full_channel() {
        let shared = shared();
        let events = subscribe(&shared, EventKind::ALL, 1);
        send_change(&shared, 1, 1);
        send_end(&shared, ENDED);
        assert_eq!(events.lost(), 0);
        // The next transfer's, while no event was received.
        send_change(&shared, 2, 2);
        send_end(&shared, Event::TransferEnded { error: Some(Error::ProgramPanicked) });
        assert_eq!(events.lost(), 2);
        assert_eq!(received(&events), [came(1), ENDED]);
    }

    #[test]
    fn the_end_of_a_transfer_takes_no_place_from_others_while_there_is_room() {
        let shared = shared();
        let events = subscribe(&shared, EventKind::ALL, 2);
        send_end(&shared, ENDED);
        send_change(&shared, 1, 1);
        send_change(&shared, 2, 1);
        send_end(&shared, ENDED);
        assert_eq!((received(&events), events.lost()), (vec![ENDED, came(1), ENDED], 1));
    }

    #[test]
    fn each_listener_gets_its_kinds_from_the_next_response_on() {
        let shared = shared();
        let ends = subscribe(&shared, &[EventKind::TransferEnded], 9);
        let extensions = subscribe(&shared, &[EventKind::ExtensionChanged], 9);
        let nothing = subscribe(&shared, &[], 9);
        for _ in 0..5 {
            shared.state().deliver(&Inputs::default());
        }
        let late = subscribe(&shared, EventKind::ALL, 9);
        send_change(&shared, 1, 5);
        send_change(&shared, 2, 6);
        send_end(&shared, ENDED);
        assert_eq!(received(&ends), [ENDED]);
        assert_eq!(received(&extensions), [came(1), came(2), ENDED]);
        assert_eq!(received(&nothing), [ENDED]);
        assert_eq!(received(&late), [came(2), ENDED]);
    }

    #[test]
    fn only_kinds_with_a_listener_are_compared() {
        let shared = shared();
        let listened = || shared.listeners.lock().kinds();
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
        let events = subscribe(&shared, EventKind::ALL, 1);
        let receiver = events.receiver().clone();
        drop(events);
        assert_eq!(receiver.try_recv(), Err(TryRecvError::Disconnected));
        let events = subscribe(&shared, EventKind::ALL, 1);
        send_change(&shared, 1, 1);
        shared.listeners.lock().end();
        assert_eq!(events.recv().unwrap().event, came(1), "what is in it can still be received");
        let late = subscribe(&shared, EventKind::ALL, 1);
        for ended in [events, late] {
            assert_eq!(ended.receiver().try_recv(), Err(TryRecvError::Disconnected));
        }
        assert!(shared.listeners.lock().kinds().is_empty());
    }
}
