//! Workpieces and where they are: at places, on belts, in grippers.
//!
//! A floor belongs to all machines of a factory together. Each machine moves what its own motors and
//! valves drive, in its own ticks, and has the floor locked only for as long as that takes.

mod hand;
mod own;
mod part;
mod pieces;
mod plan;

use std::collections::VecDeque;
use std::sync::Arc;

use parking_lot::{Mutex, MutexGuard};

pub(super) use own::LockedFloor;
pub(crate) use own::OwnFloor;
pub use own::Whereabouts;
use part::Part;
pub(super) use plan::Plan;

use super::mishap::Mishap;
use super::piece::Piece;
use crate::machine::journal::notice;

/// How many mishaps are remembered.
const MISHAPS_KEPT: usize = 100;

/// The radius of a workpiece in mm.
pub(super) const RADIUS: f64 = 13.5;

/// A floor, and which machines share it.
#[derive(Debug)]
pub(super) struct SharedFloor(Arc<Mutex<Floor>>);

impl SharedFloor {
    pub(super) fn new(floor: Floor) -> Self {
        Self(Arc::new(Mutex::new(floor)))
    }

    /// The same floor, for another machine.
    pub(super) fn share(&self) -> Self {
        Self(Arc::clone(&self.0))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Floor> {
        self.0.lock()
    }
}

/// A copy of a machine has a floor of its own.
impl Clone for SharedFloor {
    fn clone(&self) -> Self {
        Self::new(self.lock().clone())
    }
}

/// All that workpieces can be on or in. Everything is given by index.
#[derive(Clone, Debug)]
pub(super) struct Floor {
    pub(super) spots: Vec<Spot>,
    pub(super) belts: Vec<Run>,
    pub(super) seats: Vec<Seat>,
    pub(super) holders: Vec<Holder>,
    pub(super) pieces: Vec<PlacedPiece>,
    /// How many pieces have fallen.
    pub(super) fallen: u64,
    mishaps: VecDeque<Mishap>,
}

/// A place.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    pub(super) name: String,
    pub(super) kind: SpotKind,
    /// Whether the newest piece that the script wanted to put here had no room.
    pub(super) is_refused: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum SpotKind {
    /// It does not move. The index is that of the place, or of the one that it is the same as.
    Fixed(usize),
    /// On a belt, this many mm from its start.
    Belt { belt: usize, at: f64, reach: f64 },
    /// Where the seat of a slide is at this position.
    Seat { seat: usize, at: f64, reach: f64 },
}

/// The seat of a slide.
#[derive(Clone, Debug)]
pub(super) struct Seat {
    pub(super) name: String,
    /// Where it is, in the unit of the slide's travel.
    pub(super) position: f64,
}

/// A belt.
#[derive(Clone, Debug)]
pub(super) struct Run {
    pub(super) name: String,
    pub(super) length: f64,
    /// The places that get what runs off at its start and at its end.
    pub(super) ends: [Option<usize>; 2],
    /// Whether a full place holds up a piece at one of the ends.
    pub(super) is_jammed: bool,
}

/// A gripper.
#[derive(Clone, Debug)]
pub(super) struct Holder {
    pub(super) name: String,
    /// The place that it reaches at present.
    pub(super) over: Option<usize>,
}

/// A piece and where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedPiece {
    pub(super) piece: Piece,
    pub(super) whereabouts: At,
}

/// Where a piece is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum At {
    /// At a place that does not move.
    Spot(usize),
    /// On a belt, its middle this many mm from the start.
    Belt { belt: usize, mm: f64 },
    /// On the seat of a slide.
    Seat(usize),
    /// In a gripper.
    Holder(usize),
    /// In the container with this index.
    Container(usize),
    /// On the ground, out of reach of everything.
    Fallen,
}

/// Why a piece can't be put somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The seat is elsewhere.
    NoSeat,
    /// Another piece is there.
    Taken,
    /// There are as many as there may be.
    TooMany,
}

impl Floor {
    /// Remembers and logs what has gone wrong.
    fn report(&mut self, mishap: Mishap) {
        notice!(Warn, "{mishap}");
        if self.mishaps.len() == MISHAPS_KEPT {
            self.mishaps.pop_front();
        }
        self.mishaps.push_back(mishap);
    }
}
