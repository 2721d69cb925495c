//! Control a fischertechnik ROBOTICS TXT controller from a PC.
//!
//! A background thread exchanges a TX-compatible transfer area with the controller, about 100
//! times a second. The program reads inputs from it and writes outputs into it:
//!
//! ```
//! use ft_transfer_area::prelude::*;
//!
//! fn run(address: &str) -> Result<(), Error> {
//!     let handler = TransferAreaComHandler::builder(address).build()?;
//!     let areas = handler.areas();
//!     handler.begin_transfer()?;
//!     for _ in 0..100 {
//!         let mut now = areas.wait_cycle()?; // the inputs of the newest exchange
//!         let pressed = now[LOCAL_IO].input.uni[I1] != 0;
//!         now[LOCAL_IO].output.duty[O1] = if pressed { 512 } else { 0 }; // M1
//!     } // the guard is dropped: the outputs go out with the next exchange
//!     handler.end_transfer() // motors off
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A real TXT is at 192.168.7.2 (USB). This one is simulated.
//! let txt = ft_transfer_area_simulator::SimulatedTxt::builder().start()?;
//! run(&txt.address().to_string())?;
//! # Ok(())
//! # }
//! ```
//!
//! <div class="warning">
//!
//! **A guard is a picture of one moment.** `now` above is a [guard](TransferAreaGuard): its inputs are those
//! of one response and do not change while it is kept, and what is written is sent when it is dropped. So get
//! a new guard in each round of a loop. This loop never ends:
//! `let now = areas.wait_cycle()?; while now[LOCAL_IO].input.uni[I1] == 0 {}`. A guard that is kept for a
//! second is reported with the name of its thread: by the logger, or without one on the standard error. To
//! wait for something, use [`wait_until`](TransferAreas::wait_until).
//!
//! </div>
//!
//! # Which part to use
//!
//! | task | use |
//! |---|---|
//! | control a machine, or port a program that polls the transfer area | [`TransferAreaComHandler`] |
//! | port the calls of the TX library or of FtTxtLib | [`tx`] |
//! | wait for a motor, an input or any other condition | [`TransferAreas::wait_until`] and the other waits |
//! | be notified of changes, as by FtTxtLib's callbacks | [`TransferAreas::events`] |
//! | record every cycle | [`TransferAreas::cycle_log`] |
//! | be notified when a motor is blocked | [`TransferAreas::set_stall_limit`] |
//! | measure the time between two responses, and count missed ones | [`TransferAreaGuard::arrived`] and [`cycle`](TransferAreaGuard::cycle) |
//! | control several controllers | [a thread for each](TransferAreas#two-controllers) |
//! | stop the motors when the program hangs | [`TransferAreaComHandlerBuilder::watchdog`] |
//! | continue after a lost connection, as on a slow Wi-Fi | [`TransferAreaComHandlerBuilder::reconnect`] and [`TimeLimits`] |
//! | have a function called in each cycle, as on the controller | [`TransferAreaComHandler::set_cycle_hook`] |
//! | port a C program with a loop around `DoTransferCompressed` | [`TxtClient::do_transfer`] with an [`Exchange`] |
//! | send single commands, without a transfer area | [`TxtClient`] |
//! | exchange over a connection of your own | [`Exchange`] |
//! | look at the bytes | [`wire`] |
//! | find controllers | the host `auto`, or [`find_controllers`] |
//! | switch off what another program has left on | [`stop_controller`] |
//! | get the camera's pictures | [`TransferAreaComHandler::start_camera`], [`TxtClient::start_camera`] |
//! | read and write I2C devices | [`TransferAreaComHandler::i2c`], or an [`I2cClient`] alone |
//! | develop and test without a controller | the crate [`ft-transfer-area-simulator`], with [`TransferAreaComHandlerBuilder::lock_step`] for the same result in each run |
//!
//! The crate is a port of the C-Programming Kit 4.1.6. Search this documentation for a name of the
//! kit to find its place here; [`guide::names`] lists them all. Where the kit has a mistake,
//! [`guide::protocol`] says what it is and what this crate does instead.
//!
//! # Blocking
//!
//! Calls block, as in the kit: a control loop is a sequence of steps, and the controller sets the
//! pace of the one connection. [`TimeLimits`] bound every step on the wire, so nothing waits for a
//! controller forever.
//!
//! # Errors and the machine
//!
//! Bad data from the network and bad arguments give an [`Error`], never a panic. Two mistakes of a
//! program panic, with a message that says what to write instead: a thread that locks the areas while
//! it holds them, because it would wait for itself forever, and an index beyond the handler's areas.
//!
//! Whatever ends a transfer, a last exchange stops its motors if the connection still works. If it does not, or
//! when the program is killed, **motors may go on**; [`guide::reliability`] says what happens when something breaks.
//! A panic ends the transfer [where it can be seen](TransferAreas#when-a-thread-panics). For a program that hangs
//! there is the [watchdog](TransferAreaComHandlerBuilder::watchdog), which is off by default.
//!
//! The end of a transfer, a lost connection and the watchdog set all outputs in the areas to 0. They
//! [count again](TransferAreas#when-outputs-count) when the program knows what happened.
//!
//! # Logging
//!
//! The crate logs through the `log` crate. `error`: the transfer ended with an error. `warn`: the
//! connection is lost and is being re-established, the watchdog has expired, the camera's stream ended with
//! an error, or a duty is out of range. `info`: which controller was reached, connected again, a transfer
//! or stream ended. `debug`: an attempt to connect again failed, or an I2C connection was re-established.
//!
//! # Dependencies
//!
//! `byteorder` reads packets, `crc32fast` computes the checksum, `parking_lot` has locks on which a
//! thread can wait with a limit, `crossbeam-channel` hands over events and camera frames,
//! `jpeg-decoder` decodes the frames, and `log` takes the log's lines.
//!
//! [`ft-transfer-area-simulator`]: https://docs.rs/ft-transfer-area-simulator

#![cfg_attr(docsrs, feature(doc_cfg))]

mod camera;
pub mod channel;
mod client;
mod error;
mod events;
mod exchange;
mod firmware;
mod found;
#[doc(hidden)]
pub mod fuzzing;
#[cfg(any(doc, doctest))]
pub mod guide;
mod handler;
mod i2c;
#[doc(hidden)]
pub mod notices;
mod pause;
pub mod prelude;
mod statistics;
mod terminals;
pub mod transfer_area;
pub mod tx;
pub mod wire;

pub use camera::{CameraFrame, CameraOptions, CameraStatistics, CameraStream, Picture, PowerLine};
pub use client::{
    controller_address, find_controllers, SearchOptions, TimeLimits, TxtClient, PORT, USUAL_HOSTS,
};
pub use error::{Error, IoError};
pub use events::{
    Event, EventDetails, EventKind, Joystick, LogEntry, Logged, LoggedBeginning, LoggedCycle,
    TimedEvent,
};
pub use exchange::{Exchange, Inputs, TransferMode};
pub use firmware::FirmwareVersion;
pub use found::{ConnectionKind, FoundController, FoundControllers, TriedAddress};
#[cfg(not(all(test, shuttle)))]
pub use handler::stop_controller;
pub use handler::{
    CycleLog, Events, TransferAreaComHandler, TransferAreaComHandlerBuilder, TransferAreaGuard,
    TransferAreas,
};
pub use i2c::I2cClient;
pub use statistics::Statistics;
pub use transfer_area::FishX1Transfer;

/// The README's programs are tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
