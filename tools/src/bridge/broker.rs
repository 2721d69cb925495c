//! The connection to the broker: established again whenever it is lost, each time as a new client session.

mod address;
mod freshness;
mod reason;

use std::collections::hash_map::RandomState;
use std::collections::{HashSet, VecDeque};
use std::hash::{BuildHasher, Hasher};
use std::pin::pin;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use crossbeam_channel::{bounded, Receiver, RecvTimeoutError, Sender, TryRecvError, TrySendError};
use rumqttc::{
    AsyncClient, ConnectReturnCode, ConnectionError, Event, EventLoop, LastWill, MqttOptions,
    NetworkOptions, Outgoing, Packet, QoS, SubscribeFilter, SubscribeReasonCode,
};
use tokio::net::lookup_host;
use tokio::task::JoinHandle;
use tokio::time::{sleep_until, timeout};
use tokio::{runtime, select};

use self::address::host_and_port;
use self::freshness::Freshness;

/// How many messages wait for the broker at most, and with how many bytes. Most have some hundred; a state with names has
/// more.
const QUEUE: usize = 10_000;
const QUEUE_BYTES: usize = 8 << 20;

/// How many messages from the broker wait at most, and with how many bytes. A cycle of the controller takes all of them.
const INBOX: usize = 1000;
const INBOX_BYTES: usize = 4 << 20;

/// A larger message ends the connection, so that nobody can fill the memory.
const MESSAGE_LIMIT: usize = 1 << 20;

/// How long to wait before the next attempt.
const PAUSE: Duration = Duration::from_secs(1);

/// Which broker, and how.
#[derive(Clone, Debug)]
pub(crate) struct Broker {
    host: String,
    port: u16,
    login: Option<(String, String)>,
    /// How long it may be silent.
    limit: Duration,
}

/// What comes from the broker.
pub(crate) enum BrokerEvent {
    /// There is a connection, and commands come in.
    Up(Publisher),
    /// The connection was lost or not made; the sentence says why.
    Down(String),
    /// The broker does not want this client.
    Refused(String),
    Message(Message),
}

pub(crate) struct Message {
    pub(crate) topic: String,
    pub(crate) payload: Vec<u8>,
    /// Whether the broker has kept it since some earlier time.
    pub(crate) retained: bool,
    /// It has not arrived at this computer before.
    pub(crate) not_before: Instant,
}

/// What has come from the broker and was not read yet.
pub(crate) struct Inbox {
    events: Receiver<BrokerEvent>,
    /// Messages for which there was no room.
    missed: Arc<AtomicU64>,
    /// The bytes of those that wait.
    bytes: Arc<AtomicUsize>,
}

impl Message {
    fn bytes(&self) -> usize {
        self.topic.len() + self.payload.len()
    }
}

impl Inbox {
    /// How many messages were lost since the last call. They came after those that are still to be read.
    pub(crate) fn missed(&self) -> u64 {
        self.missed.swap(0, Ordering::AcqRel)
    }

    pub(crate) fn read(&self) -> Result<BrokerEvent, TryRecvError> {
        self.events.try_recv().inspect(|event| self.taken(event))
    }

    pub(crate) fn wait(&self, deadline: Instant) -> Result<BrokerEvent, RecvTimeoutError> {
        self.events.recv_deadline(deadline).inspect(|event| self.taken(event))
    }

    fn taken(&self, event: &BrokerEvent) {
        if let BrokerEvent::Message(message) = event {
            self.bytes.fetch_sub(message.bytes(), Ordering::Relaxed);
        }
    }
}

/// Where the thread of a connection leaves what has come.
pub(crate) struct Outlet {
    events: Sender<BrokerEvent>,
    missed: Arc<AtomicU64>,
    bytes: Arc<AtomicUsize>,
}

/// Nobody reads any more.
#[derive(Debug)]
pub(crate) struct Unread;

