//! Finding controllers: several addresses are asked in parallel.

use std::net::{IpAddr, SocketAddr};
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

use super::address::{host_and_port, host_of};
use super::connection::Connection;
use super::limits::{TimeLeft, TimeLimits, LIMIT_RANGE};
use super::resolve::SYSTEM;
use super::tcp::TCP;
use super::transport::{Addresses, Endpoint, Network};
use super::{TxtClient, PORT};
use crate::error::Error;
use crate::found::{ConnectionKind, FoundController, FoundControllers, TriedAddress};
use crate::notices::notice;

/// The host that means the only controller that is found.
const AUTO: &str = "auto";

/// How long the search for it may take. A packet that is lost on a Wi-Fi is sent again after a second.
const AUTO_LIMIT: Duration = Duration::from_millis(1500);

/// The default addresses of a controller: by USB, by its own Wi-Fi, by Bluetooth, and on the same machine.
#[cfg(not(test))]
pub const USUAL_HOSTS: &[&str] = &["192.168.7.2", "192.168.8.2", "192.168.9.2", "127.0.0.1"];
/// Tests ask no other host.
#[cfg(test)]
pub const USUAL_HOSTS: &[&str] = &["127.0.0.1"];

/// How many addresses are asked in parallel, so that a long list does not take all threads.
const AT_A_TIME: usize = 64;

/// Where a search looks, and how long: the options of [`find_controllers`].
#[derive(Clone, Debug)]
pub struct SearchOptions {
    /// `None` for the usual ones.
    addresses: Option<Vec<String>>,
    limit: Duration,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self { addresses: None, limit: AUTO_LIMIT }
    }
}

impl SearchOptions {
    /// The addresses to ask, such as all those in a classroom: each a host with or without a port, as for
    /// [`builder`](crate::TransferAreaComHandler::builder). Default the [usual hosts](USUAL_HOSTS), each at
    /// [port 65000](crate::PORT).
    #[must_use]
    pub fn addresses(mut self, addresses: impl IntoIterator<Item = impl ToString>) -> Self {
        self.addresses = Some(addresses.into_iter().map(|address| address.to_string()).collect());
        self
    }

    /// How long to wait for the answers of 64 addresses, 1 ms to an hour. Default 1.5 s.
    #[must_use]
    pub fn limit(mut self, limit: Duration) -> Self {
        self.limit = limit;
        self
    }
}

/// Finds controllers: at the usual addresses USB (192.168.7.2), Wi-Fi (192.168.8.2), Bluetooth (192.168.9.2) and the
/// controller on which the program runs (127.0.0.1), or at [given ones](SearchOptions::addresses).
///
/// Blocks for up to the [limit](SearchOptions::limit), and for all of it if one of the addresses does not answer at
/// all. Up to 64 addresses are asked in parallel, so more of them take the limit again for each 64. The lookup of a
/// host name that takes longer goes on in the background until it ends; numeric addresses need no lookup. A
/// controller that is connected in two ways is found twice; at the usual addresses, the one on which the program runs
/// is found only once.
///
/// Each controller is asked for its name and firmware, and the connection is closed. This moves nothing and
/// does not begin online mode. A controller that another program uses serves only that program, so it is
/// not found, but an address where it [may be](TriedAddress::perhaps_in_use) is among the others.
///
/// ```no_run
/// use ft_transfer_area::{find_controllers, SearchOptions};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// for controller in find_controllers(&SearchOptions::default())?.controllers {
///     println!("{controller}"); // ROBO TXT with firmware 4.6.6 at 192.168.7.2:65000 (USB)
/// }
/// # Ok(())
/// # }
/// ```
///
/// ```
/// use std::time::Duration;
/// use ft_transfer_area::{find_controllers, SearchOptions};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let txt = ft_transfer_area_simulator::SimulatedTxt::builder().start()?;
/// let addresses = [txt.address().to_string(), "127.0.0.1:1".to_owned()];
/// let options = SearchOptions::default().addresses(&addresses).limit(Duration::from_secs(2));
/// let found = find_controllers(&options)?;
/// assert_eq!(found.controllers[0].address, txt.address());
/// assert_eq!(found.others[0].address, addresses[1]); // 127.0.0.1:1 (this machine): nothing listens there
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// [`Error::NoController`] when none answered, with what happened at each address;
/// [`Error::OutOfRange`] for the limit; [`Error::ThreadNotStarted`].
pub fn find_controllers(options: &SearchOptions) -> Result<FoundControllers, Error> {
    match &options.addresses {
        Some(addresses) => find_at(&TCP, addresses, options.limit),
        None => find_usual(&TCP, PORT, options.limit),
    }
}

