//! What the bytes mean that have passed.
//!
//! Each connection has a reader of its own. After something that can't be understood, the main connection is read on:
//! exchanges from the next StartOnline on, because the state of the compression is lost. Of another connection nothing
//! more is reported. The connection itself goes on.

mod camera;
mod i2c;
mod main_line;
mod online;
mod outgoing;
mod unanswered;

use std::collections::BTreeMap;
use std::time::Instant;

use self::camera::CameraReader;
use self::i2c::I2cReader;
use self::main_line::MainReader;
use super::tap::{Piece, What};
use crate::seen::{Happened, Line, Seen, Side};

/// A reader of one connection. The error says what can't be understood.
trait Reader {
    fn read(
        &mut self,
        side: Side,
        at: Instant,
        bytes: &[u8],
        report: &mut dyn FnMut(Happened),
    ) -> Result<(), String>;

    /// Tells what has not happened until now.
    fn look(&mut self, _now: Instant, _tell: &mut dyn FnMut(Happened)) {}

    /// The program has gone; what follows as from it is not.
    fn program_gone(&mut self) {}

    /// The controller sends nothing more.
    fn controller_ended(&mut self, _tell: &mut dyn FnMut(Happened)) {}

    /// The connection has ended, or is not understood any more.
    fn end(&mut self, _tell: &mut dyn FnMut(Happened)) {}
}

/// A reader; `None` when its connection is not understood any more.
type Place = Option<Box<dyn Reader + Send>>;

/// Reads all connections.
#[derive(Default)]
pub(crate) struct Decoder {
    /// Of all connections that are open.
    readers: BTreeMap<u64, (Line, Place)>,
}

impl Decoder {
    /// Tells what a piece means.
    pub(super) fn take(&mut self, piece: Piece, report: &mut dyn FnMut(Seen)) {
        let Piece { line, connection, at, what } = piece;
        let mut tell_it = |what| report(Seen { at, line, connection, what });
        match what {
            What::Opened(from) => {
                self.readers.insert(connection, (line, Some(reader(line))));
                tell_it(Happened::Connected(from));
            }
            What::Halted(gone, done) => tell_it(Happened::Halted { gone, error: done.err() }),
            What::Lost => self.forget(at, report),
            what => self.of_open(connection, at, what, &mut tell_it),
        }
    }

    /// Tells what has not happened until now, such as a response.
    pub(super) fn look(&mut self, now: Instant, report: &mut dyn FnMut(Seen)) {
        for (connection, (line, reader)) in &mut self.readers {
            let (line, connection) = (*line, *connection);
            if let Some(reader) = reader {
                reader.look(now, &mut |what| report(Seen { at: now, line, connection, what }));
            }
        }
    }

    /// What has happened to a connection. One that was opened while too much waited is not followed.
    fn of_open(
        &mut self,
        connection: u64,
        at: Instant,
        what: What,
        report: &mut dyn FnMut(Happened),
    ) {
        let Some((_, reader)) = self.readers.get_mut(&connection) else { return };
        match what {
            What::Refused(error) => report(Happened::Refused(error)),
            What::FromProgram(bytes) => read(reader, Side::Program, at, &bytes, report),
            What::FromController(bytes) => read(reader, Side::Controller, at, &bytes, report),
            What::ControllerEnded => {
                if let Some(reader) = reader {
                    reader.controller_ended(report);
                }
            }
            What::Gone => {
                if let Some(reader) = reader {
                    reader.program_gone();
                }
            }
            What::Missed => give_up(reader, Happened::Missed, report),
            What::Closed => {
                if let Some(reader) = reader {
                    reader.end(report);
                }
                self.readers.remove(&connection);
                report(Happened::Closed);
            }
            What::Opened(_) | What::Halted(..) | What::Lost => {}
        }
    }

    /// Nothing is known of the connections that there were.
    fn forget(&mut self, at: Instant, report: &mut dyn FnMut(Seen)) {
        for (connection, (line, mut reader)) in std::mem::take(&mut self.readers) {
            let mut report = |what| report(Seen { at, line, connection, what });
            give_up(&mut reader, Happened::Missed, &mut report);
            report(Happened::Closed);
        }
    }
}

fn read(
    place: &mut Place,
    side: Side,
    at: Instant,
    bytes: &[u8],
    report: &mut dyn FnMut(Happened),
) {
    let Some(reader) = place else { return };
    if let Err(why) = reader.read(side, at, bytes, report) {
        give_up(place, Happened::NotUnderstood { side, why }, report);
    }
}

