//! What the examples have in common: their command line, the controller that they talk to, and
//! when they end.

// Each example uses a part of it.
#![allow(dead_code)]

use std::error::Error;
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder, PORT};
use lexopt::prelude::{Long, Short, Value, ValueExt};

/// How long an example runs on a simulated controller unless it is told otherwise, in seconds.
const SECONDS: u64 = 10;

/// Whether somebody has pressed Ctrl-C.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

pub(crate) type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

/// Runs an example. When it fails, it says why in a sentence, and the status is 1.
pub(crate) fn main(run: fn() -> Result) -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if was_stopped(&*error) => {
            println!("Stopped.");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Whether it is what a wait returns after [`Example::stop_in_time`] has ended the transfer.
fn was_stopped(error: &(dyn Error + 'static)) -> bool {
    matches!(error.downcast_ref(), Some(ft_transfer_area::Error::NotStarted))
}

/// A run of an example.
pub(crate) struct Example {
    pub(crate) host: String,
    pub(crate) port: u16,
    /// The controller when none is named, for as long as this lives.
    simulated: Option<SimulatedTxt>,
    /// When it ends; `None` when only Ctrl-C ends it.
    end: Option<Instant>,
}

impl Example {
    /// Reads the command line `[--seconds N] [HOST[:PORT]]`. Without a host, this simulated TXT
    /// takes the controller's place.
    pub(crate) fn start(
        usage: &str,
        simulated: impl FnOnce() -> Result<SimulatedTxtBuilder>,
    ) -> Result<Self> {
        Self::start_with(usage, simulated, |_, _| Ok(false))
    }

    /// The same with options of the example's own: `take` gets the name of each, without its
    /// dashes, and the parser to read a value from; it tells whether there is such an option.
    pub(crate) fn start_with(
        usage: &str,
        simulated: impl FnOnce() -> Result<SimulatedTxtBuilder>,
        mut take: impl FnMut(&str, &mut lexopt::Parser) -> Result<bool>,
    ) -> Result<Self> {
        let mut named = None;
        let mut seconds = None;
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("seconds") => seconds = Some(parser.value()?.parse()?),
                Long("help") | Short('h') => {
                    println!("{usage}");
                    std::process::exit(0);
                }
                Long(option) => {
                    let option = option.to_owned();
                    if !take(&option, &mut parser)? {
                        return Err(format!("there is no option --{option}\n{usage}").into());
                    }
                }
                Value(host) if named.is_none() => named = Some(host.string()?),
                other => return Err(format!("{}\n{usage}", other.unexpected()).into()),
            }
        }
        ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed))?;
        let (host, port, simulated) = match named {
            Some(named) => {
                let (host, port) = host_and_port(&named)?;
                (host.to_owned(), port, None)
            }
            None => {
                println!(
                    "No controller is named, so this is a simulated one that plays by itself."
                );
                seconds = seconds.or(Some(SECONDS));
                let txt = simulated()?.start()?;
                ("127.0.0.1".to_owned(), txt.port(), Some(txt))
            }
        };
        let after = |seconds| Instant::now().checked_add(Duration::from_secs(seconds));
        Ok(Self { host, port, simulated, end: seconds.and_then(after) })
    }

    /// Settings for a handler of the controller.
    pub(crate) fn handler(&self) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandler::builder(&self.host).port(self.port)
    }

    /// The simulated TXT, if no controller is named, for an example that does something to it.
    pub(crate) fn take_simulated(&mut self) -> Option<SimulatedTxt> {
        self.simulated.take()
    }

    /// Whether there is time left and nobody has pressed Ctrl-C.
    pub(crate) fn goes_on(&self) -> bool {
        !is_over(self.end)
    }

    /// Has the machine stopped when the example must not go on, whatever it waits for then.
    pub(crate) fn stop_in_time(&self, handler: &TransferAreaComHandler) {
        let end = self.end;
        handler.set_cycle_hook(move |_| {
            if is_over(end) {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
    }
}

/// Whether the time is up or somebody has pressed Ctrl-C.
fn is_over(end: Option<Instant>) -> bool {
    end.is_some_and(|end| end <= Instant::now()) || INTERRUPTED.load(Ordering::Relaxed)
}

/// Host and port of `HOST[:PORT]`. An IPv6 address has colons of its own, and no port here.
fn host_and_port(text: &str) -> Result<(&str, u16)> {
    match text.split_once(':') {
        Some((host, port)) if !port.contains(':') => match port.parse() {
            Ok(port) => Ok((host, port)),
            Err(_) => Err(format!("{port:?} in {text:?} is no port").into()),
        },
        _ => Ok((text, PORT)),
    }
}
