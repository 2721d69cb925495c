//! `txt stop`: switches off what another program has left on.

use std::io::{self, ErrorKind, Read};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Scope, ScopedJoinHandle};
use std::time::{Duration, Instant};

use anyhow::{anyhow, ensure, Context};
use ft_transfer_area::wire::QueryStatusResponse;
use ft_transfer_area::{controller_address, stop_controller, Error, TimeLimits};

use crate::{arguments, interrupt, lines, print};

/// For how long a guardian tries to stop a controller that does not answer, and the pause between two attempts.
const TRIES: Duration = Duration::from_secs(10);
const RETRY: Duration = Duration::from_millis(300);

/// How long a guardian looks up a name.
const LOOKUP: Duration = Duration::from_millis(1500);

const AFTER: &str = "\
Goes online, which ends what a program has left, sends one exchange with all outputs off, also
those of extensions, and goes offline. A program that is still online keeps the controller: end
that program first. The exit status is 0 only when each controller has answered.

With --guard it first waits until its standard input is closed, as happens when the program that
has started it is killed, and then tries for 10 s. A byte before that ends it: the program has
stopped its motors itself. Until then only SIGKILL ends it, and what the system sends for a crash.

Example: txt stop 192.168.7.2";

/// Switch off what a program has left on
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Controllers: an address or a name, with a port if it is not 65000
    #[arg(value_name = "HOST", default_value = "auto")]
    hosts: Vec<String>,
    /// Wait until the standard input is closed; a byte before that ends the wait without a stop
    #[arg(long)]
    guard: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    // A line about one controller keeps no other one on.
    interrupt::write_from_behind()?;
    let mut known = vec![None; args.hosts.len()];
    if args.guard {
        ensure!(
            !args.hosts.iter().any(|host| arguments::is_auto(host)),
            "--guard needs the address of its controller: the only one that answers may be another one by then"
        );
        interrupt::outlive_requests()?;
        // When the program is killed, perhaps nobody knows the name any more.
        known = addresses_of(&args.hosts);
        if !is_left()? {
            return Ok(());
        }
        // Its output is that of the program that was killed, which perhaps nobody reads. It stops without a thread for
        // that, too.
        let _ = lines::never_wait();
    }
    let guard = args.guard;
    // None waits for another one that does not answer.
    let stop_one = |(host, known): &(String, _)| match guard {
        true => stop_left(host, *known),
        false => stop(host, host, Duration::ZERO),
    };
    let hosts: Vec<_> = args.hosts.into_iter().zip(known).collect();
    let stopped: Vec<_> = thread::scope(|scope| {
        let begun: Vec<_> =
            hosts.iter().map(|host| Begun::new(scope, move || stop_one(host))).collect();
        begun.into_iter().map(Begun::end).collect()
    });
    let mut errors: Vec<_> = stopped.into_iter().filter_map(Result::err).collect();
    // The caller prints the last one.
    let last = errors.pop();
    errors.iter().for_each(|error| lines::print(&print::sentence(error)));
    last.map_or(Ok(()), Err)
}

/// The addresses of these names, as far as they are found. None waits for another one.
fn addresses_of(hosts: &[String]) -> Vec<Option<SocketAddr>> {
    thread::scope(|scope| {
        let look_up = |host| move || controller_address(host, LOOKUP).ok();
        let begun: Vec<_> = hosts
            .iter()
            .map(|host| thread::Builder::new().spawn_scoped(scope, look_up(host)))
            .collect();
        begun.into_iter().map(|thread| thread.ok()?.join().ok()?).collect()
    })
}

/// Waits until the program that has started this one is gone. Whether it has left its controllers to us.
fn is_left() -> anyhow::Result<bool> {
    match io::stdin().read_exact(&mut [0]) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(true),
        read => read.map(|()| false).context("can't read the standard input"),
    }
}

