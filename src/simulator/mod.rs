//! A simulated TXT controller in process, for programs and tests without a controller.
//!
//! [`SimulatedTxt`] listens on 127.0.0.1 and speaks the controller's side of the protocol on its
//! main connection: QueryStatus, StartOnline, UpdateConfig, both exchanges and StopOnline. It
//! serves one client after another. Behind it stands a small [`Machine`]: motors turn their duty
//! into counter pulses, finish distances and follow each other, counters are reset, sounds take
//! their time. A program sets its inputs and looks at its outputs, and orders
//! [faults](Fault) to see what a client makes of them.
//!
//! ```
//! use std::io::{Read, Write};
//! use std::net::TcpStream;
//!
//! use ft_transfer_area::simulator::SimulatedTxt;
//! use ft_transfer_area::wire::{CommandId, QueryStatusResponse};
//! use ft_transfer_area::FirmwareVersion;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let txt = SimulatedTxt::builder().firmware(FirmwareVersion::new(4, 1, 6)).start()?;
//! let mut stream = TcpStream::connect(txt.address())?;
//! let mut command = Vec::new();
//! CommandId::QueryStatus.emit(&mut command);
//! stream.write_all(&command)?;
//! let mut response = [0; QueryStatusResponse::LEN];
//! stream.read_exact(&mut response)?;
//! assert_eq!(QueryStatusResponse::parse(&response)?.name(), "TX2013");
//! # Ok(())
//! # }
//! ```
//!
//! # How the machine behaves
//!
//! * It moves on by one step per exchange: the [pace](SimulatedTxtBuilder::pace), or 10 ms when
//!   that is zero.
//! * A motor at duty 512 gives 200 pulses per second, in either direction, on the counter with
//!   its number.
//! * A motor command with a distance resets the counter, stops the motor after so many pulses and
//!   is reported as done in the response of that exchange. Without distance and master it is done
//!   at once. A motor that is synchronised without a distance, or with an injected error, goes on
//!   until its next command, which means its own command is never done.
//! * A synchronised motor that is switched on turns at the speed of the motor it follows, in its
//!   own direction. An injected error makes it turn at twice that speed, or stand still, until it
//!   is so many pulses ahead or behind.
//! * A counter reset is reported as done in the response after the one to its command.
//! * A sound takes a second per repeat; index 0 is done at once, repeat 0 never.
//! * StopOnline and a lost client set all outputs to 0, stop motors and sounds and forget all
//!   commands, as StartOnline does. The counters stay.
//! * Whoever sends garbage, a wrong checksum, or an exchange before StartOnline is disconnected.

mod command;
mod controller;
mod fault;
mod machine;
mod motor;
#[cfg(test)]
mod replay;
mod server;
mod session;
mod sound;
mod words;

use std::fmt;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

pub use controller::Controller;
pub use fault::{Fault, FaultKind};
pub use machine::Machine;

use crate::transfer_area::MAX_EXTENSIONS;
use crate::{Error, FirmwareVersion};
use server::{Server, Shared};
use session::{Script, Settings};

/// The machine time of an exchange without pace.
const UNPACED_STEP: Duration = Duration::from_millis(10);

/// A simulated TXT, listening on 127.0.0.1 until it is dropped.
///
/// Dropping it closes the connections and waits for its thread, which takes a few milliseconds,
/// and about a second at worst, with a client that does not read. A
/// [script](SimulatedTxtBuilder::on_exchange) is waited for.
pub struct SimulatedTxt {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl SimulatedTxt {
    /// A simulated TXT to be set up and [started](SimulatedTxtBuilder::start).
    pub fn builder() -> SimulatedTxtBuilder {
        SimulatedTxtBuilder {
            extensions: 0,
            firmware: FirmwareVersion::new(4, 6, 6),
            device_name: String::from("TX2013"),
            pace: Duration::from_millis(10),
            idle_limit: Duration::from_secs(5),
            faults: Vec::new(),
            script: Box::new(|_| {}),
            port: 0,
        }
    }

    /// 127.0.0.1 and the port of the main connection.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The port of the main connection.
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// Looks at or changes the simulated machine between two exchanges.
    ///
    /// Blocks while an exchange takes place, and holds the next one up while `f` runs. Calling
    /// this or [`wait_until`](Self::wait_until) from within `f`, a condition or a script blocks
    /// for ever.
    pub fn with_machine<R>(&self, f: impl FnOnce(&mut Machine) -> R) -> R {
        self.shared.with_machine(f)
    }

