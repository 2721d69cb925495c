//! Making connections, and what can go wrong with them.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use super::limits::TimeLeft;
use super::resolve::{Resolver, SYSTEM};
use super::transport::SHORTEST_LIMIT;
use crate::error::Error;

/// Connects to the first of the host's addresses that answers; the limit is for all of it.
pub(super) fn connect(host: &str, port: u16, limit: Duration) -> Result<TcpStream, Error> {
    connect_by(&SYSTEM, host, port, limit)
}

fn connect_by<F>(
    resolver: &Resolver<F>,
    host: &str,
    port: u16,
    limit: Duration,
) -> Result<TcpStream, Error>
where
    F: Fn(&str) -> io::Result<Vec<SocketAddr>> + Clone + Send + 'static,
{
    let mut left = TimeLeft::new(limit.max(SHORTEST_LIMIT), Instant::now());
    let addresses = resolver.addresses(host, port, &mut left)?;
    let found = connect_to_one(&addresses, &mut left, Instant::now, connect_to);
    found.unwrap_or_else(|| {
        Err(Error::HostNotFound { host: host.to_owned(), reason: "it has no address".to_owned() })
    })
}

/// Connects to the first address that answers. Each gets an equal share of the time that is left
/// when its turn comes. `None` when there is no address.
fn connect_to_one<S>(
    addresses: &[SocketAddr],
    left: &mut TimeLeft,
    now: impl Fn() -> Instant,
    mut connect_to: impl FnMut(SocketAddr, Duration) -> io::Result<S>,
) -> Option<Result<S, Error>> {
    let mut failure = None;
    for (remaining, &address) in (1..=addresses.len() as u32).rev().zip(addresses) {
        let result = match left.next(&now) {
            Some(rest) => connect_to(address, rest / remaining),
            None => Err(ErrorKind::TimedOut.into()),
        };
        match result {
            Ok(stream) => return Some(Ok(stream)),
            Err(error) => failure = Some(Err(connect_error(address, left.limit(), &error))),
        }
    }
    failure
}

/// Connects to an address within the limit.
pub(crate) fn connect_to(address: SocketAddr, limit: Duration) -> io::Result<TcpStream> {
    TcpStream::connect_timeout(&address, limit.max(SHORTEST_LIMIT))
}

/// The error for an address that could not be connected to within the limit.
pub(crate) fn connect_error(address: SocketAddr, limit: Duration, error: &io::Error) -> Error {
    let address = address.to_string();
    match error.kind() {
        ErrorKind::ConnectionRefused => Error::ConnectionRefused { address },
        ErrorKind::TimedOut => Error::ConnectTimedOut { address, limit },
        _ => Error::ConnectFailed { address, reason: error.to_string() },
    }
}