impl Outlet {
    pub(crate) fn new() -> (Self, Inbox) {
        let ((events, receiver), missed) = (bounded(INBOX), Arc::new(AtomicU64::new(0)));
        let bytes = Arc::new(AtomicUsize::new(0));
        let outlet = Self { events, missed: Arc::clone(&missed), bytes: Arc::clone(&bytes) };
        (outlet, Inbox { events: receiver, missed, bytes })
    }

    /// Leaves what happened to the connection. It is never lost.
    fn publish(&self, event: BrokerEvent) -> Result<(), Unread> {
        self.events.send(event).map_err(|_| Unread)
    }

    /// Leaves a message. Never waits for room: the broker would think that this client is dead.
    pub(crate) fn leave(&self, message: Message) -> Result<(), Unread> {
        let size = message.bytes();
        // Only this thread adds.
        if self.bytes.load(Ordering::Relaxed) + size <= INBOX_BYTES {
            self.bytes.fetch_add(size, Ordering::Relaxed);
            match self.events.try_send(BrokerEvent::Message(message)) {
                Ok(()) => return Ok(()),
                Err(TrySendError::Full(_)) => drop(self.bytes.fetch_sub(size, Ordering::Relaxed)),
                Err(TrySendError::Disconnected(_)) => return Err(Unread),
            }
        }
        self.missed.fetch_add(1, Ordering::AcqRel);
        Ok(())
    }
}

/// What a client asks for.
pub(crate) struct Subscription {
    pub(crate) filters: Vec<String>,
    /// Topics that the filters match, but nobody wants to read.
    pub(crate) unread: HashSet<String>,
}

/// Sends messages on one connection. Never blocks.
pub(crate) struct Publisher {
    client: AsyncClient,
    waiting: Arc<Mutex<Waiting>>,
}

/// The sizes of the messages that wait, in their order.
#[derive(Default)]
struct Waiting {
    sizes: VecDeque<usize>,
    bytes: usize,
}

impl Waiting {
    /// The first one is on its way.
    fn is_sent(&mut self) {
        self.bytes -= self.sizes.pop_front().unwrap_or(0);
    }
}

fn lock(waiting: &Mutex<Waiting>) -> MutexGuard<'_, Waiting> {
    waiting.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Publisher {
    #[cfg(test)]
    pub(crate) fn of(client: AsyncClient) -> Self {
        Self { client, waiting: Arc::default() }
    }

    /// Hands over a message; `false` when too many wait already.
    pub(crate) fn send(&self, topic: &str, retain: bool, payload: impl Into<Vec<u8>>) -> bool {
        let payload = payload.into();
        let size = topic.len() + payload.len();
        // Also while it is handed over: it may be sent at once.
        let mut waiting = lock(&self.waiting);
        let fits = waiting.bytes + size <= QUEUE_BYTES
            && self.client.try_publish(topic, QoS::AtLeastOnce, retain, payload).is_ok();
        if fits {
            waiting.bytes += size;
            waiting.sizes.push_back(size);
        }
        fits
    }

    /// Ends the connection behind all messages.
    pub(crate) fn leave(&self) -> bool {
        self.client.try_disconnect().is_ok()
    }
}

impl Broker {
    pub(crate) fn new(
        address: &str,
        login: Option<(String, String)>,
        limit: Duration,
    ) -> anyhow::Result<Self> {
        let (host, port) = host_and_port(address)?;
        Ok(Self { host, port, login, limit })
    }

    /// Connects in a thread of its own, which ends with the receiver, or after [`Publisher::leave`].
    pub(crate) fn connect(
        &self,
        will: LastWill,
        subscription: Subscription,
    ) -> anyhow::Result<Inbox> {
        let (outlet, inbox) = Outlet::new();
        let runtime = runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("the operating system provides no way to wait for the broker")?;
        let client = Client { broker: self.clone(), will, subscription, outlet, lookup: None };
        thread::Builder::new()
            .name("broker".to_owned())
            .spawn(move || runtime.block_on(client.run()))
            .context("the operating system could not start a thread")?;
        Ok(inbox)
    }