fn find_at(
    network: &'static dyn Network,
    addresses: &[String],
    limit: Duration,
) -> Result<FoundControllers, Error> {
    Error::check_millis("limit for the search in ms", limit, LIMIT_RANGE)?;
    let (mut controllers, mut others) = (Vec::new(), Vec::new());
    for some in addresses.chunks(AT_A_TIME) {
        for answer in ask_side_by_side(network, some, limit)? {
            match answer {
                Ok(controller) => controllers.push(controller),
                Err(address) => others.push(address),
            }
        }
    }
    if controllers.is_empty() {
        return Err(Error::NoController { tried: others });
    }
    Ok(FoundControllers { controllers, others })
}

/// The address of a controller's main port, from what a person writes: a host with or without a port, or `auto`, as
/// for [`builder`](crate::TransferAreaComHandler::builder). For programs that make connections of their own.
///
/// A host that has addresses of both kinds gives one of IPv4: a TXT has no other one. Blocks for up to `limit`, 1 ms
/// to an hour, for a name and for `auto`. Only for `auto` controllers are asked.
///
/// ```
/// use std::time::Duration;
/// use ft_transfer_area::controller_address;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let limit = Duration::from_secs(2);
/// assert_eq!(controller_address("192.168.7.2", limit)?.to_string(), "192.168.7.2:65000");
/// assert_eq!(controller_address("[::1]:4000", limit)?.to_string(), "[::1]:4000");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// [`Error::BadAddress`], [`Error::HostNotFound`], [`Error::LookupTimedOut`]; [`Error::NoController`] or
/// [`Error::SeveralControllers`] for `auto`; [`Error::OutOfRange`] for the limit; [`Error::ThreadNotStarted`].
pub fn controller_address(host: &str, limit: Duration) -> Result<SocketAddr, Error> {
    Error::check_millis("limit for the search in ms", limit, LIMIT_RANGE)?;
    let (name, port) = host_and_port(host, PORT)?;
    if is_auto(name) {
        return Ok(only(find_usual(&TCP, port, limit)?)?.address);
    }
    let all = SYSTEM.addresses(name, port, &mut TimeLeft::new(limit, Instant::now()))?;
    let ipv4 = all.iter().find(|address| address.is_ipv4());
    let bad = || Error::BadAddress { given: host.to_owned() };
    ipv4.or(all.first()).copied().ok_or_else(bad)
}

/// Whether the host is to be found.
fn is_auto(host: &str) -> bool {
    host.eq_ignore_ascii_case(AUTO)
}

/// The host itself, or for `auto` the address of the only controller that is found.
pub(crate) fn found_host(
    network: &'static dyn Network,
    host: &str,
    port: u16,
    limit: Duration,
) -> Result<String, Error> {
    if !is_auto(host) {
        return Ok(host.to_owned());
    }
    let controller = only(find_usual(network, port, limit.min(AUTO_LIMIT))?)?;
    notice!(Info, "found {controller}");
    Ok(host_of(controller.address))
}

/// The only one of the controllers that were found; there is at least one. One that does not answer, because a program
/// uses it, may be the one that is meant.
fn only(all: FoundControllers) -> Result<FoundController, Error> {
    let FoundControllers { controllers: mut found, others } = all;
    let in_use: Vec<_> = others.into_iter().filter(|other| other.perhaps_in_use).collect();
    match found.pop() {
        Some(controller) if found.is_empty() && in_use.is_empty() => Ok(controller),
        last => {
            let found = found.into_iter().chain(last).collect();
            Err(Error::SeveralControllers { found, in_use })
        }
    }
}