    /// Blocks until the condition holds; `false` when the limit is reached first.
    ///
    /// The condition is checked at once and after every command and connection change.
    pub fn wait_until(&self, limit: Duration, condition: impl FnMut(&Machine) -> bool) -> bool {
        self.shared.wait_until(limit, condition)
    }
}

impl Drop for SimulatedTxt {
    fn drop(&mut self) {
        self.shared.stop();
        if let Some(Err(_)) = self.thread.take().map(JoinHandle::join) {
            log::error!("the simulated TXT ended by a panic, perhaps of its script");
        }
    }
}

impl fmt::Debug for SimulatedTxt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedTxt").field("address", &self.address).finish_non_exhaustive()
    }
}

/// How a simulated TXT is to be.
#[must_use = "nothing is simulated before `start`"]
pub struct SimulatedTxtBuilder {
    extensions: usize,
    firmware: FirmwareVersion,
    device_name: String,
    pace: Duration,
    idle_limit: Duration,
    faults: Vec<Fault>,
    script: Script,
    port: u16,
}

impl SimulatedTxtBuilder {
    /// The number of extensions, 0..=8, all alive at the start. The default is 0.
    pub fn extensions(mut self, extensions: usize) -> Self {
        self.extensions = extensions;
        self
    }

    /// The firmware version that is reported. It decides whether the compressed exchange carries
    /// the microphone values. The default is 4.6.6.
    pub fn firmware(mut self, firmware: FirmwareVersion) -> Self {
        self.firmware = firmware;
        self
    }

    /// The name that is reported, cut at 16 bytes. The default is `TX2013`.
    pub fn device_name(mut self, device_name: &str) -> Self {
        device_name.clone_into(&mut self.device_name);
        self
    }

    /// How long after the previous exchange response the next one leaves, and the step by which
    /// the machine moves on. With [`Duration::ZERO`] it leaves at once, and the step is 10 ms.
    /// The default is 10 ms.
    pub fn pace(mut self, pace: Duration) -> Self {
        self.pace = pace;
        self
    }

    /// How long a connection may be without commands before it is closed. The default is 5 s.
    pub fn idle_limit(mut self, idle_limit: Duration) -> Self {
        self.idle_limit = idle_limit;
        self
    }

    /// Orders a fault, in addition to those ordered before.
    pub fn fault(mut self, fault: Fault) -> Self {
        self.faults.push(fault);
        self
    }

    /// Sets a script, in place of an earlier one.
    ///
    /// It is called for each exchange, after the machine has taken over the outputs and moved on
    /// and before the response is built, so it may set any input. The machine is locked, so the
    /// script must not call [`SimulatedTxt::with_machine`]. When it panics, the simulated TXT
    /// closes its connection and answers no more.
    pub fn on_exchange(mut self, script: impl FnMut(&mut Machine) + Send + 'static) -> Self {
        self.script = Box::new(script);
        self
    }

    /// The port of the main connection, 0 for one that is free. The default is 0.
    pub fn port(mut self, port: u16) -> Self {
        self.port = port;
        self
    }

    /// Starts to listen on 127.0.0.1. Does not block.
    ///
    /// # Errors
    ///
    /// [`Error::AreaCount`] when there are more than 8 extensions, [`Error::SimulatorFailed`]
    /// when the port is taken or the operating system refuses a socket or a thread.
    pub fn start(self) -> Result<SimulatedTxt, Error> {
        if self.extensions > MAX_EXTENSIONS {
            return Err(Error::AreaCount { given: self.extensions.saturating_add(1) });
        }
        self.listen().map_err(|error| Error::SimulatorFailed { reason: error.to_string() })
    }

    fn listen(self) -> std::io::Result<SimulatedTxt> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, self.port))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared::new(Machine::new(self.extensions)));
        let server = Server {
            listener,
            shared: Arc::clone(&shared),
            settings: self.settings(),
            pace: self.pace,
            idle_limit: self.idle_limit,
            faults: self.faults,
            script: self.script,
        };
        let thread = thread::Builder::new()
            .name(String::from("simulated-txt"))
            .spawn(move || server.run())?;
        Ok(SimulatedTxt { address, shared, thread: Some(thread) })
    }

    fn settings(&self) -> Settings {
        let mut device_name = [0; 16];
        for (byte, given) in device_name.iter_mut().zip(self.device_name.bytes()) {
            *byte = given;
        }
        let step = if self.pace.is_zero() { UNPACED_STEP } else { self.pace };
        // Half a million years are enough.
        let step = u64::try_from(step.as_micros()).unwrap_or(u64::MAX);
        Settings { device_name, firmware: self.firmware, step }
    }
}

impl fmt::Debug for SimulatedTxtBuilder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedTxtBuilder")
            .field("extensions", &self.extensions)
            .field("firmware", &self.firmware)
            .field("device_name", &self.device_name)
            .field("pace", &self.pace)
            .field("faults", &self.faults)
            .finish_non_exhaustive()
    }
}
