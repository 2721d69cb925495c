//! A request and its response: what the controller's connections have in common.

use std::io::{self, ErrorKind};
use std::mem;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use super::limits::{TimeLeft, TimeLimits, SHORTEST_LIMIT};
use super::transport::{Close, Endpoint, Transport};
use crate::error::Error;

/// A connection on which requests and responses alternate.
#[derive(Debug)]
pub(crate) struct Connection {
    transport: Box<dyn Transport>,
    limits: TimeLimits,
    /// What was not sent of the last command, for which there was no room in time.
    unsent: Vec<u8>,
}

/// The names of a request and its response in errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketNames {
    pub(crate) request: &'static str,
    pub(crate) response: &'static str,
}

impl Connection {
    pub(crate) fn open(endpoint: &Endpoint, limits: TimeLimits) -> Result<Self, Error> {
        Ok(Self::over(endpoint.open(&limits)?, limits))
    }

    pub(crate) fn over(transport: Box<dyn Transport>, limits: TimeLimits) -> Self {
        Self { transport, limits, unsent: Vec::new() }
    }

    pub(super) fn limits(&self) -> TimeLimits {
        self.limits
    }

    /// Whether the other side has neither closed the connection, as far as is known here, nor sent
    /// bytes that no request asked for. Does not block.
    pub(crate) fn is_silent(&self) -> bool {
        self.transport.is_silent()
    }

    /// Reads bytes that have come in already; `None` when the connection has ended.
    pub(super) fn read_now(&mut self, buffer: &mut [u8]) -> Option<usize> {
        match self.transport.read(buffer, SHORTEST_LIMIT) {
            Ok(0) => None,
            Ok(count) => Some(count),
            Err(error) if error.kind() == ErrorKind::Interrupted => Some(0),
            Err(_) => None,
        }
    }

    /// What lets another thread end this connection, if the system has room for it.
    pub(super) fn quick_closer(&self) -> Option<Box<dyn Close>> {
        self.transport.quick_closer().ok()
    }

    /// The other side's address, unless the connection is lost already.
    pub(super) fn peer(&self) -> Option<SocketAddr> {
        self.transport.addresses().ok().map(|addresses| addresses.peer)
    }

    /// Sends a request and reads its response, see [`read_response`](Self::read_response).
    pub(crate) fn transact(
        &mut self,
        names: PacketNames,
        request: &[u8],
        buffer: &mut [u8],
        size: impl Fn(&[u8]) -> Result<Option<usize>, Error>,
    ) -> Result<usize, Error> {
        self.send(names.request, request)?;
        self.read_response(names, buffer, size)
    }

    /// Reads the whole response to a request into `buffer`. The buffer is longer than any response, to detect
    /// one with too many bytes. Returns the response's size.
    ///
    /// `size` gets the bytes that have come in. It returns the response's size once it is known, or an
    /// error when the bytes are wrong.
    pub(super) fn read_response(
        &mut self,
        names: PacketNames,
        buffer: &mut [u8],
        size: impl Fn(&[u8]) -> Result<Option<usize>, Error>,
    ) -> Result<usize, Error> {
        let mut left = self.time_to_read();
        let mut received = 0;
        let size = loop {
            if let Some(size) = size(&buffer[..received])? {
                if received >= size {
                    break size;
                }
            }
            received +=
                self.receive(names.request, &mut buffer[received..], received, &mut left)?;
        };
        if received > size {
            let packet = names.response;
            return Err(Error::WrongSize { packet, expected: size, found: received });
        }
        Ok(size)
    }