fn find_usual(
    network: &'static dyn Network,
    port: u16,
    limit: Duration,
) -> Result<FoundControllers, Error> {
    let addresses: Vec<_> = USUAL_HOSTS.iter().map(|host| format!("{host}:{port}")).collect();
    let mut found = find_at(network, &addresses, limit)?;
    found.controllers = without_doubles(found.controllers);
    Ok(found)
}

/// A program on the controller reaches it by each of the controller's addresses.
fn without_doubles(mut found: Vec<FoundController>) -> Vec<FoundController> {
    if found.iter().any(|controller| controller.address.ip().is_loopback()) {
        found.retain(|controller| {
            controller.connection != ConnectionKind::SameMachine
                || controller.address.ip().is_loopback()
        });
    }
    found
}

type Answer = Result<FoundController, TriedAddress>;

fn ask_side_by_side(
    network: &'static dyn Network,
    addresses: &[String],
    limit: Duration,
) -> Result<Vec<Answer>, Error> {
    // The scope waits for all its threads, even when one could not be started.
    thread::scope(|scope| {
        let mut threads = Vec::with_capacity(addresses.len());
        for address in addresses {
            let thread = thread::Builder::new()
                .name("ft/find".to_owned())
                .spawn_scoped(scope, move || ask(network, address, limit));
            threads.push(thread.map_err(Error::not_started)?);
        }
        let answers = threads.into_iter().map(ScopedJoinHandle::join);
        answers.map(|answer| answer.map_err(|panic| Error::from_panic(&*panic))).collect()
    })
}

/// Asks the controller at this address for its name. Blocks up to the limit.
fn ask(network: &'static dyn Network, address: &str, limit: Duration) -> Answer {
    query(network, address, limit).map_err(|error| {
        let host = host_and_port(address, PORT).map_or(address, |(host, _)| host);
        TriedAddress {
            address: address.to_owned(),
            connection: host.parse().map_or(ConnectionKind::Network, ConnectionKind::of),
            outcome: outcome(&error, limit),
            perhaps_in_use: matches!(
                error,
                Error::NoAnswer { .. } | Error::ConnectionClosed { .. }
            ),
        }
    })
}

fn query(
    network: &'static dyn Network,
    address: &str,
    limit: Duration,
) -> Result<FoundController, Error> {
    let begin = Instant::now();
    let limits = TimeLimits { connect: limit, read: limit, write: limit };
    let endpoint = Endpoint::new(network, address, PORT)?;
    let transport = endpoint.open(&limits)?;
    let addresses = transport.addresses();
    let Addresses { own, peer } = addresses.map_err(|error| Error::ConnectFailed {
        address: address.to_owned(),
        cause: error.into(),
    })?;
    let rest = limit.saturating_sub(begin.elapsed());
    let limits = TimeLimits { connect: rest, read: rest, write: rest };
    let status = TxtClient::over(endpoint, Connection::over(transport, limits)).query_status()?;
    Ok(FoundController {
        address: peer,
        connection: connection_kind(own.ip(), peer.ip()),
        name: status.name(),
        firmware: status.version,
    })
}

/// A connection of a machine to itself has the same address on both sides.
fn connection_kind(own: IpAddr, peer: IpAddr) -> ConnectionKind {
    if own == peer {
        ConnectionKind::SameMachine
    } else {
        ConnectionKind::of(peer)
    }
}

/// What happened, in a few words. The error for all addresses says what to check.
fn outcome(error: &Error, limit: Duration) -> String {
    match error {
        Error::ConnectionRefused { .. } => "nothing listens there".to_owned(),
        Error::ConnectTimedOut { .. } => format!("no answer within {limit:?}"),
        Error::ConnectFailed { cause, .. } => cause.to_string(),
        Error::HostNotFound { cause, .. } => format!("there is no such host ({cause})"),
        Error::LookupTimedOut { .. } => format!("its address was not found within {limit:?}"),
        Error::NoAnswer { .. } => {
            format!("it accepted the connection but did not answer within {limit:?}, so another program may be using it")
        }
        Error::ConnectionClosed { .. } => {
            "it closed the connection, so it may be in use, or its program has just ended"
                .to_owned()
        }
        Error::WrongId { .. } | Error::WrongSize { .. } => "what answers is not a TXT".to_owned(),
        other => format!("{other:#}"),
    }
}

#[cfg(test)]
mod tests;
