//! The way from the relay to those who look: it never waits, and says when something is missing.

use std::cell::Cell;
use std::io;
use std::net::SocketAddr;
use std::time::Instant;

use crate::queue::{queue, Put, Take};
use crate::seen::{Gone, Line, Side};

/// How many bytes may wait to be looked at.
const ROOM: usize = 32 << 20;
/// How much of it is only for what happens to connections.
const KEPT: usize = 2 << 20;
/// How much of it is for what passes on connections that do not drive, so that nobody beside the program that drives
/// takes its room, or the time to look at it.
const fn room_of_others(line: Line) -> usize {
    match line {
        // Each four bytes may be a command.
        Line::Main => 1 << 20,
        // Pictures of 10 s need less.
        Line::Camera | Line::I2c => 8 << 20,
    }
}
/// The first bytes of each connection have all the room: they may be those with which it begins to drive.
const BEGINNING: usize = 1 << 10;

/// Something that has passed, or has happened to a connection.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) line: Line,
    /// The number of the connection.
    pub(super) connection: u64,
    pub(super) at: Instant,
    pub(super) what: What,
}

#[derive(Debug)]
pub(super) enum What {
    /// A program connects, from this address.
    Opened(SocketAddr),
    /// The controller refuses the connection.
    Refused(io::Error),
    FromProgram(Vec<u8>),
    FromController(Vec<u8>),
    /// The controller sends nothing more.
    ControllerEnded,
    /// So many bytes were not kept that what follows can't be understood.
    Missed,
    /// The program has gone: what follows as from it is from the relay, which stops the controller.
    Gone,
    /// So much was not kept that nothing is known of the connections that there were.
    Lost,
    /// What has become of the outputs then.
    Halted(Gone, io::Result<()>),
    Closed,
}

/// The relay's end.
pub(super) struct Tap {
    pieces: Put<Piece>,
    /// What has happened to a connection was lost: nothing that was open then can be followed any more.
    lost: Cell<bool>,
}

/// How much of a connection was reported.
#[derive(Default)]
pub(super) struct Telling {
    bytes: usize,
    /// There was no room, and nothing more is reported.
    pub(super) missed: bool,
}

/// The end of those who look.
pub(super) struct Pieces(Take<Piece>);

pub(super) fn tap() -> (Tap, Pieces) {
    let (put, take) = queue(ROOM);
    (Tap { pieces: put, lost: Cell::new(false) }, Pieces(take))
}

impl Tap {
    /// Tells what has happened.
    pub(super) fn report(&self, piece: Piece) {
        if self.lost.get() {
            let Piece { line, connection, at, .. } = piece;
            self.lost.set(!self.pieces.put(Piece { line, connection, at, what: What::Lost }, KEPT));
        }
        if !self.lost.get() {
            self.lost.set(!self.pieces.put(piece, 0));
        }
    }

    /// Reports what a side of this connection has sent. One that drives has more room.
    pub(super) fn pass_bytes(
        &self,
        (line, connection): (Line, u64),
        side: Side,
        at: Instant,
        bytes: &[u8],
        (telling, drives): (&mut Telling, bool),
    ) {
        if telling.missed {
            return;
        }
        let what = match side {
            Side::Program => What::FromProgram(bytes.to_vec()),
            Side::Controller => What::FromController(bytes.to_vec()),
        };
        telling.bytes = telling.bytes.saturating_add(bytes.len());
        let room =
            if drives || telling.bytes <= BEGINNING { ROOM - KEPT } else { room_of_others(line) };
        let piece = Piece { line, connection, at, what };
        telling.missed = !self.pieces.put_below(piece, bytes.len(), room);
        if telling.missed {
            self.report(Piece { line, connection, at, what: What::Missed });
        }
    }
}

impl Pieces {
    /// The next piece, if there is one.
    pub(super) fn next(&self) -> Option<Piece> {
        self.0.next()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn happened(what: What) -> Piece {
        Piece { line: Line::Main, connection: 1, at: Instant::now(), what }
    }

    /// Tells of so many bytes; returns whether there was room.
    fn report(tap: &Tap, size: usize, drives: bool) -> bool {
        let mut telling = Telling::default();
        let bytes = vec![0; size];
        let seen = (&mut telling, drives);
        tap.pass_bytes((Line::Main, 1), Side::Program, Instant::now(), &bytes, seen);
        !telling.missed
    }

    #[test]
    fn bytes_without_room_are_missed_and_what_was_looked_at_makes_room() {
        let (tap, pieces) = tap();
        assert!(report(&tap, ROOM / 2, true) && !report(&tap, ROOM / 2, true));
        assert!(matches!(pieces.next().unwrap().what, What::FromProgram(_)));
        assert!(matches!(pieces.next().unwrap().what, What::Missed));
        assert!(report(&tap, ROOM / 2, true));
    }

    #[test]
    fn others_take_no_room_of_the_one_that_drives_or_begins() {
        let (tap, _pieces) = tap();
        assert!(!(0..ROOM / 4096).all(|_| report(&tap, 4096, false)), "they have a bound");
        assert!(report(&tap, 100, false), "a beginning");
        assert!(report(&tap, ROOM / 2, true));
    }

    #[test]
    fn what_happens_to_connections_is_bounded_too_and_a_gap_in_it_is_told() {
        let (tap, pieces) = tap();
        (0..ROOM / 64).for_each(|_| tap.report(happened(What::Closed)));
        let seen = std::iter::from_fn(|| pieces.next()).count();
        assert!(seen > 10_000 && seen < ROOM / 64, "{seen}");
        tap.report(happened(What::Gone));
        let then = [pieces.next(), pieces.next()].map(|piece| piece.unwrap().what);
        assert!(matches!(then, [What::Lost, What::Gone]), "{then:?}");
    }
}
