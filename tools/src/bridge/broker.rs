//! The connection to the broker: established again whenever it is lost, each time as a new client session.

use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use crossbeam_channel::{bounded, Receiver, Sender, TrySendError};
use rumqttc::{
    AsyncClient, ConnectReturnCode, ConnectionError, Event, EventLoop, LastWill, MqttOptions,
    NetworkOptions, Outgoing, Packet, QoS, StateError, SubscribeFilter, SubscribeReasonCode,
};
use tokio::runtime;
use tokio::time::{timeout_at, Instant};

/// How many messages wait for the broker at most.
const QUEUE: usize = 10_000;

/// How many messages from the broker wait at most. A cycle of the controller takes all of them.
const INBOX: usize = 1000;

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
    /// So many messages came faster than they could be carried out.
    Dropped(u64),
}

pub(crate) struct Message {
    pub(crate) topic: String,
    pub(crate) payload: Vec<u8>,
    /// Whether the broker has kept it since some earlier time.
    pub(crate) retained: bool,
}

/// Sends messages on one connection. Never blocks.
pub(crate) struct Publisher(AsyncClient);

impl Publisher {
    /// Hands over a message; `false` when too many wait already.
    pub(crate) fn send(&self, topic: &str, retain: bool, payload: impl Into<Vec<u8>>) -> bool {
        self.0.try_publish(topic, QoS::AtLeastOnce, retain, payload).is_ok()
    }

