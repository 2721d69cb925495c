//! One port of a simulated TXT: its listener, and how its thread waits for sockets.
//!
//! No socket blocks. A thread reads, writes or accepts first, and waits only when there is nothing to
//! do: a change is reported once, so a thread that waits without having tried could miss bytes that are there.

use std::io::{self, ErrorKind, Read, Write};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::net::{TcpListener, TcpStream};
use mio::{Events, Interest, Poll, Token, Waker};

use crate::machine::journal::notice;
use crate::server::shared::{Shared, Stopped};

const LISTENER: Token = Token(0);
const CLIENT: Token = Token(1);
const WAKER: Token = Token(2);

/// How long a thread pauses when a client could not be accepted, and still waits.
const RETRY: Duration = Duration::from_millis(20);

/// How long a client may leave a response unread before it is cut off. The buffers of the
/// operating system hold hundreds of responses, so only a client that never reads is cut off.
pub(crate) const WRITE_LIMIT: Duration = Duration::from_secs(1);

/// A port, and all that its thread waits for.
pub(crate) struct Port {
    shared: Arc<Shared>,
    /// Its name in the log.
    name: &'static str,
    listener: Option<TcpListener>,
    /// A client may be waiting to be accepted.
    has_waiting_client: bool,
    /// The log has why the client that waits could not be accepted.
    has_warned: bool,
    poll: Poll,
    events: Events,
}

impl Port {
    /// A port that does not listen yet. If its thread follows sessions, it is also woken when the camera or the I2C
    /// server starts or ends.
    pub(crate) fn new(shared: Arc<Shared>, name: &'static str, follows: bool) -> io::Result<Self> {
        let poll = Poll::new()?;
        shared.add_waker(Waker::new(poll.registry(), WAKER)?, follows);
        let events = Events::with_capacity(4);
        Ok(Self {
            shared,
            name,
            listener: None,
            has_waiting_client: false,
            has_warned: false,
            poll,
            events,
        })
    }

    /// Accepts the clients of this listener, which does not block, from now on.
    pub(crate) fn listen(&mut self, listener: std::net::TcpListener) -> io::Result<()> {
        let mut listener = TcpListener::from_std(listener);
        self.poll.registry().register(&mut listener, LISTENER, Interest::READABLE)?;
        self.listener = Some(listener);
        self.has_waiting_client = true;
        Ok(())
    }

    /// Refuses clients from now on.
    pub(crate) fn close(&mut self) {
        self.listener = None;
        self.has_waiting_client = false;
    }

    /// What its thread shares with the others.
    pub(crate) fn shared(&self) -> &Shared {
        &self.shared
    }

    /// A client that waits to be accepted, if there is one.
    pub(crate) fn try_accept(&mut self) -> Option<(TcpStream, SocketAddr)> {
        let listener = self.listener.as_ref().filter(|_| self.has_waiting_client)?;
        match listener.accept().and_then(|(stream, client)| {
            stream.set_nodelay(true)?;
            Ok((stream, client))
        }) {
            Ok(accepted) => {
                self.has_warned = false;
                return Some(accepted);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => self.has_waiting_client = false,
            // A client that has closed again, or too many open files: the next client may succeed.
            Err(error) if !std::mem::replace(&mut self.has_warned, true) => {
                notice!(Warn, "a client could not be accepted: {error}");
            }
            // Further failures are not logged.
            Err(_) => {}
        }
        None
    }

    /// Waits for a client.
    pub(crate) fn accept(&mut self) -> Result<TcpStream, Stopped> {
        let accepted = self.accept_while(|_| true, None)?;
        // Nothing else ends the wait.
        accepted.ok_or(Stopped)
    }

    /// Waits as long as the condition holds. It is checked after each change.
    pub(crate) fn wait_while(
        &mut self,
        condition: impl Fn(&Shared) -> bool,
    ) -> Result<(), Stopped> {
        self.shared.check()?;
        while condition(&self.shared) {
            self.wait(None)?;
        }
        Ok(())
    }

    /// Waits for a client as long as the condition holds, at most until the deadline. It is checked after each change.
    pub(crate) fn accept_while(
        &mut self,
        condition: impl Fn(&Shared) -> bool,
        deadline: Option<Instant>,
    ) -> Result<Option<TcpStream>, Stopped> {
        self.shared.check()?;
        while condition(&self.shared) && !has_passed(deadline) {
            if let Some((stream, client)) = self.try_accept() {
                notice!(Info, "{client} connects to the {} port", self.name);
                return Ok(Some(stream));
            }
            if self.has_waiting_client {
                self.shared.sleep(RETRY)?;
            } else {
                self.wait(deadline)?;
            }
        }
        Ok(None)
    }

    /// Waits for a change, at most until the deadline. Returns whether there is one of the served client.
    /// May end without any.
    fn wait(&mut self, deadline: Option<Instant>) -> Result<bool, Stopped> {
        let limit = deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
        match self.poll.poll(&mut self.events, limit) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(false),
            Err(error) => {
                notice!(Error, "the {} port can't be waited for: {error}", self.name);
                return Err(Stopped);
            }
        }
        self.shared.check()?;
        let mut of_client = false;
        for event in &self.events {
            match event.token() {
                LISTENER => self.has_waiting_client = true,
                CLIENT => of_client = true,
                _ => {}
            }
        }
        Ok(of_client)
    }
}

