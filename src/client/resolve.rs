//! Finding the addresses of host names, within a time limit.

use std::collections::BTreeMap;
use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::{Arc, Weak};
use std::time::Instant;

use parking_lot::{const_mutex, Condvar, Mutex};

use super::address::numeric;
use super::limits::TimeLeft;
use crate::error::{Error, IoError};

/// What is found for a name.
pub(super) type Found = Result<Vec<SocketAddr>, IoError>;

/// Finds addresses by asking the operating system.
pub(super) static SYSTEM: Resolver<fn(&str) -> Found> = Resolver::new(ask_system);

fn ask_system(host: &str) -> Found {
    Ok((host, 0).to_socket_addrs()?.collect())
}

/// Finds addresses by a function that nothing can interrupt.
///
/// So each name is looked up in a thread, which goes on alone when the time is over. There is at most
/// one thread per name, even when a program tries again and again.
pub(super) struct Resolver<F> {
    ask: F,
    /// The threads own their lookups.
    under_way: Mutex<BTreeMap<String, Weak<Lookup>>>,
}

#[derive(Default)]
struct Lookup {
    answer: Mutex<Option<Found>>,
    answered: Condvar,
}

impl<F> Resolver<F> {
    pub(super) const fn new(ask: F) -> Self {
        Self { ask, under_way: const_mutex(BTreeMap::new()) }
    }
}

impl<F> Resolver<F>
where
    F: Fn(&str) -> Found + Clone + Send + 'static,
{
    /// The addresses of a host, with this port.
    pub(super) fn addresses(
        &self,
        host: &str,
        port: u16,
        left: &mut TimeLeft,
    ) -> Result<Vec<SocketAddr>, Error> {
        if let Some(address) = numeric(host, port) {
            return Ok(vec![address]);
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
                Err(Error::HostNotFound { host: host.to_owned(), cause: error.clone() })
            }
            None => Err(Error::LookupTimedOut { host: host.to_owned(), limit: left.limit() }),
        }
    }

    /// The lookup of this name that is running, or a new one.
    fn lookup(&self, host: &str) -> Result<Arc<Lookup>, Error> {
        let mut under_way = self.under_way.lock();
        let same = under_way.get(host).and_then(Weak::upgrade);
        if let Some(lookup) = same.filter(|lookup| lookup.answer.lock().is_none()) {
            return Ok(lookup);
        }
        under_way.retain(|_, lookup| lookup.strong_count() > 0);
        let lookup = Arc::new(Lookup::default());
        let (ask, name, answered) = (self.ask.clone(), host.to_owned(), Arc::clone(&lookup));
        std::thread::Builder::new()
            .name("ft/lookup".to_owned())
            .spawn(move || {
                let answer = ask(&name);
                *answered.answer.lock() = Some(answer);
                answered.answered.notify_all();
            })
            .map_err(Error::not_started)?;
        under_way.insert(host.to_owned(), Arc::downgrade(&lookup));
        Ok(lookup)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{self, ErrorKind};
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    const PORT: u16 = 65000;

    /// Longer than anything takes on a busy machine.
    const AMPLE: Duration = Duration::from_secs(30);

    fn within(limit: Duration) -> TimeLeft {
        TimeLeft::new(limit, Instant::now())
    }

    fn address(text: &str) -> SocketAddr {
        text.parse().unwrap()
    }

    #[test]
    fn numeric_addresses_need_no_lookup() {
        let resolver = Resolver::new(|host: &str| panic!("{host} was looked up"));
        for (host, expected) in [
            ("192.168.7.2", "192.168.7.2:65000"),
            ("::1", "[::1]:65000"),
            ("fe80::1:2", "[fe80::1:2]:65000"),
        ] {
            // A lookup would have no time at all.
            let found = resolver.addresses(host, PORT, &mut within(Duration::ZERO));
            assert_eq!(found, Ok(vec![address(expected)]));
        }
    }

    #[test]
    fn all_addresses_of_a_name_are_found_with_the_port() {
        let found = ["10.0.0.1:0", "[fe80::1]:0"].map(address);
        let resolver = Resolver::new(move |_: &str| Ok(found.to_vec()));
        let addresses = resolver.addresses("txt.local", PORT, &mut within(AMPLE));
        assert_eq!(addresses, Ok(["10.0.0.1:65000", "[fe80::1]:65000"].map(address).to_vec()));
    }

    #[test]
    fn an_unknown_name_is_an_error_with_the_reason() {
        let resolver = Resolver::new(|_: &str| Err(io::Error::from(ErrorKind::NotFound).into()));
        let error = resolver.addresses("txt.local", PORT, &mut within(AMPLE)).unwrap_err();
        let cause = io::Error::from(ErrorKind::NotFound).into();
        assert_eq!(error, Error::HostNotFound { host: "txt.local".to_owned(), cause });
    }

    #[test]
    fn slow_name_servers_take_no_longer_than_the_limit_and_are_asked_once_at_a_time() {
        let (asked, questions) = mpsc::channel();
        let (answer, answers) = mpsc::channel();
        let answers = Arc::new(Mutex::new(answers));
        let resolver = Resolver::new(move |host: &str| {
            if host != "slow.local" {
                return Ok(vec![]);
            }
            asked.send(()).unwrap();
            answers.lock().recv_timeout(AMPLE).unwrap()
        });
        let limit = Duration::from_millis(20);
        let timed_out = Err(Error::LookupTimedOut { host: "slow.local".to_owned(), limit });
        for _ in 0..5 {
            assert_eq!(resolver.addresses("slow.local", PORT, &mut within(limit)), timed_out);
        }
        questions.recv_timeout(AMPLE).unwrap();
        assert_eq!(questions.try_recv(), Err(mpsc::TryRecvError::Empty));

        // It does not delay others.
        assert_eq!(resolver.addresses("other.local", PORT, &mut within(AMPLE)), Ok(vec![]));

        // A second caller gets the result of the running lookup.
        std::thread::scope(|scope| {
            let late = scope.spawn(|| resolver.addresses("slow.local", 1, &mut within(AMPLE)));
            // The lookup's thread holds it, and the caller that waits for it.
            let holders = || resolver.under_way.lock()["slow.local"].strong_count();
            let begin = Instant::now();
            while holders() < 2 {
                assert!(begin.elapsed() < AMPLE, "nobody waits");
                std::thread::yield_now();
            }
            answer.send(Ok(vec![address("10.0.0.1:0")])).unwrap();
            assert_eq!(late.join().unwrap(), Ok(vec![address("10.0.0.1:1")]));
        });

        // The answer is not kept.
        assert_eq!(resolver.addresses("slow.local", PORT, &mut within(limit)), timed_out);
        questions.recv_timeout(AMPLE).unwrap();
        answer.send(Ok(vec![])).unwrap();
    }
}
