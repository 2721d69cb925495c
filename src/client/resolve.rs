//! Finding the addresses of host names, within a time limit.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};
use std::sync::{Arc, Weak};
use std::time::Instant;

use parking_lot::{const_mutex, Condvar, Mutex};

use super::limits::TimeLeft;
use crate::error::Error;

/// Finds addresses by asking the operating system.
pub(super) static SYSTEM: Resolver<fn(&str) -> io::Result<Vec<SocketAddr>>> =
    Resolver::new(ask_system);

fn ask_system(host: &str) -> io::Result<Vec<SocketAddr>> {
    Ok((host, 0).to_socket_addrs()?.collect())
}

/// Finds addresses by a function that nothing can interrupt.
///
/// So each name is looked up in a thread, which is left to itself when the time is over. There is
/// one thread for a name at most, so that a program that tries again and again has no more of them.
pub(super) struct Resolver<F> {
    ask: F,
    /// The threads keep their lookups alive.
    under_way: Mutex<BTreeMap<String, Weak<Lookup>>>,
}

#[derive(Default)]
struct Lookup {
    answer: Mutex<Option<io::Result<Vec<SocketAddr>>>>,
    answered: Condvar,
}

impl<F> Resolver<F> {
    pub(super) const fn new(ask: F) -> Self {
        Self { ask, under_way: const_mutex(BTreeMap::new()) }
    }
}

impl<F> Resolver<F>
where
    F: Fn(&str) -> io::Result<Vec<SocketAddr>> + Clone + Send + 'static,
{
    /// The addresses of a host, with this port.
    pub(super) fn addresses(
        &self,
        host: &str,
        port: u16,
        left: &mut TimeLeft,
    ) -> Result<Vec<SocketAddr>, Error> {
        if let Ok(address) = host.parse::<IpAddr>() {
            return Ok(vec![(address, port).into()]);
        }
        let lookup = self.lookup(host)?;
        let rest = left.next(Instant::now).unwrap_or_default();
        let mut answer = lookup.answer.lock();
        lookup.answered.wait_while_for(&mut answer, |answer| answer.is_none(), rest);
        match &*answer {
            Some(Ok(addresses)) => {
                let with_port = addresses.iter().copied().map(|mut address| {
                    address.set_port(port);
                    address
                });
                Ok(with_port.collect())
            }
            Some(Err(error)) => {
                Err(Error::HostNotFound { host: host.to_owned(), reason: error.to_string() })
            }
            None => Err(Error::LookupTimedOut { host: host.to_owned(), limit: left.limit() }),
        }
    }

    /// The lookup of this name that is under way, or a new one.
    fn lookup(&self, host: &str) -> Result<Arc<Lookup>, Error> {
        let mut under_way = self.under_way.lock();
        if let Some(lookup) = under_way.get(host).and_then(Weak::upgrade) {
            return Ok(lookup);
        }
        under_way.retain(|_, lookup| lookup.strong_count() > 0);
        let lookup = Arc::new(Lookup::default());
        let (ask, name, answered) = (self.ask.clone(), host.to_owned(), Arc::clone(&lookup));
        std::thread::Builder::new()
            .name("host-lookup".to_owned())
            .spawn(move || {
                let answer = ask(&name);
                *answered.answer.lock() = Some(answer);
                answered.answered.notify_all();
            })
            .map_err(|error| Error::not_started(&error))?;
        under_way.insert(host.to_owned(), Arc::downgrade(&lookup));
        Ok(lookup)
    }
}