    fn options(&self, will: LastWill) -> MqttOptions {
        // No two sessions are the same: the broker would end the older one.
        let mut options =
            MqttOptions::new(format!("txt-{:016x}", random()), &*self.host, self.port);
        let keep_alive = (self.limit / 2).max(Duration::from_secs(1));
        // Nothing of an earlier session comes later, so no old command moves a motor.
        options.set_clean_session(true).set_keep_alive(keep_alive);
        options.set_last_will(will).set_max_packet_size(MESSAGE_LIMIT, MESSAGE_LIMIT);
        if let Some((user, password)) = &self.login {
            options.set_credentials(user, password);
        }
        options
    }
}

/// One client of the broker, in its thread.
struct Client {
    broker: Broker,
    will: LastWill,
    subscription: Subscription,
    outlet: Outlet,
    /// Looks up the broker's name.
    lookup: Option<JoinHandle<()>>,
}

/// Why a connection has ended.
enum End {
    /// The bridge wants no more.
    Done,
    Failed(BrokerEvent),
}

impl From<Unread> for End {
    fn from(Unread: Unread) -> Self {
        Self::Done
    }
}

impl Client {
    async fn run(mut self) {
        loop {
            match self.session().await {
                End::Done => return,
                End::Failed(event) => {
                    if self.outlet.publish(event).is_err() {
                        return;
                    }
                }
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// One connection from its beginning to its end.
    async fn session(&mut self) -> End {
        if !self.is_found().await {
            return End::Failed(BrokerEvent::Down(self.broker.silent()));
        }
        let (client, mut events) = AsyncClient::new(self.broker.options(self.will.clone()), QUEUE);
        let mut network = NetworkOptions::new();
        network.set_tcp_nodelay(true);
        network.set_connection_timeout(self.broker.limit.as_secs().max(1));
        events.set_network_options(network);
        let mut heard = Instant::now();
        let mut freshness = Freshness::new(heard);
        let mut leaving = false;
        let waiting = Arc::<Mutex<Waiting>>::default();
        loop {
            match self.next(&mut events, heard, &mut freshness).await {
                Ok(Event::Incoming(packet)) => {
                    heard = Instant::now();
                    if let Err(end) = self.take(packet, &client, &waiting, freshness.not_before()) {
                        return end;
                    }
                }
                // The broker closes the connection when it has read everything.
                Ok(Event::Outgoing(Outgoing::Disconnect)) => leaving = true,
                Ok(Event::Outgoing(Outgoing::Publish(_))) => lock(&waiting).is_sent(),
                Ok(Event::Outgoing(_)) => {}
                Err(_) if leaving => return End::Done,
                Err(end) => return end,
            }
        }
    }

    /// Waits until name servers answer who has the broker's name; the connection asks them again. Nothing interrupts a
    /// lookup: so the next attempt waits for the same one, and they do not add up.
    async fn is_found(&mut self) -> bool {
        let place = (self.broker.host.clone(), self.broker.port);
        let look_up = || tokio::spawn(async move { drop(lookup_host(place).await) });
        let is_found =
            timeout(self.broker.limit, self.lookup.get_or_insert_with(look_up)).await.is_ok();
        if is_found {
            self.lookup = None;
        }
        is_found
    }

    /// What happens next on the connection, unless the broker is silent for too long.
    async fn next(
        &self,
        events: &mut EventLoop,
        heard: Instant,
        freshness: &mut Freshness,
    ) -> Result<Event, End> {
        let mut event = pin!(events.poll());
        let mut silent = pin!(sleep_until((heard + self.broker.limit).into()));
        let polled = loop {
            // In this order: while something waits, neither is the broker silent nor is the connection empty.
            select! {
                biased;
                polled = &mut event => break polled,
                () = &mut silent => {
                    return Err(End::Failed(BrokerEvent::Down(self.broker.silent())));
                }
                () = sleep_until(freshness.next_look().into()) => {
                    freshness.nothing_waits(Instant::now());
                }
            }
        };
        polled.map_err(|error| {
            let reason = self.broker.reason(&error);
            End::Failed(match error {
                ConnectionError::ConnectionRefused(code)
                    if code != ConnectReturnCode::ServiceUnavailable =>
                {
                    BrokerEvent::Refused(reason)
                }
                _ => BrokerEvent::Down(reason),
            })
        })
    }

    fn take(
        &self,
        packet: Packet,
        client: &AsyncClient,
        waiting: &Arc<Mutex<Waiting>>,
        not_before: Instant,
    ) -> Result<(), End> {
        match packet {
            Packet::ConnAck(_) => {
                let filter = |path: &String| SubscribeFilter::new(path.clone(), QoS::AtLeastOnce);
                let asked = client.try_subscribe_many(self.subscription.filters.iter().map(filter));
                asked.map_err(|error| End::Failed(BrokerEvent::Down(error.to_string())))
            }
            Packet::SubAck(answer) => {
                if answer.return_codes.contains(&SubscribeReasonCode::Failure) {
                    let reason = "the broker does not let this user read its commands; check its \
                                  access list";
                    return Err(End::Failed(BrokerEvent::Refused(reason.to_owned())));
                }
                let (client, waiting) = (client.clone(), Arc::clone(waiting));
                Ok(self.outlet.publish(BrokerEvent::Up(Publisher { client, waiting }))?)
            }
            Packet::Publish(message) if self.subscription.unread.contains(&message.topic) => Ok(()),
            Packet::Publish(message) => Ok(self.outlet.leave(Message {
                topic: message.topic,
                payload: message.payload.to_vec(),
                retained: message.retain,
                not_before,
            })?),
            _ => Ok(()),
        }
    }
}

/// A number that no other client has.
pub(crate) fn random() -> u64 {
    RandomState::new().build_hasher().finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_for_the_broker_has_room_for_so_many_bytes() {
        let (client, _events) = AsyncClient::new(MqttOptions::new("a", "localhost", 1), QUEUE);
        let publisher = Publisher::of(client);
        let state = vec![0; 32 << 10];
        let sent = (0..QUEUE).take_while(|_| publisher.send("a", true, state.clone())).count();
        assert!((200..256).contains(&sent), "{sent}");
        lock(&publisher.waiting).is_sent();
        assert!(publisher.send("a", true, state.clone()) && !publisher.send("a", true, state));
    }

    #[test]
    fn the_inbox_has_room_for_so_many_bytes() {
        let (outlet, inbox) = Outlet::new();
        let leave = |size| {
            let (topic, payload) = (String::new(), vec![0; size]);
            let message = Message { topic, payload, retained: false, not_before: Instant::now() };
            outlet.leave(message).unwrap();
            inbox.missed()
        };
        assert_eq!([leave(INBOX_BYTES), leave(1)], [0, 1]);
        assert!(matches!(inbox.read(), Ok(BrokerEvent::Message(_))));
        assert_eq!((0..INBOX).map(|_| leave(1)).sum::<u64>(), 0);
        assert_eq!([leave(1), leave(1)], [1, 1]);
        while inbox.read().is_ok() {}
        assert_eq!([leave(INBOX_BYTES), leave(1)], [0, 1]);
    }

    #[test]
    fn two_clients_never_have_one_id() {
        let broker = Broker::new("127.0.0.1", None, Duration::from_secs(4)).unwrap();
        let will = || LastWill::new("ft/a/state", "", QoS::AtLeastOnce, true);
        let ids = [(); 2].map(|()| broker.options(will()).client_id());
        assert_ne!(ids[0], ids[1]);
        // What every broker has to take.
        assert!(ids.iter().all(|id| id.len() <= 23), "{ids:?}");
    }
}