/// Stops a controller that a killed program has left, which had this address when the program began. If its name leads
/// to another one by now, the program has perhaps connected to that one anew.
fn stop_left(host: &str, known: Option<SocketAddr>) -> anyhow::Result<()> {
    let Some(address) = known else { return stop(host, host, TRIES) };
    // The program may have reached it by another address of that name.
    let has_others = AtomicBool::new(false);
    let stop_at = |at: &str| {
        stop_controller(at, TimeLimits::default()).or_else(|error| {
            match has_others.load(Ordering::SeqCst) {
                true => stop_controller(host, TimeLimits::default()),
                false => Err(error),
            }
        })
    };
    thread::scope(|scope| {
        let at_first = Begun::new(scope, || stop_by(host, TRIES, || stop_at(&address.to_string())));
        match controller_address(host, LOOKUP) {
            // Nobody may be left at the first one.
            Ok(now) if now != address => stop(host, host, TRIES),
            now => {
                has_others.store(now.is_ok(), Ordering::SeqCst);
                at_first.end()
            }
        }
    })
}

/// A stop that goes on in a thread. Where none can be started, it is done at once: others wait.
enum Begun<'a> {
    InThread(ScopedJoinHandle<'a, anyhow::Result<()>>),
    Done(anyhow::Result<()>),
}

impl<'a> Begun<'a> {
    fn new<'b>(
        scope: &'a Scope<'a, 'b>,
        stop: impl Fn() -> anyhow::Result<()> + Clone + Send + 'a,
    ) -> Self {
        let started = thread::Builder::new().spawn_scoped(scope, stop.clone());
        started.map_or_else(|_| Self::Done(stop()), Self::InThread)
    }

    fn end(self) -> anyhow::Result<()> {
        match self {
            Self::InThread(thread) => {
                thread.join().unwrap_or_else(|_| Err(anyhow!("a stop has crashed")))
            }
            Self::Done(result) => result,
        }
    }
}

/// Stops a controller at this address or with this name, and tries it again for up to this limit.
fn stop(host: &str, at: &str, limit: Duration) -> anyhow::Result<()> {
    stop_by(host, limit, || stop_controller(at, TimeLimits::default()))
}

fn stop_by(
    host: &str,
    limit: Duration,
    attempt: impl Fn() -> Result<QueryStatusResponse, Error>,
) -> anyhow::Result<()> {
    let begin = Instant::now();
    let stopped = loop {
        match attempt() {
            Err(_) if begin.elapsed() < limit => thread::sleep(RETRY),
            done => break done.with_context(|| format!("{host} is not stopped"))?,
        }
    };
    let name = stopped.name();
    let of = if name.is_empty() { String::new() } else { format!(" of {}", print::clean(&name)) };
    let reported = format!("all outputs{of} at {host} are off");
    if limit.is_zero() {
        return print::line(reported);
    }
    lines::print(&reported);
    Ok(())
}

#[cfg(test)]
mod tests {
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;

    const LIMIT: Duration = Duration::from_secs(60);

    #[test]
    fn what_is_left_is_stopped_where_it_was_and_where_its_name_leads_now() {
        let txts = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
        let [was, is] = txts.each_ref().map(SimulatedTxt::address);
        let exchanges = || {
            // The last one has no response that would be waited for.
            let are_left =
                txts.iter().all(|txt| txt.wait_until(|machine| !machine.online(), LIMIT));
            assert!(are_left);
            txts.each_ref().map(|txt| txt.with_machine(|machine| machine.exchanges()))
        };
        // Nobody knows the name any more.
        stop_left("txt.invalid", Some(was)).unwrap();
        let [first, none] = exchanges();
        assert!(first > 0 && none == 0);
        // It is that of another address.
        stop_left(&is.to_string(), Some(was)).unwrap();
        let [second, other] = exchanges();
        assert!(second > first && other > 0);
        // It was not known at first.
        stop_left(&is.to_string(), None).unwrap();
        let [same, more] = exchanges();
        assert!(same == second && more > other);
    }
}
