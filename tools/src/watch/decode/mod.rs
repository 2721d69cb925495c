//! What the bytes mean that have passed.
//!
//! Each connection has a reader of its own. After something that it can't understand, nothing more of this
//! connection is reported, because the state of the compression is lost; the connection itself goes on.

mod camera;
mod i2c;
mod main_line;
mod packet;

use std::collections::HashMap;
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{CameraFrame, FirmwareVersion, FishX1Transfer};

use self::camera::CameraReader;
use self::i2c::I2cReader;
use self::main_line::MainReader;
use super::ports::Line;
use super::tap::{Piece, What};

/// Who has sent something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Program,
    Controller,
}

impl Side {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Program => "program",
            Self::Controller => "controller",
        }
    }
}

/// What has happened, and when.
#[derive(Debug)]
pub(crate) struct Told {
    pub(crate) at: Instant,
    pub(crate) line: Line,
    pub(crate) what: Happened,
}

#[derive(Debug)]
pub(crate) enum Happened {
    /// A program has connected, from this address.
    Connected(SocketAddr),
    /// The controller does not take the connection.
    Refused(io::Error),
    /// The connection is closed, by whichever side.
    Closed,
    /// The controller has said what it is.
    Controller {
        name: String,
        firmware: FirmwareVersion,
    },
    /// The program has sent a command that is no exchange.
    Command(CommandId),
    /// Online mode has begun.
    Online {
        name: String,
        firmware: FirmwareVersion,
    },
    /// Online mode has ended, by the program or without it.
    Offline {
        by_program: bool,
    },
    Cycle(Box<Cycle>),
    Picture(CameraFrame),
    I2c(I2cExchange),
    /// What this side has sent can't be understood. It was passed on.
    NotUnderstood {
        side: Side,
        why: String,
    },
    /// This computer was too busy to look at all that has passed on this connection.
    Missed,
}

/// Why nothing more of a connection is reported.
pub(super) const MISSED: &str = "this computer is too busy to look at all that passes";

/// The same as a sentence for people.
pub(crate) fn missed(line: Line) -> String {
    let line = line.name();
    format!("{MISSED}: nothing more of this {line} connection is shown, and everything is passed on all the same")
}

/// One exchange.
#[derive(Debug)]
pub(crate) struct Cycle {
    /// Its number since online mode began, from 1.
    pub(crate) number: u64,
    /// The time since the response before; `None` for the first.
    pub(crate) since_last: Option<Duration>,
    /// How long the program took from the response before to this request; `None` for the first.
    pub(crate) answer: Option<Duration>,
    /// How many configurations were sent since online mode began.
    pub(crate) config_updates: u64,
    /// The configurations and outputs of the request, the inputs of the response.
    pub(crate) areas: Vec<FishX1Transfer>,
}

/// A request to an I2C device, and its answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct I2cExchange {
    pub(crate) device: u32,
    pub(crate) written: Vec<u8>,
    /// `None` when no device has answered.
    pub(crate) read: Option<Vec<u8>>,
}

/// A reader of one connection. The error says what can't be understood.
trait Reader {
    fn read(
        &mut self,
        side: Side,
        at: Instant,
        bytes: &[u8],
        tell: &mut dyn FnMut(Happened),
    ) -> Result<(), String>;

    /// The controller sends nothing more.
    fn controller_ended(&mut self, _tell: &mut dyn FnMut(Happened)) {}

    /// The connection has ended, or is not understood any more.
    fn end(&mut self, _tell: &mut dyn FnMut(Happened)) {}
}

/// Reads all connections.
#[derive(Default)]
pub(crate) struct Decoder {
    /// `None` for a connection that is not understood any more.
    readers: HashMap<u64, Option<Box<dyn Reader + Send>>>,
}

impl Decoder {
    /// Tells what a piece means.
    pub(super) fn take(&mut self, piece: Piece, tell: &mut dyn FnMut(Told)) {
        let Piece { line, connection, at, what } = piece;
        let mut tell = |what| tell(Told { at, line, what });
        match what {
            What::Opened(from) => {
                self.readers.insert(connection, Some(reader(line)));
                tell(Happened::Connected(from));
            }
            What::Refused(error) => tell(Happened::Refused(error)),
            What::FromProgram(bytes) => {
                self.read(connection, Side::Program, at, &bytes, &mut tell);
            }
            What::FromController(bytes) => {
                self.read(connection, Side::Controller, at, &bytes, &mut tell);
            }
            What::ControllerEnded => {
                if let Some(Some(reader)) = self.readers.get_mut(&connection) {
                    reader.controller_ended(&mut tell);
                }
            }
            What::Missed => {
                self.give_up(connection, Happened::Missed, &mut tell);
            }
            What::Closed => {
                if let Some(Some(mut reader)) = self.readers.remove(&connection) {
                    reader.end(&mut tell);
                }
                tell(Happened::Closed);
            }
        }
    }

    fn read(
        &mut self,
        connection: u64,
        side: Side,
        at: Instant,
        bytes: &[u8],
        tell: &mut dyn FnMut(Happened),
    ) {
        let Some(Some(reader)) = self.readers.get_mut(&connection) else { return };
        if let Err(why) = reader.read(side, at, bytes, tell) {
            self.give_up(connection, Happened::NotUnderstood { side, why }, tell);
        }
    }

    fn give_up(&mut self, connection: u64, why: Happened, tell: &mut dyn FnMut(Happened)) {
        let Some(place) = self.readers.get_mut(&connection) else { return };
        let Some(mut reader) = place.take() else { return };
        tell(why);
        reader.end(tell);
    }
}

fn reader(line: Line) -> Box<dyn Reader + Send> {
    match line {
        Line::Main => Box::new(MainReader::default()),
        Line::Camera => Box::new(CameraReader::default()),
        Line::I2c => Box::new(I2cReader::default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_a_gap_in_what_was_looked_at_nothing_more_is_told() {
        let (mut decoder, mut told) = (Decoder::default(), Vec::new());
        let query = || What::FromProgram(CommandId::QueryStatus.id().to_le_bytes().to_vec());
        let from = SocketAddr::from(([127, 0, 0, 1], 1));
        for what in [What::Opened(from), query(), What::Missed, query(), What::Closed] {
            let piece = Piece { line: Line::Main, connection: 1, at: Instant::now(), what };
            decoder.take(piece, &mut |one| told.push(one.what));
        }
        assert!(
            matches!(
                &told[..],
                [
                    Happened::Connected(_),
                    Happened::Command(CommandId::QueryStatus),
                    Happened::Missed,
                    Happened::Closed
                ]
            ),
            "{told:?}"
        );
    }
}