/// How often is read at most to find the end of what a client has sent.
const MOST_READS: usize = 100;

/// The connection with the client that a port serves.
pub(crate) struct Link {
    stream: TcpStream,
    /// Some bytes may have arrived, or the end.
    may_have_bytes: bool,
}

impl Link {
    pub(crate) fn new(port: &Port, mut stream: TcpStream) -> io::Result<Self> {
        port.poll.registry().register(&mut stream, CLIENT, Interest::READABLE)?;
        Ok(Self { stream, may_have_bytes: true })
    }

    /// Whether something may have arrived since the last look.
    pub(crate) fn may_have_bytes(&self) -> bool {
        self.may_have_bytes
    }

    /// Reads what has arrived, at the end 0 bytes; `None` when there is nothing.
    pub(crate) fn try_read(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        loop {
            match self.stream.read(buffer) {
                Ok(count) => return Ok(Some(count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    self.may_have_bytes = false;
                    return Ok(None);
                }
                Err(error) => return Err(error),
            }
        }
    }

    /// Whether the client has not closed the connection. What it sent before gets lost; one that sends without end has
    /// not closed it.
    pub(crate) fn is_open(&mut self) -> bool {
        (0..MOST_READS)
            .find_map(|_| match self.try_read(&mut [0; 64]) {
                Ok(Some(0)) | Err(_) => Some(false),
                Ok(None) => Some(true),
                Ok(Some(_)) => None,
            })
            .unwrap_or(true)
    }

    /// Waits for a change of any kind, at most until the deadline. May end without any.
    pub(crate) fn wait(
        &mut self,
        port: &mut Port,
        deadline: Option<Instant>,
    ) -> Result<(), Stopped> {
        self.may_have_bytes |= port.wait(deadline)?;
        Ok(())
    }

    /// Fills the buffer from one segment: what comes in pieces ends the connection.
    pub(crate) fn read_segment(
        &mut self,
        port: &mut Port,
        buffer: &mut [u8],
        deadline: Option<Instant>,
        may_go_on: impl Fn(&Shared) -> Result<(), End>,
    ) -> Result<(), End> {
        self.read_all(port, &mut buffer[..1], deadline, may_go_on)?;
        let rest = &mut buffer[1..];
        if rest.is_empty() {
            return Ok(());
        }
        match self.try_read(rest)? {
            Some(count) if count == rest.len() => Ok(()),
            _ => Err(End::Misbehaved("a packet came in pieces".to_owned())),
        }
    }

    /// Fills the buffer, at most until the deadline, and as long as the connection `may_go_on`.
    pub(crate) fn read_all(
        &mut self,
        port: &mut Port,
        mut buffer: &mut [u8],
        deadline: Option<Instant>,
        may_go_on: impl Fn(&Shared) -> Result<(), End>,
    ) -> Result<(), End> {
        while !buffer.is_empty() {
            may_go_on(&port.shared)?;
            match self.try_read(buffer)? {
                Some(0) => return Err(End::Left),
                Some(count) => buffer = &mut buffer[count..],
                None if has_passed(deadline) => return Err(End::Idle),
                None => self.wait(port, deadline)?,
            }
        }
        Ok(())
    }

    /// Writes all bytes, as slowly as the client reads them, as long as the connection `may_go_on`. With a limit,
    /// the client may leave them unread for that time.
    pub(crate) fn write_all(
        &mut self,
        port: &mut Port,
        mut bytes: &[u8],
        limit: Option<Duration>,
        may_go_on: impl Fn(&Shared) -> Result<(), End>,
    ) -> Result<(), End> {
        let mut deadline = None;
        while !bytes.is_empty() {
            may_go_on(&port.shared)?;
            match self.stream.write(bytes) {
                Ok(0) => return Err(End::Left),
                Ok(count) => {
                    bytes = &bytes[count..];
                    deadline = None;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if has_passed(deadline) {
                        return Err(End::Unread);
                    }
                    if deadline.is_none() {
                        deadline = limit.and_then(|limit| Instant::now().checked_add(limit));
                    }
                    self.wait_for_room(port, deadline)?;
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// Waits until the socket takes more bytes, at most until the deadline. May end without any.
    fn wait_for_room(&mut self, port: &mut Port, deadline: Option<Instant>) -> Result<(), End> {
        let interest = Interest::READABLE | Interest::WRITABLE;
        port.poll.registry().reregister(&mut self.stream, CLIENT, interest)?;
        let waited = self.wait(port, deadline);
        // At other times, room for more bytes should end no wait.
        port.poll.registry().reregister(&mut self.stream, CLIENT, Interest::READABLE)?;
        Ok(waited?)
    }
}

/// Whether there is a deadline, and it is over.
pub(crate) fn has_passed(deadline: Option<Instant>) -> bool {
    deadline.is_some_and(|deadline| deadline <= Instant::now())
}

/// Why a connection ends.
#[derive(Debug)]
pub(crate) enum End {
    /// The thread should end.
    Stopped,
    /// The client closed it.
    Left,
    /// The client sent nothing in time.
    Idle,
    /// The client did not read a response in time.
    Unread,
    /// The client sent something that can't be answered.
    Misbehaved(String),
    /// It is closed on purpose, for this reason.
    Closed(&'static str),
    /// The program of the controller ends, for this reason.
    EndsProgram(String),
    Broken(io::Error),
}

impl End {
    /// Logs how the connection of this client ended.
    pub(crate) fn log(self, client: &str) {
        match self {
            Self::Stopped => {}
            Self::Left => notice!(Info, "{client} has left"),
            Self::Idle => notice!(Warn, "{client} is cut off: it sent no command"),
            Self::Unread => notice!(Warn, "{client} is cut off: it reads no responses"),
            Self::Misbehaved(what) => notice!(Warn, "{client} is cut off: {what}"),
            Self::EndsProgram(why) => {
                notice!(Warn, "{client} ends the controller's program: {why}")
            }
            Self::Closed(reason) => notice!(Info, "the connection of {client} is closed: {reason}"),
            Self::Broken(error) => notice!(Info, "the connection of {client} broke: {error}"),
        }
    }
}

impl From<Stopped> for End {
    fn from(Stopped: Stopped) -> Self {
        Self::Stopped
    }
}

impl From<io::Error> for End {
    fn from(error: io::Error) -> Self {
        Self::Broken(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;

    #[test]
    fn what_a_client_has_sent_before_it_closed_hides_no_end() {
        let shared = Arc::new(Shared::new(Machine::new(0), None));
        let port = Port::new(shared, "camera", true).unwrap();
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        stream.set_nonblocking(true).unwrap();
        let mut link = Link::new(&port, TcpStream::from_std(stream)).unwrap();
        assert!(link.is_open());
        client.write_all(&[0; 300]).unwrap();
        assert!(link.is_open());
        client.write_all(&[0; 300]).unwrap();
        drop(client);
        assert!(!link.is_open());
    }
}
