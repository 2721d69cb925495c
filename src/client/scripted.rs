//! A transport for tests, without a network and with a clock of its own: a script says what happens
//! when, and the calls are recorded.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use super::limits::TimeLimits;
use super::transport::{Addresses, Close, Endpoint, Network, Transport};
use crate::error::Error;

/// The limits of a scripted connection.
pub(crate) const LIMITS: TimeLimits = TimeLimits {
    connect: Duration::from_secs(1),
    read: Duration::from_millis(300),
    write: Duration::from_millis(200),
};

/// For events that come immediately.
pub(crate) const NO_WAIT: Duration = Duration::ZERO;

/// What happens to a system call.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    /// These bytes come in; when a call can't take them all, the next one gets the rest.
    Bytes(Vec<u8>),
    /// At most this many bytes are written.
    Room(usize),
    Error(ErrorKind),
    /// The whole program stands still for this time, also beyond a limit; a signal ends this.
    Suspended(Duration),
    /// The other side closes its direction.
    End,
}

/// Events, each with its time after the previous one.
pub(crate) type Script = Vec<(Duration, Event)>;

/// A signal every 100 ms for much longer than any limit.
pub(crate) fn storm() -> Script {
    vec![(Duration::from_millis(100), Event::Error(ErrorKind::Interrupted)); 1000]
}

/// Events without a wait between them.
pub(crate) fn at_once<const N: usize>(events: [Event; N]) -> Script {
    events.map(|event| (NO_WAIT, event)).into()
}

/// The test's handle to a transport that the connection owns.
#[derive(Clone, Debug)]
pub(crate) struct Scripted(Arc<Mutex<State>>);

#[derive(Debug)]
pub(crate) struct State {
    begin: Instant,
    /// The time since the beginning.
    pub(crate) time: Duration,
    /// When it is over, nothing more comes in.
    reads: VecDeque<(Duration, Event)>,
    /// When it is over, there is room for everything.
    writes: VecDeque<(Duration, Event)>,
    pub(crate) written: Vec<u8>,
    /// Whether nothing more will be written.
    pub(crate) ended: bool,
    /// The limits of all calls.
    pub(crate) read_limits: Vec<Duration>,
    pub(crate) write_limits: Vec<Duration>,
    pub(crate) silent: bool,
    /// How many events have come in that are not read yet.
    pub(crate) waiting: usize,
    /// The other side's address.
    pub(crate) peer: SocketAddr,
    /// Whether it was closed from another thread.
    closed: bool,
}

impl Scripted {
    pub(crate) fn new(reads: Script, writes: Script) -> Self {
        Self(Arc::new(Mutex::new(State {
            begin: Instant::now(),
            time: Duration::ZERO,
            reads: reads.into(),
            writes: writes.into(),
            written: Vec::new(),
            ended: false,
            read_limits: Vec::new(),
            write_limits: Vec::new(),
            silent: true,
            waiting: 0,
            peer: ([192, 168, 7, 2], 65_000).into(),
            closed: false,
        })))
    }

    /// Whether nothing uses it any more, or another thread has closed it.
    pub(crate) fn is_closed(&self) -> bool {
        Arc::strong_count(&self.0) == 1 || self.state().closed
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }
}

impl State {
    /// Moves the time to the next event; `None` when the limit is over before it.
    fn next_event(&mut self, reading: bool, limit: Duration) -> Option<Event> {
        let script = if reading { &mut self.reads } else { &mut self.writes };
        let Some((delay, event)) = script.pop_front() else {
            self.time += limit;
            return None;
        };
        if delay > limit {
            script.push_front((delay - limit, event));
            self.time += limit;
            return None;
        }
        self.time += delay;
        Some(event)
    }
}

impl Transport for Scripted {
    fn now(&self) -> Instant {
        let state = self.state();
        state.begin + state.time
    }