/// Nothing more of this connection is reported.
fn give_up(place: &mut Place, why: Happened, report: &mut dyn FnMut(Happened)) {
    let Some(mut reader) = place.take() else { return };
    report(why);
    reader.end(report);
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
    use std::time::Duration;

    use ft_transfer_area::wire::{
        CommandId, ExchangeData, ExchangeDataResponse, ResponseId, StartOnline,
    };

    use super::*;
    use crate::seen::Farewell;

    /// What is seen of one connection in these pieces, with the time between them.
    fn seen(pieces: Vec<(u64, What)>) -> Vec<Happened> {
        let (mut decoder, mut seen) = (Decoder::default(), Vec::new());
        let begin = Instant::now();
        let mut at = begin;
        let opened = (0, What::Opened(SocketAddr::from(([127, 0, 0, 1], 1))));
        for (ms, what) in [opened].into_iter().chain(pieces) {
            at += Duration::from_millis(ms);
            decoder.look(at, &mut |one| seen.push(one.what));
            let piece = Piece { line: Line::Main, connection: 1, at, what };
            decoder.take(piece, &mut |one| seen.push(one.what));
        }
        seen.split_off(1)
    }

    fn command(command: CommandId) -> What {
        let mut out = Vec::new();
        match command {
            CommandId::StartOnline => StartOnline::new().emit(&mut out),
            CommandId::ExchangeData => ExchangeData::default().emit(&mut out),
            _ => command.emit(&mut out),
        }
        What::FromProgram(out)
    }

    fn response(response: ResponseId) -> What {
        let mut out = Vec::new();
        match response {
            ResponseId::ExchangeData => ExchangeDataResponse::default().emit(&mut out),
            _ => response.emit(&mut out),
        }
        What::FromController(out)
    }

    #[test]
    fn after_a_gap_in_what_was_looked_at_nothing_more_is_told() {
        let query = || command(CommandId::QueryStatus);
        let seen = seen(vec![(0, query()), (0, What::Missed), (0, query()), (0, What::Closed)]);
        assert!(
            matches!(
                &seen[..],
                [Happened::Command(CommandId::QueryStatus), Happened::Missed, Happened::Closed]
            ),
            "{seen:?}"
        );
    }

    #[test]
    fn a_response_that_is_missing_is_told_and_what_follows_is_understood() {
        let seen = seen(vec![
            (0, command(CommandId::StartOnline)),
            (500, response(ResponseId::StartOnline)),
            (10, command(CommandId::ExchangeData)),
            // The program has waited for two seconds, and goes on.
            (2000, command(CommandId::ExchangeData)),
            (10, response(ResponseId::ExchangeData)),
            // Here it did not wait.
            (10, command(CommandId::ExchangeData)),
            (900, command(CommandId::StopOnline)),
            (10, response(ResponseId::StopOnline)),
        ]);
        // Its outputs are shown before.
        assert!(matches!(seen[2], Happened::Unanswered(_)), "{seen:?}");
        let Happened::NoAnswer { command, .. } = seen[3] else { panic!("{seen:?}") };
        assert_eq!(command, CommandId::ExchangeData);
        assert!(
            matches!(
                &seen[4..],
                [
                    Happened::Cycle(_),
                    Happened::Unanswered(_),
                    Happened::Command(CommandId::StopOnline),
                    Happened::NoAnswer { command: CommandId::ExchangeData, .. },
                    Happened::Offline(Farewell::Answered)
                ]
            ),
            "{seen:?}"
        );
    }

    #[test]
    fn commands_of_another_program_are_told_and_those_of_the_kit_understood() {
        let robo_pro = || What::FromProgram(0xACAB_31F7_u32.to_le_bytes().to_vec());
        let seen = seen(vec![
            (0, command(CommandId::StartOnline)),
            (0, response(ResponseId::StartOnline)),
            (0, robo_pro()),
            (0, What::FromController([&0x5170_C53B_u32.to_le_bytes()[..], &[0; 16]].concat())),
            (0, command(CommandId::ExchangeData)),
            (0, response(ResponseId::ExchangeData)),
            // A response without a command.
            (0, response(ResponseId::ExchangeData)),
        ]);
        let unknown = seen.iter().filter_map(|one| match one {
            Happened::Unknown(unknown) => Some(unknown.to_string()),
            _ => None,
        });
        let expected = [
            "unknown command 0xacab31f7, 4 bytes",
            "unknown response 0x5170c53b, 20 bytes",
            "unknown response 0x4eefac41, 80 bytes",
        ];
        assert_eq!(unknown.collect::<Vec<_>>(), expected);
        assert!(matches!(seen[4], Happened::Cycle(_)), "{seen:?}");
    }
}
