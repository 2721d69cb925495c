//! The I2C connection of a session: one for all its I2C clients, open from StartOnline to StopOnline.
//!
//! The maker's firmware 4.7.0 (measured under emulation) accepts one I2C connection in each session, within 5 s after
//! StartOnline, and closes it after 5 s of silence. While it waits for that connection, another StartOnline ends the
//! firmware's program. So the connection is made at once, requests for nothing hold it open, and it is closed before
//! StopOnline.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::connection::{Connection, PacketNames};
use super::limits::TimeLimits;
use super::transport::{Close, Endpoint};
use crate::error::Error;
use crate::notices::notice;
use crate::wire::{I2cRequestHeader, I2cResponseHeader};

/// The names of a request and its response in errors.
pub(crate) const I2C_NAMES: PacketNames =
    PacketNames { request: "an I2C request", response: I2cResponseHeader::NAME };

/// How long connecting may take at the beginning of a session, which waits for it.
const CONNECT_AT_ONCE_LIMIT: Duration = Duration::from_millis(300);

/// After this silence a request for nothing is sent.
const KEEP_OPEN_AFTER: Duration = Duration::from_secs(2);

/// The maximum age of a connection's last request when the next goes out. The controller closes a connection that
/// was silent for 5 s, and must not do so while a request is on its way.
const SILENCE_LIMIT: Duration = Duration::from_secs(4);

/// The way to a controller's I2C devices, shared by clones. Requests are carried out one after another.
#[derive(Clone, Debug, Default)]
pub(crate) struct I2cLine(Arc<Parts>);

#[derive(Debug, Default)]
struct Parts {
    /// Locked while a request is carried out. `None` before the first one, and after an error on the wire.
    held: Mutex<Option<Held>>,
    /// Locked only for a moment.
    gate: Mutex<Gate>,
}

/// Where requests may go.
#[derive(Debug, Default)]
struct Gate {
    /// `None` without a session.
    server: Option<(Endpoint, TimeLimits)>,
    /// Counts the sessions.
    session: u64,
    /// Ends the session's connection, also during a request.
    closer: Option<Box<dyn Close>>,
}

/// A connection, and where it is between requests.
#[derive(Debug)]
struct Held {
    connection: Connection,
    session: u64,
    /// When the last request was sent, or the connection was made.
    last_request: Instant,
    /// A request that reads and writes no byte, which the firmware answers without traffic on the bus.
    nothing: Vec<u8>,
    /// How many bytes of the response to that are still to come.
    unread: usize,
}

impl I2cLine {
    /// A line without sessions: its requests go to this server. Connects to it.
    pub(crate) fn without_sessions(server: Endpoint, limits: TimeLimits) -> Result<Self, Error> {
        let line = Self::default();
        line.0.gate.lock().server = Some((server, limits));
        line.connect()?;
        Ok(line)
    }

    /// A line over this connection, for the fuzzers.
    pub(crate) fn over(connection: Connection, server: Endpoint, limits: TimeLimits) -> Self {
        let line = Self::default();
        line.0.gate.lock().server = Some((server, limits));
        *line.0.held.lock() = Some(Held::new(connection, 0));
        line
    }

    /// Begins a session, in which requests go to this server; an earlier one ends. With `at_once` it tries to
    /// connect: a controller without an I2C server refuses, which is no error. Blocks for 0.3 s at most.
    pub(crate) fn begin(&self, server: Endpoint, limits: TimeLimits, at_once: bool) -> I2cSession {
        let session = {
            let mut gate = self.0.gate.lock();
            if let Some(closer) = gate.closer.take() {
                closer.close();
            }
            gate.server = Some((server.clone(), limits));
            gate.session += 1;
            gate.session
        };
        if at_once {
            let connect = limits.connect.min(CONNECT_AT_ONCE_LIMIT);
            let deadline = Instant::now() + connect;
            match Connection::open(&server, TimeLimits { connect, ..limits }) {
                // A request of the session before may still have the lock, but its connection is closed.
                Ok(connection) => drop(self.0.held.try_lock_until(deadline).map(|mut held| {
                    *held = self.admit(connection, session).ok();
                })),
                Err(error) => notice!(Debug, "no I2C connection: {error:#}"),
            }
        }
        I2cSession { line: self.clone(), number: session }
    }

    /// Connects if there is no usable connection.
    pub(crate) fn connect(&self) -> Result<(), Error> {
        let mut held = self.0.held.lock();
        *held = Some(self.usable(held.take())?);
        Ok(())
    }

    /// Sends a request and reads its response, as [`Connection::transact`]. After an error of connecting, nothing
    /// was sent. After another one, bytes of the response may still come, so the connection is not kept.
    pub(crate) fn transact(
        &self,
        request: &[u8],
        buffer: &mut [u8],
        size: impl Fn(&[u8]) -> Result<Option<usize>, Error>,
    ) -> Result<usize, Error> {
        let mut held = self.0.held.lock();
        let mut used = self.usable(held.take())?;
        used.last_request = Instant::now();
        match used.connection.transact(I2C_NAMES, request, buffer, size) {
            Ok(size) => {
                *held = Some(used);
                Ok(size)
            }
            // This side has closed the connection, and not the controller.
            Err(_) if !self.is_current(used.session) => Err(not_online()),
            Err(error) => Err(error),
        }
    }

