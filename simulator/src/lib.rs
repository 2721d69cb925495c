//! A simulated TXT inside the program, for programs and tests without a controller.
//!
//! [`SimulatedTxt`] listens on 127.0.0.1 and speaks the controller's side of the protocol on its
//! main connection: QueryStatus, StartOnline, UpdateConfig, both exchanges, StopOnline, and the
//! camera's start and stop. It serves one client after another. It has a small [`Machine`]: motors
//! turn their duty into counter pulses, finish distances and follow each other, counters are reset,
//! sounds take their time. A program sets its inputs and reads its outputs, or plugs in a [`world`]
//! of sensors and motors, and injects [faults](Fault) to see how a client handles them. A second
//! connection has the frames of a camera, a third one reaches I2C devices.
//!
//! ```
//! use std::io::{Read, Write};
//! use std::net::TcpStream;
//!
//! use ft_transfer_area_simulator::SimulatedTxt;
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
//! This describes a machine without a world; [with one](world#how-it-moves), motors have inertia
//! and load.
//!
//! * Its time follows the clock while a client is online, and afterwards, for a minute at most, while an output is on or
//!   a sound plays. It stands still at other times. So a client that exchanges more seldom than the
//!   [pace](SimulatedTxtBuilder::pace) allows sees motors as fast as a real controller's. Without a pace, and in
//!   [lock-step](SimulatedTxtBuilder::lock_step), time moves by one step per exchange.
//! * Outputs count from when they arrive. A response has the inputs of the time at which it is sent.
//! * A motor at duty 512 gives 200 pulses per second, in either direction, on the counter with
//!   its number. A counter counts when its level rises from 0 to 1.
//! * A motor command with a distance resets the counter, stops the motor after that many pulses and
//!   is reported as done in the response of that exchange. Without distance and master it is done
//!   immediately. A motor that is synchronised without a distance, or with an injected error, goes
//!   on until its next command, so its own command is never done.
//! * Of two synchronised motors the one that is ahead is slowed down. A positive injected error slows the follower down
//!   until it is so many pulses behind, a negative one slows the leader down; with more than 16 pulses left it stands.
//! * A counter reset is reported as done in the response after the one to its command. During a distance it moves the end
//!   on: the motor stops when its counter has come to the distance.
//! * A sound takes the time of the controller's file per repeat, with repeat 0, too. One that begins while another plays
//!   is done immediately, and so is index 0 then. Index 0 while nothing plays, and an index above 29, are never done.
//! * StopOnline and a lost client leave all outputs as they are. StartOnline sets them to 0, stops motors and forgets all
//!   commands; a sound plays on. The counters stay. A [watchdog](SimulatedTxtBuilder::board_watchdog) is not there by default.
//! * 8 bits of a duty, 4 bits of a master, three bits of the number of a motor's commands and the low byte of a
//!   configuration's id count. So the eighth command after one that is done is reported as done immediately.
//! * After StartOnline the configuration id of every controller is 0, so the next configuration with
//!   any other id is taken over.
//! * A client that sends garbage or a wrong checksum is disconnected.
//! * One client is served at a time. Others are accepted by the system, get no answer, and are served one after the
//!   other.
//! * A client that does something a correct client does not do, but that can be understood, is
//!   answered, and the machine's [oddities](Machine::oddities) report it. They also report a
//!   distance or a synchronisation that never ends, because a motor of the world has no encoder.
//!
//! Some of this is assumed, because no description of the protocol says it: that StartOnline forgets
//! the configuration ids and the echoed ids of finished commands; that an extension forgets all
//! commands while it is cut off, so that commands which its client still sends are carried out
//! again when it comes back; that a motor command with an injected error is never done; and [how
//! strongly](world#what-is-assumed) synchronised motors are slowed down. A program should not rely on it.
//!
//! What the firmware's program decides was measured on the maker's firmware 4.7.0 under emulation. Where it ends or
//! refuses, this is kinder, unless it is [strict](SimulatedTxtBuilder::strict).
//!
//! # I2C
//!
//! The devices on the [I2C port](SimulatedTxt::i2c_port) are plugged in by
//! [`Machine::i2c_device`]; each has 256 registers of one byte. The first byte that is written is the number of a
//! register. The others go into that register and the following ones, and reading begins after the last of them. After
//! register 255 comes register 0. What the devices do is assumed; the packets are those of the firmware. One client is
//! served at a time, and its connection is closed when it has been idle for the
//! [idle limit](SimulatedTxtBuilder::idle_limit); others wait.
//!
//! # The camera
//!
//! StartCameraOnline is answered immediately, and the camera serves on its [own
//! port](SimulatedTxt::camera_port) when its [start-up
//! time](SimulatedTxtBuilder::camera_start_up) has passed. The real controller refuses a connection
//! before that, and while the camera is off. The simulated TXT keeps its port open all the time,
//! unless [another behaviour](CameraConnection) is chosen: it lets an early client wait for its
//! frames, because some clients connect once and then expect frames; while the camera is off it
//! closes the connection immediately.
//! StopCameraOnline, a new StartCameraOnline, StartOnline, StopOnline and the loss of the main
//! client end a camera connection, even in the middle of a frame. One client is served at a time;
//! others wait.
//!
//! * Frames are produced by the clock, at the requested rate, from when the client connected; a rate
//!   below 1 is 15 per second. Each shows its number, counted from 0.
//! * The next frame is sent when the last one is acknowledged and there is a newer one. It is always
//!   the newest. `frames_ready` is 1 if it was there before the acknowledgement, otherwise 0.
//! * Frames have the requested size, 1..=4096 in each direction, except that 1280×960 is delivered
//!   as 1280×720; the header says 1280×960 all the same. With any other size the camera does not start.
//! * A frame is a baseline JPEG, 4:2:2, with no EOI marker and 40 bytes of garbage after it. In
//!   frames with odd numbers the garbage has the marker bytes FF C0, FF DA and FF D3.
//! * If the client sends anything but the acknowledgement, the camera connection ends.
//!
//! The picture is a test card: colour bars (grey, yellow, cyan, green, magenta, red, blue,
//! black), a white bar that crosses them from left to right in 64 frames, the lowest 16 bits of
//! the frame's number in decimal digits if there is room for them, and the same in 16 blocks
//! along the bottom edge: white is 1, the most significant bit is on the left. In a picture of at
//! least 16×16 pixels a program finds bit *i* from the left (*i* = 0..=15), in integers, at
//!
//! ```text
//! x = i * width / 16 + width / 32
//! y = height - 1 - height / 16
//! ```
//!
//! where luma or green of 128 or more is white.

