//! Making TCP connections, and what can go wrong with them.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use super::limits::{TimeLeft, SHORTEST_LIMIT};
use super::resolve::{Found, Resolver, SYSTEM};
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
    F: Fn(&str) -> Found + Clone + Send + 'static,
{
    let mut left = TimeLeft::new(limit.max(SHORTEST_LIMIT), Instant::now());
    let addresses = resolver.addresses(host, port, &mut left)?;
    let found = connect_to_one(&addresses, &mut left, Instant::now, connect_to);
    found.unwrap_or_else(|| {
        Err(Error::HostNotFound { host: host.to_owned(), cause: no_address().into() })
    })
}

fn no_address() -> io::Error {
    io::Error::new(ErrorKind::NotFound, "it has no address")
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
            Err(error) => failure = Some(Err(connect_error(address, left.limit(), error))),
        }
    }
    failure
}

/// Connects to an address within the limit.
fn connect_to(address: SocketAddr, limit: Duration) -> io::Result<TcpStream> {
    let stream = TcpStream::connect_timeout(&address, limit.max(SHORTEST_LIMIT))?;
    // Where nothing listens on this computer, a system may connect the port with itself. The address of the other end
    // is not asked for: it is gone when that end has closed already.
    if stream.local_addr()? == address {
        return Err(ErrorKind::ConnectionRefused.into());
    }
    away_from_standard(stream)
}

/// A connection does not take the place of an input or output that the program has closed: what it prints would go to the
/// controller.
#[cfg(unix)]
fn away_from_standard(stream: TcpStream) -> io::Result<TcpStream> {
    use std::os::fd::AsRawFd;
    // A clone is never in such a place.
    if stream.as_raw_fd() <= 2 {
        stream.try_clone()
    } else {
        Ok(stream)
    }
}

#[cfg(not(unix))]
fn away_from_standard(stream: TcpStream) -> io::Result<TcpStream> {
    Ok(stream)
}

/// The error for an address that could not be connected to within the limit.
fn connect_error(address: SocketAddr, limit: Duration, error: io::Error) -> Error {
    let address = address.to_string();
    match error.kind() {
        ErrorKind::ConnectionRefused => Error::ConnectionRefused { address },
        ErrorKind::TimedOut => Error::ConnectTimedOut { address, limit },
        _ => Error::ConnectFailed { address, cause: error.into() },
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::net::TcpListener;

    use super::*;

    const LIMIT: Duration = Duration::from_secs(6);

    fn addresses(count: u8) -> Vec<SocketAddr> {
        (1..=count).map(|number| ([10, 0, 0, number], 65000).into()).collect()
    }

    /// Connects to addresses with these behaviours: each answers after this time, never, or refuses.
    /// Returns the result, and the limit that each one had.
    fn connect_to_these(
        behaviours: &[Result<Duration, ErrorKind>],
        found_after: Duration,
    ) -> (Option<Result<SocketAddr, Error>>, Vec<Duration>) {
        let begin = Instant::now();
        let time = Cell::new(Duration::ZERO);
        let mut left = TimeLeft::new(LIMIT, begin);
        if !found_after.is_zero() {
            left.next(|| begin);
            time.set(found_after);
        }
        let mut limits = Vec::new();
        let mut behaviours = behaviours.iter();
        let addresses = addresses(behaviours.len() as u8);
        let now = || begin + time.get();
        let result = connect_to_one(&addresses, &mut left, now, |address, limit| {
            limits.push(limit);
            let (passed, result) = match *behaviours.next().unwrap() {
                Ok(delay) if delay <= limit => (delay, Ok(address)),
                Ok(_) => (limit, Err(ErrorKind::TimedOut.into())),
                Err(kind) => (Duration::ZERO, Err(kind.into())),
            };
            time.set(time.get() + passed);
            result
        });
        (result, limits)
    }

    const DEAD: Result<Duration, ErrorKind> = Ok(Duration::MAX);
    const REFUSED: Result<Duration, ErrorKind> = Err(ErrorKind::ConnectionRefused);

    fn secs(time: u64) -> Duration {
        Duration::from_secs(time)
    }

    fn timed_out(address: SocketAddr) -> Option<Result<SocketAddr, Error>> {
        Some(Err(Error::ConnectTimedOut { address: address.to_string(), limit: LIMIT }))
    }

    #[test]
    fn a_single_address_has_the_whole_limit() {
        let (result, limits) = connect_to_these(&[DEAD], secs(0));
        assert_eq!((result, limits), (timed_out(addresses(1)[0]), vec![LIMIT]));
    }

    #[test]
    fn addresses_share_what_is_left_of_the_limit() {
        let (result, limits) = connect_to_these(&[DEAD, DEAD, DEAD], secs(0));
        assert_eq!((result, limits), (timed_out(addresses(3)[2]), vec![secs(2); 3]));
        let (result, limits) = connect_to_these(&[DEAD, DEAD], secs(2));
        assert_eq!((result, limits), (timed_out(addresses(2)[1]), vec![secs(2); 2]));
        // The time that one does not use is for the ones after it.
        let (result, limits) = connect_to_these(&[REFUSED, DEAD], secs(0));
        assert_eq!((result, limits), (timed_out(addresses(2)[1]), vec![secs(3), secs(6)]));
    }

    #[test]
    fn a_dead_first_address_leaves_time_for_the_second() {
        let (result, limits) = connect_to_these(&[DEAD, Ok(secs(1))], secs(0));
        assert_eq!((result, limits), (Some(Ok(addresses(2)[1])), vec![secs(3), secs(3)]));
    }

    #[test]
    fn the_first_address_that_answers_is_taken() {
        let (result, limits) = connect_to_these(&[Ok(secs(0)), DEAD], secs(0));
        assert_eq!((result, limits), (Some(Ok(addresses(2)[0])), vec![secs(3)]));
    }

    #[test]
    fn nothing_is_tried_when_finding_has_taken_all_the_time() {
        let (result, limits) = connect_to_these(&[Ok(secs(0))], LIMIT);
        assert_eq!((result, limits), (timed_out(addresses(1)[0]), vec![]));
    }

    #[test]
    fn a_name_without_an_address_is_not_found() {
        let resolver = Resolver::new(|_: &str| Ok(Vec::new()));
        let error = connect_by(&resolver, "txt.local", 65000, LIMIT).unwrap_err();
        assert_eq!(
            error,
            Error::HostNotFound { host: "txt.local".to_owned(), cause: no_address().into() }
        );
    }

    #[test]
    fn a_name_with_two_addresses_of_which_the_first_refuses_is_connected_to() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let found = ["[::1]:0", "127.0.0.1:0"].map(|address| address.parse().unwrap());
        let resolver = Resolver::new(move |_: &str| Ok(found.to_vec()));
        let stream = connect_by(&resolver, "txt.local", port, secs(30)).unwrap();
        assert_eq!(stream.peer_addr().unwrap(), listener.local_addr().unwrap());
    }
}