    /// Sends a request for nothing if the connection was silent for a while. Never waits: a request that is being
    /// carried out holds the connection open itself, and the response is read later.
    pub(crate) fn keep_open(&self) {
        let Some(mut held) = self.0.held.try_lock() else { return };
        if let Some(quiet) = held.as_mut().filter(|held| held.is_quiet()) {
            if !quiet.ask_for_nothing() {
                *held = None;
            }
        }
    }

    /// The connection that is held, if it is usable, or else a new one.
    fn usable(&self, held: Option<Held>) -> Result<Held, Error> {
        if let Some(mut held) = held {
            if self.is_current(held.session) && held.can_go_on() {
                return Ok(held);
            }
        }
        let (server, session) = {
            let gate = self.0.gate.lock();
            (gate.server.clone(), gate.session)
        };
        let Some((server, limits)) = server else { return Err(not_online()) };
        notice!(Debug, "a new I2C connection to {server} is made");
        self.admit(Connection::open(&server, limits)?, session)
    }

    /// Takes a new connection, unless its session has ended meanwhile.
    fn admit(&self, connection: Connection, session: u64) -> Result<Held, Error> {
        let mut gate = self.0.gate.lock();
        if gate.session != session || gate.server.is_none() {
            return Err(not_online());
        }
        gate.closer = connection.quick_closer();
        Ok(Held::new(connection, session))
    }

    fn is_current(&self, session: u64) -> bool {
        let gate = self.0.gate.lock();
        gate.session == session && gate.server.is_some()
    }

    /// Ends a session, if it has not ended yet. Never waits.
    fn end(&self, session: u64) {
        let mut gate = self.0.gate.lock();
        if gate.session != session {
            return;
        }
        gate.server = None;
        if let Some(closer) = gate.closer.take() {
            closer.close();
        }
        drop(gate);
        if let Some(mut held) = self.0.held.try_lock() {
            *held = None;
        }
    }
}

/// A session in which I2C requests go to the controller, until this is dropped. Dropping closes the connection, also
/// under a request, and never waits.
#[derive(Debug)]
pub(crate) struct I2cSession {
    line: I2cLine,
    number: u64,
}

impl Drop for I2cSession {
    fn drop(&mut self) {
        self.line.end(self.number);
    }
}

impl Held {
    fn new(connection: Connection, session: u64) -> Self {
        let mut nothing = Vec::new();
        I2cRequestHeader { data_len: 0, device: 0, write_len: 0, read_len: 0 }.emit(&mut nothing);
        Self { connection, session, last_request: Instant::now(), nothing, unread: 0 }
    }

    /// Whether another request can be sent. Reads the response to a request for nothing before that.
    fn can_go_on(&mut self) -> bool {
        let mut rest = [0; I2cResponseHeader::LEN];
        let mut left = self.connection.time_to_read();
        let (rest, received) = (&mut rest[..self.unread], I2cResponseHeader::LEN - self.unread);
        let is_read = self.connection.fill(I2C_NAMES.request, rest, received, &mut left).is_ok();
        self.unread = 0;
        is_read && self.last_request.elapsed() < SILENCE_LIMIT && self.connection.is_silent()
    }

    fn is_quiet(&self) -> bool {
        self.last_request.elapsed() >= KEEP_OPEN_AFTER
    }

    /// Sends a request for nothing, but not before the last one is answered. Returns whether the connection is still
    /// usable.
    fn ask_for_nothing(&mut self) -> bool {
        while self.unread > 0 && !self.connection.is_silent() {
            let mut rest = [0; I2cResponseHeader::LEN];
            match self.connection.read_now(&mut rest[..self.unread]) {
                Some(count) => self.unread -= count,
                None => return false,
            }
        }
        if self.unread > 0 {
            return true;
        }
        self.last_request = Instant::now();
        self.unread = I2cResponseHeader::LEN;
        let Self { connection, nothing, .. } = self;
        connection.is_silent() && connection.send(I2C_NAMES.request, nothing).is_ok()
    }
}

#[cfg(test)]
impl I2cLine {
    /// Whether a connection is kept for the next request.
    pub(crate) fn is_held(&self) -> bool {
        self.0.held.lock().is_some()
    }

    /// Whether the other side of the connection has neither closed it nor sent bytes.
    pub(crate) fn is_silent(&self) -> bool {
        self.0.held.lock().as_ref().is_some_and(|held| held.connection.is_silent())
    }

    /// As if the last request was so much longer ago.
    pub(crate) fn age(&self, time: Duration) {
        if let Some(held) = &mut *self.0.held.lock() {
            held.last_request = held.last_request.checked_sub(time).expect("the clock is older");
        }
    }
}

fn not_online() -> Error {
    Error::NotOnline { command: I2C_NAMES.request }
}