mod builder;
mod camera;
mod error;
mod factory;
mod fault;
#[doc(hidden)]
pub mod fuzzing;
mod i2c;
mod machine;
mod server;
pub mod world;

use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;
use ft_transfer_area::notices;

pub use builder::SimulatedTxtBuilder;
pub use camera::CameraConnection;
pub use error::Error;
pub use factory::SimulatedFactory;
pub use fault::{Fault, FaultKind, FaultPlace, ParseFaultError};
pub use i2c::I2C_REGISTERS;
pub use machine::controller::Controller;
pub use machine::Machine;
use server::shared::Shared;

/// A simulated TXT, listening on 127.0.0.1 until it is dropped.
///
/// Dropping it closes the connections and waits for its threads. They end at once, except that a running
/// [script](SimulatedTxtBuilder::on_exchange) and the encoder of a camera picture are waited for: 1 s in all, also of all
/// in a [`SimulatedFactory`]. After that they end by themselves. A logger that blocks has 0.1 s for the last lines, but
/// holds up no simulated TXT.
///
/// It has three threads, one for each port. A thread that has nothing to do sleeps until something comes or is
/// due. So hundreds of simulated TXTs can be in one program; each needs about 10 open files on Linux.
pub struct SimulatedTxt {
    address: SocketAddr,
    camera_port: u16,
    i2c_port: u16,
    shared: Arc<Shared>,
    /// Ends with the last of its threads.
    alive: Receiver<()>,
    /// How long a drop may take, if it is one of several that are dropped.
    end_by: Option<Instant>,
}

impl SimulatedTxt {
    /// A builder to set up a simulated TXT and [start](SimulatedTxtBuilder::start) it.
    pub fn builder() -> SimulatedTxtBuilder {
        SimulatedTxtBuilder::new()
    }

    /// The address and the port of the main connection: 127.0.0.1 unless it was
    /// [set](SimulatedTxtBuilder::bind).
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The port of the main connection.
    pub fn port(&self) -> u16 {
        self.address.port()
    }

    /// The port of the camera connection, at the same address.
    pub fn camera_port(&self) -> u16 {
        self.camera_port
    }

    /// The port of the I2C connection, at the same address.
    pub fn i2c_port(&self) -> u16 {
        self.i2c_port
    }

    /// Reads or changes the simulated machine between two exchanges. If it follows the clock, it is as it is
    /// now.
    ///
    /// Blocks while an exchange takes place, and delays the next one while `f` runs. Calling this
    /// or [`wait_until`](Self::wait_until) inside `f`, a condition or a script blocks forever.
    pub fn with_machine<R>(&self, f: impl FnOnce(&mut Machine) -> R) -> R {
        self.shared.with_machine(f)
    }

    /// Blocks until the condition holds; `false` when the limit is reached first, with [`Duration::MAX`] never.
    ///
    /// The condition is checked immediately, after every command and connection change, and at the limit.
    pub fn wait_until(&self, condition: impl FnMut(&Machine) -> bool, limit: Duration) -> bool {
        self.shared.wait_until(limit, condition)
    }
}

/// How long a drop waits for threads.
const END_LIMIT: Duration = Duration::from_secs(1);

/// How long it waits for the logger then, so that a program that ends has its last lines.
const LAST_LINES: Duration = Duration::from_millis(100);

impl Drop for SimulatedTxt {
    fn drop(&mut self) {
        let deadline = self.end_by.unwrap_or_else(|| Instant::now() + END_LIMIT);
        self.shared.stop_until(deadline);
        // Nothing is sent: the senders end with the threads.
        let _ = self.alive.recv_deadline(deadline);
        notices::flush(LAST_LINES.min(deadline.saturating_duration_since(Instant::now())));
    }
}

impl fmt::Debug for SimulatedTxt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedTxt")
            .field("address", &self.address)
            .field("camera_port", &self.camera_port)
            .field("i2c_port", &self.i2c_port)
            .finish_non_exhaustive()
    }
}

/// The README's program is tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