    fn read(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        let mut state = self.state();
        state.read_limits.push(limit);
        match state.next_event(true, limit) {
            Some(Event::Bytes(mut bytes)) => {
                let count = bytes.len().min(buffer.len());
                let rest = bytes.split_off(count);
                buffer[..count].copy_from_slice(&bytes);
                if rest.is_empty() {
                    state.waiting = state.waiting.saturating_sub(1);
                } else {
                    state.reads.push_front((NO_WAIT, Event::Bytes(rest)));
                }
                Ok(count)
            }
            Some(Event::Error(kind)) => Err(kind.into()),
            Some(Event::Suspended(time)) => {
                state.time += time;
                Err(ErrorKind::Interrupted.into())
            }
            Some(Event::End) => Ok(0),
            Some(Event::Room(_)) => panic!("there is no room to read"),
            None => Err(ErrorKind::WouldBlock.into()),
        }
    }

    fn write(&mut self, bytes: &[u8], limit: Duration) -> io::Result<usize> {
        let mut state = self.state();
        state.write_limits.push(limit);
        if state.writes.is_empty() {
            state.written.extend_from_slice(bytes);
            return Ok(bytes.len());
        }
        match state.next_event(false, limit) {
            Some(Event::Room(room)) => {
                let count = bytes.len().min(room);
                state.written.extend_from_slice(&bytes[..count]);
                Ok(count)
            }
            Some(Event::Error(kind)) => Err(kind.into()),
            Some(event) => panic!("{event:?} can't happen to writing"),
            None => Err(ErrorKind::WouldBlock.into()),
        }
    }

    fn end_writing(&mut self) -> io::Result<()> {
        self.state().ended = true;
        Ok(())
    }

    fn is_silent(&self) -> bool {
        let state = self.state();
        state.silent && state.waiting == 0
    }

    fn addresses(&self) -> io::Result<Addresses> {
        Ok(Addresses { own: ([192, 168, 7, 1], 50_000).into(), peer: self.state().peer })
    }

    fn closer(&mut self) -> io::Result<Box<dyn Close>> {
        Ok(Box::new(self.clone()))
    }

    fn quick_closer(&self) -> io::Result<Box<dyn Close>> {
        Ok(Box::new(self.clone()))
    }
}

impl Close for Scripted {
    fn close(&self) {
        let mut state = self.state();
        state.reads = [(NO_WAIT, Event::End)].into();
        state.closed = true;
    }
}

/// A network for tests: what becomes of each connection that is opened, and a record of what was asked for.
/// When the script is over, hosts refuse.
#[derive(Debug, Default)]
pub(crate) struct ScriptedNetwork {
    openings: Mutex<VecDeque<Result<Scripted, Error>>>,
    asked: Mutex<Vec<(String, TimeLimits)>>,
}

impl ScriptedNetwork {
    /// A network that stays until the tests end, as the system's does.
    pub(crate) fn new<const N: usize>(openings: [Result<Scripted, Error>; N]) -> &'static Self {
        let openings = Mutex::new(openings.into());
        Box::leak(Box::new(Self { openings, asked: Mutex::default() }))
    }

    /// The host and the port of each connection that was asked for, and its limits.
    pub(crate) fn asked(&self) -> Vec<(String, TimeLimits)> {
        self.asked.lock().unwrap().clone()
    }

    /// The next connection is refused.
    pub(crate) fn refuse_next(&self) {
        let address = "a port where nobody listens".to_owned();
        let mut openings = self.openings.lock().unwrap();
        openings.push_front(Err(Error::ConnectionRefused { address }));
    }

    pub(crate) fn endpoint(&'static self) -> Endpoint {
        Endpoint { network: self, host: "txt".to_owned(), port: 65_000 }
    }
}

impl Network for ScriptedNetwork {
    fn open(
        &self,
        host: &str,
        port: u16,
        limits: &TimeLimits,
    ) -> Result<Box<dyn Transport>, Error> {
        let address = format!("{host}:{port}");
        self.asked.lock().unwrap().push((address.clone(), *limits));
        let refused = Err(Error::ConnectionRefused { address });
        let opening = self.openings.lock().unwrap().pop_front().unwrap_or(refused);
        opening.map(|transport| Box::new(transport) as Box<dyn Transport>)
    }
}
