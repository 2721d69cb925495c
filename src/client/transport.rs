//! What the client needs from a network. What is special about TCP is in `tcp.rs` and below it.

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use super::address::{host_and_port, host_of};
use super::limits::TimeLimits;
use crate::error::Error;

/// Opens connections.
pub(crate) trait Network: fmt::Debug + Send + Sync {
    /// Opens a connection to a port of a host within `limits.connect`. The other two limits are those that
    /// most reading and writing will have.
    fn open(&self, host: &str, port: u16, limits: &TimeLimits)
        -> Result<Box<dyn Transport>, Error>;
}

/// Where a connection leads: a port of a host, and the network by which it is reached.
#[derive(Clone, Debug)]
pub(crate) struct Endpoint {
    pub(super) network: &'static dyn Network,
    pub(crate) host: String,
    pub(super) port: u16,
}

impl Endpoint {
    /// A port in `host` is used instead of `port`.
    pub(crate) fn new(network: &'static dyn Network, host: &str, port: u16) -> Result<Self, Error> {
        let (host, port) = host_and_port(host, port)?;
        Ok(Self { network, host: host.to_owned(), port })
    }

    /// Another port of the host that has this address.
    pub(crate) fn at(network: &'static dyn Network, address: SocketAddr, port: u16) -> Self {
        Self { network, host: host_of(address), port }
    }

    pub(crate) fn open(&self, limits: &TimeLimits) -> Result<Box<dyn Transport>, Error> {
        self.network.open(&self.host, self.port, limits)
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

/// A stream of bytes in each direction, with a clock.
///
/// Reading and writing are single system calls: they may move only a part of the bytes, and may be
/// interrupted. When the limit is over, the error is of the kind `WouldBlock` or `TimedOut`.
pub(crate) trait Transport: fmt::Debug + Send + Sync {
    fn now(&self) -> Instant;

    /// Reads the bytes that have come in, and waits for some up to `limit`. 0 is the end of the stream.
    fn read(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize>;

    /// Writes as much as there is room for, and waits for room up to `limit`.
    fn write(&mut self, bytes: &[u8], limit: Duration) -> io::Result<usize>;

    /// Ends the stream to the other side.
    fn end_writing(&mut self) -> io::Result<()>;

    /// Whether the other side has neither closed the connection, as far as is known here, nor sent
    /// bytes that are not read yet. Does not block.
    fn is_silent(&self) -> bool;

    /// The addresses of both sides, unless the connection is lost already.
    fn addresses(&self) -> io::Result<Addresses>;

    /// What lets another thread end this connection.
    fn closer(&mut self) -> io::Result<Box<dyn Close>>;

    /// The same, but no call gets slower for it, on any system. On Windows a thread that waits notices the end only
    /// when the other side has closed, too, or at its limit.
    fn quick_closer(&self) -> io::Result<Box<dyn Close>>;
}

/// The addresses of both sides of a connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Addresses {
    pub(crate) own: SocketAddr,
    pub(crate) peer: SocketAddr,
}

/// Ends a connection that another thread uses: its reading and writing end soon, also those that wait, with
/// the end of the stream or an error of the kind `ConnectionAborted`.
pub(crate) trait Close: fmt::Debug + Send {
    fn close(&self);
}
