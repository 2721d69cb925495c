//! `txt stop`: switches off what another program has left on.

use std::io::{self, ErrorKind, Read};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{anyhow, ensure, Context};
use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::TransferAreaComHandler;

use crate::{arguments, interrupt, lines, print};

/// For how long a guardian tries to stop a controller that does not answer, and the pause between two attempts.
const TRIES: Duration = Duration::from_secs(10);
const RETRY: Duration = Duration::from_millis(300);

const AFTER: &str = "\
Goes online, which ends what a program has left, sends one exchange with all outputs off, also
those of extensions, and goes offline. A program that is still online keeps the controller: end
that program first. The exit status is 0 only when each controller has answered.

With --guard it first waits until its standard input is closed, as happens when the program that
has started it is killed, and then tries for 10 s. A byte before that ends it: the program has
stopped its motors itself. Until then only SIGKILL ends it.

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
    if args.guard {
        ensure!(
            !args.hosts.iter().any(|host| arguments::is_auto(host)),
            "--guard needs the address of its controller: the only one that answers may be another one by then"
        );
        interrupt::outlive_requests()?;
        if !is_left()? {
            return Ok(());
        }
        // Its output is that of the program that was killed, which perhaps nobody reads. It stops without a thread for
        // that, too.
        let _ = lines::never_wait();
    }
    // None waits for another one that does not answer.
    let limit = if args.guard { TRIES } else { Duration::ZERO };
    let start = |host| thread::Builder::new().spawn(move || stop(host, limit));
    let stops: Vec<_> = args.hosts.into_iter().map(start).collect();
    let stopped = stops.into_iter().map(|stop| match stop {
        Ok(stop) => stop.join().unwrap_or_else(|_| Err(anyhow!("a stop has crashed"))),
        Err(error) => Err(error).context("a controller is not stopped"),
    });
    let mut errors: Vec<_> = stopped.filter_map(Result::err).collect();
    // The caller prints the last one.
    let last = errors.pop();
    errors.iter().for_each(|error| lines::print(&print::sentence(error)));
    last.map_or(Ok(()), Err)
}

/// Waits until the program that has started this one is gone. Whether it has left its controllers to us.
fn is_left() -> anyhow::Result<bool> {
    match io::stdin().read_exact(&mut [0]) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(true),
        read => read.map(|()| false).context("can't read the standard input"),
    }
}

/// Stops a controller, and tries it again for up to this limit.
fn stop(host: String, limit: Duration) -> anyhow::Result<()> {
    let begin = Instant::now();
    let stop = || -> anyhow::Result<String> {
        let handler = TransferAreaComHandler::builder(&*host).areas(MAX_AREAS).build()?;
        handler.begin_transfer()?;
        drop(handler.areas().wait_cycle()?);
        handler.end_transfer()?;
        Ok(handler.device_name().unwrap_or_default())
    };
    let name = loop {
        match stop() {
            Err(_) if begin.elapsed() < limit => thread::sleep(RETRY),
            done => break done.with_context(|| format!("{host} is not stopped"))?,
        }
    };
    let reported = format!("all outputs of {} are off", print::clean(&name));
    if limit.is_zero() {
        return print::line(reported);
    }
    lines::print(&reported);
    Ok(())
}