    /// Ends the connection behind all messages.
    pub(crate) fn leave(&self) -> bool {
        self.0.try_disconnect().is_ok()
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
        filters: Vec<String>,
    ) -> anyhow::Result<Receiver<BrokerEvent>> {
        let (sender, receiver) = bounded(INBOX);
        let runtime = runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("the operating system gives no means to wait for the broker")?;
        let client = Client { broker: self.clone(), will, filters, events: sender, dropped: 0 };
        thread::Builder::new()
            .name("broker".to_owned())
            .spawn(move || runtime.block_on(client.run()))
            .context("the operating system refuses a thread")?;
        Ok(receiver)
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

    /// Why a connection failed, as a sentence.
    fn reason(&self, error: &ConnectionError) -> String {
        let at = format!("the broker at {}:{}", self.host, self.port);
        match error {
            ConnectionError::Io(cause) => {
                format!("{at} can't be reached ({cause}); check its address and that it runs")
            }
            ConnectionError::ConnectionRefused(code) => refusal(&at, *code),
            ConnectionError::MqttState(StateError::Io(cause)) => {
                format!("the connection to {at} broke ({cause})")
            }
            ConnectionError::MqttState(StateError::ConnectionAborted) => {
                format!("{at} closed the connection")
            }
            ConnectionError::NetworkTimeout
            | ConnectionError::FlushTimeout
            | ConnectionError::MqttState(StateError::AwaitPingResp) => self.silent(),
            other => format!(
                "{at} sent what is not MQTT 3.1.1, or a message of more than {MESSAGE_LIMIT} bytes \
                 ({other})"
            ),
        }
    }

    fn silent(&self) -> String {
        let Self { host, port, limit, .. } = self;
        format!("the broker at {host}:{port} was silent for {limit:?}; check it and the network")
    }
}

fn refusal(at: &str, code: ConnectReturnCode) -> String {
    match code {
        ConnectReturnCode::BadUserNamePassword | ConnectReturnCode::NotAuthorized => format!(
            "{at} refuses this user; check --user, and the password in the environment variable \
             TXT_MQTT_PASSWORD"
        ),
        other => format!("{at} refuses the connection ({other:?})"),
    }
}

/// One client of the broker, in its thread.
struct Client {
    broker: Broker,
    will: LastWill,
    filters: Vec<String>,
    events: Sender<BrokerEvent>,
    /// Messages for which there was no room.
    dropped: u64,
}

/// Why a connection has ended.
enum End {
    /// The bridge wants no more.
    Done,
    Failed(BrokerEvent),
}

impl Client {
    async fn run(mut self) {
        loop {
            match self.session().await {
                End::Done => return,
                End::Failed(event) => {
                    if self.events.send(event).is_err() {
                        return;
                    }
                }
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// One connection from its beginning to its end.
    async fn session(&mut self) -> End {
        let (client, mut events) = AsyncClient::new(self.broker.options(self.will.clone()), QUEUE);
        let mut network = NetworkOptions::new();
        network.set_tcp_nodelay(true);
        network.set_connection_timeout(self.broker.limit.as_secs().max(1));
        events.set_network_options(network);
        let mut heard = Instant::now();
        let mut leaving = false;
        loop {
            match self.next(&mut events, heard).await {
                Ok(Event::Incoming(packet)) => {
                    heard = Instant::now();
                    if let Err(end) = self.take(packet, &client) {
                        return end;
                    }
                }
                // The broker closes the connection when it has read everything.
                Ok(Event::Outgoing(Outgoing::Disconnect)) => leaving = true,
                Ok(Event::Outgoing(_)) => {}
                Err(_) if leaving => return End::Done,
                Err(end) => return end,
            }
        }
    }

    /// What happens next on the connection, unless the broker is silent for too long.
    async fn next(&self, events: &mut EventLoop, heard: Instant) -> Result<Event, End> {
        let Ok(polled) = timeout_at(heard + self.broker.limit, events.poll()).await else {
            return Err(End::Failed(BrokerEvent::Down(self.broker.silent())));
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

    fn take(&mut self, packet: Packet, client: &AsyncClient) -> Result<(), End> {
        match packet {
            Packet::ConnAck(_) => {
                let filter = |path: &String| SubscribeFilter::new(path.clone(), QoS::AtLeastOnce);
                let asked = client.try_subscribe_many(self.filters.iter().map(filter));
                asked.map_err(|error| End::Failed(BrokerEvent::Down(error.to_string())))
            }
            Packet::SubAck(answer) => {
                if answer.return_codes.contains(&SubscribeReasonCode::Failure) {
                    let reason = "the broker does not let this user read its commands; check its \
                                  access list";
                    return Err(End::Failed(BrokerEvent::Refused(reason.to_owned())));
                }
                self.events.send(BrokerEvent::Up(Publisher(client.clone()))).map_err(|_| End::Done)
            }
            Packet::Publish(message) => self.hand_over(Message {
                topic: message.topic,
                payload: message.payload.to_vec(),
                retained: message.retain,
            }),
            _ => Ok(()),
        }
    }

    /// Never waits for room: the broker would think that this client is dead.
    fn hand_over(&mut self, message: Message) -> Result<(), End> {
        if self.dropped > 0 && self.events.try_send(BrokerEvent::Dropped(self.dropped)).is_ok() {
            self.dropped = 0;
        }
        match self.events.try_send(BrokerEvent::Message(message)) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                self.dropped += 1;
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => Err(End::Done),
        }
    }
}

/// A number that no other client has.
pub(crate) fn random() -> u64 {
    RandomState::new().build_hasher().finish()
}

/// `HOST`, `HOST:PORT`, `[::1]:PORT`, each also behind `mqtt://`.
fn host_and_port(address: &str) -> anyhow::Result<(String, u16)> {
    let given = address.strip_prefix("mqtt://").unwrap_or(address).trim_end_matches('/');
    let wrong = || {
        format!(
            "{address:?} is no address of a broker; write its host, as 192.168.1.5, or with a port, \
             as 192.168.1.5:1883 or [::1]:1883"
        )
    };
    let (host, port) = match given.rsplit_once(':') {
        Some((host, port)) if !host.contains(':') || host.ends_with(']') => (host, Some(port)),
        Some(_) if !given.starts_with('[') => anyhow::bail!(wrong()),
        _ => (given, None),
    };
    let allowed = |c: char| c.is_alphanumeric() || ".-_:[]".contains(c);
    if host.is_empty() || !host.chars().all(allowed) {
        anyhow::bail!(wrong());
    }
    let port = port.map_or(Ok(1883), str::parse).with_context(wrong)?;
    anyhow::ensure!(port > 0, wrong());
    Ok((host.to_owned(), port))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_with_or_without_a_port() {
        let found = |address| host_and_port(address).map_err(|error| error.to_string());
        for (address, host, port) in [
            ("broker", "broker", 1883),
            ("192.168.1.5:1884", "192.168.1.5", 1884),
            ("mqtt://broker/", "broker", 1883),
            ("[::1]", "[::1]", 1883),
            ("[::1]:7", "[::1]", 7),
        ] {
            assert_eq!(found(address), Ok((host.to_owned(), port)), "{address}");
        }
        let wrong = ["", ":1883", "broker:", "broker:0", "broker:70000", "::1", "mqtts://b", "a b"];
        for address in wrong {
            let error = found(address).unwrap_err();
            assert!(error.contains("is no address of a broker"), "{address}: {error}");
        }
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
