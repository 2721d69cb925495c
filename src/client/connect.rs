//! Making connections, and what can go wrong with them.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::time::Duration;

use crate::error::Error;

/// How long the steps of talking to the controller may take.
///
/// Limits under a millisecond count as one millisecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeLimits {
    /// For making the connection to each address of the host. Default 5 s.
    ///
    /// Finding the addresses of a host name is up to the operating system and not limited here;
    /// a numeric address needs no finding.
    pub connect: Duration,
    /// For the whole response to a command. Default 2 s; the controller answers an exchange
    /// after 10 ms, 40 ms at most.
    pub read: Duration,
    /// For handing a command to the operating system. Default 2 s.
    pub write: Duration,
}

impl Default for TimeLimits {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(5),
            read: Duration::from_secs(2),
            write: Duration::from_secs(2),
        }
    }
}

/// The shortest limit that the operating system takes for one.
pub(crate) const SHORTEST_LIMIT: Duration = Duration::from_millis(1);

/// Connects to the first of the host's addresses that answers within the limit.
pub(super) fn connect(host: &str, port: u16, limit: Duration) -> Result<TcpStream, Error> {
    let not_found = |reason: String| Error::HostNotFound { host: host.to_owned(), reason };
    let addresses = (host, port).to_socket_addrs().map_err(|error| not_found(error.to_string()))?;
    let mut failure = not_found("it has no address".to_owned());
    for address in addresses {
        match connect_to(address, limit) {
            Ok(stream) => return Ok(stream),
            Err(error) => failure = error,
        }
    }
    Err(failure)
}

/// Connects to an address within the limit.
pub(crate) fn connect_to(address: SocketAddr, limit: Duration) -> Result<TcpStream, Error> {
    TcpStream::connect_timeout(&address, limit).map_err(|error| {
        let address = address.to_string();
        match error.kind() {
            ErrorKind::ConnectionRefused => Error::ConnectionRefused { address },
            ErrorKind::TimedOut => Error::ConnectTimedOut { address, limit },
            _ => Error::ConnectFailed { address, reason: error.to_string() },
        }
    })
}

/// The error for a command during which the connection failed, when so many bytes had come in.
pub(crate) fn io_error(command: &'static str, error: &std::io::Error, received: usize) -> Error {
    match error.kind() {
        ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe => {
            Error::ConnectionClosed { command, received }
        }
        kind => Error::Io { command, kind, reason: error.to_string() },
    }
}
