//! The way from the relay to those who look: it never waits, and says when something is missing.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{unbounded, Receiver, Sender};

use crate::told::{Gone, Line, Side};

/// How many bytes may wait to be looked at.
const WAITING_MAX: usize = 32 << 20;
/// What each piece takes besides its bytes.
const PIECE: usize = 128;

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
    /// What has become of the outputs then.
    Halted(Gone, io::Result<()>),
    Closed,
}

/// The relay's end.
pub(super) struct Tap {
    sender: Sender<Piece>,
    waiting: Arc<AtomicUsize>,
}

/// The end of those who look.
pub(super) struct Pieces {
    receiver: Receiver<Piece>,
    waiting: Arc<AtomicUsize>,
}

pub(super) fn tap() -> (Tap, Pieces) {
    let (sender, receiver) = unbounded();
    let waiting = Arc::new(AtomicUsize::new(0));
    (Tap { sender, waiting: Arc::clone(&waiting) }, Pieces { receiver, waiting })
}

impl Tap {
    /// Tells what has happened.
    pub(super) fn tell(&self, piece: Piece) {
        // Nobody looks any more when the program ends.
        let _ = self.sender.send(piece);
    }

    /// Tells what a side of this connection has sent. `missed` is whether there was no room, and then nothing more is
    /// told.
    pub(super) fn tell_bytes(
        &self,
        (line, connection): (Line, u64),
        side: Side,
        at: Instant,
        bytes: &[u8],
        missed: &mut bool,
    ) {
        if *missed {
            return;
        }
        *missed = !self.reserve(bytes.len());
        let what = match side {
            _ if *missed => What::Missed,
            Side::Program => What::FromProgram(bytes.to_vec()),
            Side::Controller => What::FromController(bytes.to_vec()),
        };
        self.tell(Piece { line, connection, at, what });
    }

    /// Whether there is room for this number of bytes, which then has to be reported.
    fn reserve(&self, bytes: usize) -> bool {
        let size = bytes + PIECE;
        if self.waiting.load(Ordering::Relaxed) + size > WAITING_MAX {
            return false;
        }
        self.waiting.fetch_add(size, Ordering::Relaxed);
        true
    }
}

impl Pieces {
    /// The next piece, if there is one.
    pub(super) fn next(&self) -> Option<Piece> {
        let piece = self.receiver.try_recv().ok()?;
        if let What::FromProgram(bytes) | What::FromController(bytes) = &piece.what {
            self.waiting.fetch_sub(bytes.len() + PIECE, Ordering::Relaxed);
        }
        Some(piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_been_looked_at_makes_room() {
        let (tap, pieces) = tap();
        let half = WAITING_MAX / 2;
        assert!(tap.reserve(half));
        let what = What::FromProgram(vec![0; half]);
        tap.tell(Piece { line: Line::Main, connection: 1, at: Instant::now(), what });
        assert!(!tap.reserve(half));
        assert!(pieces.next().is_some());
        assert!(tap.reserve(half));
        assert!(pieces.next().is_none());
    }
}
