//! What the bytes mean that have passed.
//!
//! Each connection has a reader of its own. After something that it can't understand, nothing more of this
//! connection is reported, because the state of the compression is lost; the connection itself goes on.

mod camera;
mod i2c;
mod main_line;

use std::collections::HashMap;
use std::time::Instant;

use self::camera::CameraReader;
use self::i2c::I2cReader;
use self::main_line::MainReader;
use super::tap::{Piece, What};
use crate::told::{Happened, Line, Side, Told};

/// A reader of one connection. The error says what can't be understood.
trait Reader {
    fn read(
        &mut self,
        side: Side,
        at: Instant,
        bytes: &[u8],
        tell: &mut dyn FnMut(Happened),
    ) -> Result<(), String>;

    /// The program has gone; what follows as from it is not.
    fn program_gone(&mut self) {}

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
            What::Gone => {
                if let Some(Some(reader)) = self.readers.get_mut(&connection) {
                    reader.program_gone();
                }
            }
            What::Halted(gone, done) => tell(Happened::Halted { gone, error: done.err() }),
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
    use std::net::SocketAddr;

    use ft_transfer_area::wire::CommandId;

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
