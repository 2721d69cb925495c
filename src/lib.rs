//! Control a fischertechnik ROBOTICS TXT controller from a PC.
//!
//! A background thread keeps a TX-compatible transfer area in step with the controller, about 100
//! times a second. The program reads inputs from it and writes outputs into it:
//!
//! ```
//! use ft_transfer_area::transfer_area::LOCAL_IO;
//! use ft_transfer_area::{Error, TransferAreaComHandler};
//!
//! fn run(host: &str, port: u16) -> Result<(), Error> {
//!     let handler = TransferAreaComHandler::builder(host).port(port).build()?;
//!     handler.begin_transfer()?;
//!     for _ in 0..100 {
//!         let mut areas = handler.wait_cycle()?; // the inputs of the newest exchange
//!         let pressed = areas[LOCAL_IO].input.uni[0] != 0; // I1
//!         areas[LOCAL_IO].output.duty[0] = if pressed { 512 } else { 0 }; // M1
//!     } // the guard is dropped, and the outputs leave with the next exchange
//!     handler.end_transfer() // motors off
//! }
//!
//! # #[cfg(feature = "simulator")]
//! # fn main() -> Result<(), Error> {
//! // The real one is at 192.168.7.2 (USB), port 65000; this one needs no controller.
//! let txt = ft_transfer_area::simulator::SimulatedTxt::builder().start()?;
//! run("127.0.0.1", txt.port())
//! # }
//! # #[cfg(not(feature = "simulator"))]
//! # fn main() {}
//! ```
//!
//! # Which part to use
//!
//! | to | use |
//! |---|---|
//! | control a machine, or port a program that polls the transfer area | [`TransferAreaComHandler`] |
//! | port the calls of the TX library or of FtTxtLib | [`tx`] |
//! | wait for a motor, an input or any other condition | [`TransferAreaComHandler::wait_until`] and its like |
//! | hear of what changes, as by FtTxtLib's callbacks | [`TransferAreaComHandler::events`] |
//! | stop the motors when the program hangs | [`TransferAreaComHandlerBuilder::watchdog`] |
//! | go on after a lost connection, as on a slow WLAN | [`TransferAreaComHandlerBuilder::reconnect`] and [`TimeLimits`] |
//! | have a function called in each cycle, as on the controller | [`TransferAreaComHandler::set_cycle_hook`] |
//! | port a C program with a loop around `DoTransferCompressed` | [`TxtClient::do_transfer`] with an [`Exchange`] |
//! | send single commands, without a transfer area | [`TxtClient`] |
//! | drive the exchange over a connection of your own | [`Exchange`] |
//! | look at the bytes | [`wire`] |
//! | see through the camera | [`TransferAreaComHandler::start_camera`] |
//! | read and write I2C devices | [`TransferAreaComHandler::i2c`], or an [`I2cClient`] alone |
//! | develop and test without a controller | `simulator` (feature `simulator`) |
//!
//! The crate is a port of the C-Programming Kit 4.1.6; searching this documentation for the kit's
//! names finds their places here, and `docs/porting.md` in the repository has them all. Where the
//! kit has a mistake, `docs/protocol.md` says what it is and what happens here instead.
//!
//! # Blocking
//!
//! Calls block, as in the kit: a control loop is a sequence of steps, and there is one connection
//! whose pace the controller sets. [`TimeLimits`] bound every step on the wire, so nothing waits
//! for a controller for ever.
//!
//! # Errors and the machine
//!
//! Whatever comes over the network or from a caller's argument ends in an [`Error`], never in a
//! panic. One mistake of a program panics, with a sentence that says what to write instead: a thread
//! that locks the areas while it holds them, because it would wait for itself for ever.
//!
//! However a transfer ends, its motors are stopped as far as the connection still allows, and by the
//! controller where it does not: at once when the connection is closed, as that of a program that is
//! killed, and after about 5 s of silence. A panic ends the transfer [where it can be
//! seen](TransferArea#when-a-thread-panics), and so does a cycle hook that does not return within its
//! [limit](TransferAreaComHandlerBuilder::hook_limit). A program that hangs elsewhere is a matter for
//! the [watchdog](TransferAreaComHandlerBuilder::watchdog), which is off unless it is set.
//!
//! The end of a transfer, a lost connection and the watchdog set all outputs in the areas to 0. What
//! was written before moves no motor afterwards, and a command that was cut off never reads as done.
//! [When outputs count](TransferArea#when-outputs-count) again is a matter of what the program knows.
//!
//! `docs/reliability.md` in the repository tells of each fault what the program sees and how soon.
//!
//! # Logging
//!
//! Through the `log` crate. `error`: the transfer ended by an error. `warn`: the connection is lost and
//! made again, the watchdog has expired, the camera's stream ended by an error, or a duty is out of its
//! range. `info`: which controller was reached, connected again, a transfer or stream ended. `debug`: an
//! attempt to connect again failed, or an I2C connection was made anew. The simulated TXT also uses
//! `warn` for what a client does wrong, `info` for what else it does, and `trace` for each exchange.
//!
//! # Dependencies
//!
//! `byteorder` reads packets, `crc32fast` computes the checksum, `parking_lot` has the locks that a
//! thread can wait on with a limit, `crossbeam-channel` hands over events and camera frames,
//! `jpeg-decoder` decodes these, and `log` takes the lines above. With the feature `simulator`
//! only, `jpeg-encoder` encodes what the simulated camera sees, and `serde` and `toml` read the
//! files of its worlds.

mod camera;
mod client;
mod error;
mod exchange;
mod firmware;
#[cfg(feature = "__fuzzing")]
#[doc(hidden)]
pub mod fuzzing;
mod handler;
mod i2c;
mod pause;
#[cfg(feature = "simulator")]
pub mod simulator;
mod terminals;
pub mod transfer_area;
pub mod tx;
pub mod wire;

pub use camera::{CameraFrame, CameraOptions, CameraStatistics, Picture, PowerLine};
pub use client::{TimeLimits, TxtClient, PORT};
pub use error::Error;
pub use exchange::{Exchange, Inputs, TransferMode};
pub use firmware::FirmwareVersion;
pub use handler::{
    Event, EventKind, Events, Joystick, Statistics, TransferArea, TransferAreaComHandler,
    TransferAreaComHandlerBuilder, TransferAreaGuard,
};
pub use i2c::I2cClient;
pub use transfer_area::FishX1Transfer;

/// The README's programs are tested along with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// So are those of the porting guide.
#[cfg(doctest)]
#[doc = include_str!("../docs/porting.md")]
struct Porting;