    /// Sends a command, within the limit for writing. Returns when it began to.
    ///
    /// A command is one write, so that it is one segment. Only when the system has no room for all of it, the rest
    /// follows: the firmware may close the connection then, but without the rest it certainly does.
    pub(crate) fn send(&mut self, command: &'static str, bytes: &[u8]) -> Result<Instant, Error> {
        let (limit, now) = (self.limits.write, self.transport.now());
        let mut unsent = bytes;
        let sent = self.write_all(&mut unsent, &mut TimeLeft::new(limit, now));
        self.unsent = unsent.to_vec();
        sent.map(|()| now).map_err(|error| match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => Error::NotTaken { command, limit },
            _ => io_error(command, error, 0),
        })
    }

    /// The time for a response, starting now.
    pub(crate) fn time_to_read(&self) -> TimeLeft {
        TimeLeft::new(self.limits.read, self.transport.now())
    }

    /// Fills the buffer with the response to a command, of which `received` bytes have come in before.
    pub(crate) fn fill(
        &mut self,
        command: &'static str,
        buffer: &mut [u8],
        received: usize,
        left: &mut TimeLeft,
    ) -> Result<(), Error> {
        let mut filled = 0;
        while filled < buffer.len() {
            filled += self.receive(command, &mut buffer[filled..], received + filled, left)?;
        }
        Ok(())
    }

    /// Leaves a connection that may not work any more: sends these last bytes, calls `sent`, and reads until
    /// the other side has closed. Ignores errors. Blocks up to the limit.
    ///
    /// What is missing of the command before comes first. Otherwise the last bytes would be read as its rest, and an
    /// exchange that the controller has not got would be missing in what the next one is compressed with.
    ///
    /// Closing with unread bytes would reset the connection, and the other side might never read
    /// the last bytes.
    pub(super) fn abandon(
        &mut self,
        last_words: &[u8],
        limit: Duration,
        buffer: &mut [u8],
        sent: impl FnOnce(),
    ) {
        let mut left = TimeLeft::new(limit, self.transport.now());
        let last_words = [&*mem::take(&mut self.unsent), last_words].concat();
        let is_sent = self.write_all(&mut &*last_words, &mut left).is_ok();
        sent();
        if !is_sent {
            return;
        }
        let _ = self.transport.end_writing();
        while matches!(self.read(buffer, &mut left), Ok(1..)) {}
    }

    /// Reads the next bytes of the response to a command, at least one.
    fn receive(
        &mut self,
        command: &'static str,
        buffer: &mut [u8],
        received: usize,
        left: &mut TimeLeft,
    ) -> Result<usize, Error> {
        let read = match self.read(buffer, left) {
            // The whole program may have been suspended beyond the limit. What has come in meanwhile is in time.
            Err(error) if error.kind() == ErrorKind::Interrupted => {
                self.transport.read(buffer, SHORTEST_LIMIT)
            }
            result => result,
        };
        match read {
            Ok(0) => Err(Error::ConnectionClosed { command, received }),
            Ok(count) => Ok(count),
            Err(error) => Err(match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => {
                    Error::NoAnswer { command, limit: left.limit(), received }
                }
                _ => io_error(command, error, received),
            }),
        }
    }

    /// Reads, and tries again after each interruption. Such an error means that the limit passed in one.
    fn read(&mut self, buffer: &mut [u8], left: &mut TimeLeft) -> io::Result<usize> {
        let mut at_the_limit = ErrorKind::TimedOut;
        loop {
            let rest = left.next(|| self.transport.now()).ok_or(at_the_limit)?;
            match self.transport.read(buffer, rest) {
                Err(error) if error.kind() == ErrorKind::Interrupted => at_the_limit = error.kind(),
                result => return result,
            }
        }
    }

    /// Writes all bytes, and tries again after each interruption. `bytes` are then those that are left.
    fn write_all(&mut self, bytes: &mut &[u8], left: &mut TimeLeft) -> io::Result<()> {
        while !bytes.is_empty() {
            let rest = left.next(|| self.transport.now()).ok_or(ErrorKind::TimedOut)?;
            match self.transport.write(bytes, rest) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => *bytes = &bytes[count..],
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// The error for a command during which the connection failed, after `received` bytes of the response.
fn io_error(command: &'static str, error: io::Error, received: usize) -> Error {
    match error.kind() {
        ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe => {
            Error::ConnectionClosed { command, received }
        }
        _ => Error::Io { command, cause: error.into() },
    }
}
