//! Where pieces are, and how they get from one place to another.

use super::{At, Floor, PlacedPiece, Refusal, SpotKind, RADIUS};
use crate::world::mishap::Mishap;
use crate::world::piece::Piece;

/// How many pieces a script adds to a floor at most. Each belt looks at all of them.
const MOST: usize = 1000;
/// A colour sensor has its full effect within this distance of a workpiece's middle, in mm.
const FULL_COLOUR: f64 = 4.0;
/// The part of this effect for a workpiece that a gripper holds over it, further away than one on a belt. With it blue is
/// above 1550 mV, where programs for the robot of the factory begin to take it for blue, and red is below the 1430 mV of
/// those for the sorting line.
const HELD_COLOUR: f64 = 0.94;

impl Floor {
    /// Adds a piece at a place.
    pub(super) fn add(&mut self, piece: Piece, place: usize) -> Result<(), Refusal> {
        let whereabouts = self.room(piece, place)?;
        let added = PlacedPiece { piece, whereabouts };
        // A script may add pieces forever, so fallen ones make room for new ones.
        let free = self.pieces.iter().position(|known| known.whereabouts == At::Fallen);
        match free {
            Some(free) => self.pieces[free] = added,
            None if self.pieces.len() >= MOST => return Err(Refusal::TooMany),
            None => self.pieces.push(added),
        }
        Ok(())
    }

    /// The piece that is at a place by itself, not held and not in a container.
    pub(super) fn lying(&self, place: usize) -> Option<usize> {
        match self.spots[place].kind {
            SpotKind::Fixed(place) => self.find(At::Spot(place)),
            SpotKind::Seat { seat, .. } if self.is_reached(place) => self.find(At::Seat(seat)),
            SpotKind::Seat { .. } => None,
            SpotKind::Belt { belt, at, reach } => self.nearest(belt, at, reach),
        }
    }

    /// The piece that can be seen at a place: one that is there, or that a gripper holds there.
    pub(super) fn seen(&self, place: usize) -> Option<usize> {
        self.lying(place).or_else(|| self.held_over(place).map(|(_, piece)| piece))
    }

    /// Whether a light barrier at a place is interrupted.
    pub(super) fn interrupts(&self, place: usize) -> bool {
        let on_belt = match self.spots[place].kind {
            SpotKind::Belt { belt, at, .. } => self.nearest(belt, at, RADIUS).is_some(),
            SpotKind::Fixed(_) | SpotKind::Seat { .. } => false,
        };
        on_belt || self.seen(place).is_some()
    }

    /// The mV of a colour sensor at a place, which gives this value when there is nothing.
    pub(super) fn colour_mv(&self, place: usize, nothing: f64) -> f64 {
        let mv = self.colour_seen(place).and_then(|(piece, part)| {
            let mv = self.pieces[piece].piece.colour_mv()?;
            Some(nothing + part * (mv - nothing))
        });
        mv.unwrap_or(nothing)
    }

    /// The piece that a colour sensor sees, and with which part of the full effect.
    fn colour_seen(&self, place: usize) -> Option<(usize, f64)> {
        if let SpotKind::Belt { belt, at, .. } = self.spots[place].kind {
            if let Some(piece) = self.nearest(belt, at, RADIUS) {
                let part = (RADIUS - self.distance(piece, at)) / (RADIUS - FULL_COLOUR);
                return Some((piece, part.clamp(0.0, 1.0)));
            }
        }
        if let Some(piece) = self.lying(place) {
            return Some((piece, 1.0));
        }
        self.held_over(place).map(|(_, piece)| (piece, HELD_COLOUR))
    }

    /// Where a piece would be if it were put here.
    fn room(&self, piece: Piece, place: usize) -> Result<At, Refusal> {
        if !self.is_reached(place) {
            return Err(Refusal::NoSeat);
        }
        if let Some(lying) = self.lying(place) {
            let fits = piece != Piece::Container
                && self.pieces[lying].piece == Piece::Container
                && self.find(At::Container(lying)).is_none();
            return if fits { Ok(At::Container(lying)) } else { Err(Refusal::Taken) };
        }
        match self.spots[place].kind {
            SpotKind::Fixed(place) => Ok(At::Spot(place)),
            SpotKind::Seat { seat, .. } => Ok(At::Seat(seat)),
            SpotKind::Belt { belt, at, .. } => match self.nearest(belt, at, 2.0 * RADIUS) {
                Some(_) => Err(Refusal::Taken),
                None => Ok(At::Belt { belt, mm: at }),
            },
        }
    }

    /// Puts a piece at a place.
    pub(super) fn put(&mut self, piece: usize, place: usize) -> Result<(), Refusal> {
        self.pieces[piece].whereabouts = self.room(self.pieces[piece].piece, place)?;
        Ok(())
    }

    /// A piece falls, with what is in it.
    pub(super) fn fall(&mut self, piece: usize) {
        let content = self.find(At::Container(piece));
        for fallen in [Some(piece), content].into_iter().flatten() {
            self.pieces[fallen].whereabouts = At::Fallen;
            self.fallen += 1;
        }
    }

    /// Whether the seat that a place belongs to, if any, is there.
    pub(super) fn is_reached(&self, place: usize) -> bool {
        match self.spots[place].kind {
            SpotKind::Fixed(_) | SpotKind::Belt { .. } => true,
            SpotKind::Seat { seat, at, reach } => (self.seats[seat].position - at).abs() <= reach,
        }
    }

    /// The piece with exactly these whereabouts, of which there is one at most.
    pub(super) fn find(&self, whereabouts: At) -> Option<usize> {
        self.pieces.iter().position(|piece| piece.whereabouts == whereabouts)
    }

    /// A gripper that holds a piece at this place, and the piece.
    pub(super) fn held_over(&self, place: usize) -> Option<(usize, usize)> {
        let holders = self.holders.iter().enumerate();
        let mut over = holders.filter(|(_, holder)| holder.over == Some(place));
        over.find_map(|(holder, _)| Some((holder, self.find(At::Holder(holder))?)))
    }

    /// The piece on a belt that is nearest to this place of it, nearer than this.
    fn nearest(&self, belt: usize, at: f64, reach: f64) -> Option<usize> {
        let on_belt = (0..self.pieces.len()).filter(|piece| {
            let whereabouts = self.pieces[*piece].whereabouts;
            matches!(whereabouts, At::Belt { belt: other, .. } if other == belt)
        });
        let near = on_belt.filter(|piece| self.distance(*piece, at) < reach);
        near.min_by(|one, other| self.distance(*one, at).total_cmp(&self.distance(*other, at)))
    }

    /// How far a piece on a belt is from this place of it, in mm.
    fn distance(&self, piece: usize, at: f64) -> f64 {
        match self.pieces[piece].whereabouts {
            At::Belt { mm, .. } => (mm - at).abs(),
            At::Spot(_) | At::Seat(_) | At::Holder(_) | At::Container(_) | At::Fallen => {
                f64::INFINITY
            }
        }
    }

    /// A belt moves by this many mm, negative for backwards.
    pub(super) fn run(&mut self, belt: usize, mm: f64) {
        let mut row = Row::of(&self.pieces, belt);
        for piece in 0..self.pieces.len() {
            let Some(before) = self.pieces[piece].on(belt) else { continue };
            let free = row.free_way(&self.pieces, piece, mm.is_sign_positive());
            self.carry(piece, belt, before, mm.clamp(-free, free));
            let moved = self.pieces[piece].on(belt).map(|after| after - before);
            // Its end may lead to the belt itself, past another piece.
            if moved.is_some_and(|moved| moved.abs() > mm.abs() + RADIUS) {
                row = Row::of(&self.pieces, belt);
            }
        }
    }

    /// Moves a piece on a belt by so many mm, for which there is room.
    fn carry(&mut self, piece: usize, belt: usize, before: f64, mm: f64) {
        let after = before + mm;
        let length = self.belts[belt].length;
        if (0.0..=length).contains(&after) {
            self.pieces[piece].whereabouts = At::Belt { belt, mm: after };
            return;
        }
        self.pieces[piece].whereabouts = At::Belt { belt, mm: after.clamp(0.0, length) };
        let Some(place) = self.belts[belt].ends[usize::from(after > length)] else { return };
        let is_put = self.put(piece, place).is_ok();
        if !is_put && !self.belts[belt].is_jammed {
            let (Floor { pieces, spots, belts, .. }, to) = (&*self, place);
            let (piece, motor, place) =
                (pieces[piece].piece, belts[belt].name.clone(), spots[to].name.clone());
            self.report(Mishap::JamsOnBelt { piece, motor, place });
        }
        self.belts[belt].is_jammed = !is_put;
    }
}

impl PlacedPiece {
    /// Where it is on this belt, in mm.
    fn on(&self, belt: usize) -> Option<f64> {
        match self.whereabouts {
            At::Belt { belt: on, mm } if on == belt => Some(mm),
            _ => None,
        }
    }
}

/// The pieces on a belt in their order, in which they stay while it moves: no piece overtakes another one.
struct Row {
    belt: usize,
    pieces: Vec<usize>,
    /// The place of each piece in the row.
    places: Vec<usize>,
}

impl Row {
    fn of(all: &[PlacedPiece], belt: usize) -> Self {
        let on_belt = all.iter().enumerate().filter_map(|(piece, it)| Some((it.on(belt)?, piece)));
        let mut on_belt: Vec<(f64, usize)> = on_belt.collect();
        on_belt.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
        let pieces: Vec<usize> = on_belt.into_iter().map(|(_, piece)| piece).collect();
        let mut places = vec![0; all.len()];
        for (place, piece) in pieces.iter().enumerate() {
            places[*piece] = place;
        }
        Self { belt, pieces, places }
    }

    /// How far a piece can move in this direction until it meets the next one. Some may have left the belt.
    fn free_way(&self, all: &[PlacedPiece], piece: usize, is_forward: bool) -> f64 {
        let place = self.places[piece];
        let ahead_of = |other: usize| {
            let (mm, other) = (all[piece].on(self.belt)?, all[other].on(self.belt)?);
            Some(if is_forward { other - mm } else { mm - other }).filter(|ahead| *ahead > 0.0)
        };
        let next = match is_forward {
            true => self.pieces[place + 1..].iter().find_map(|other| ahead_of(*other)),
            false => self.pieces[..place].iter().rev().find_map(|other| ahead_of(*other)),
        };
        next.map_or(f64::INFINITY, |ahead| (ahead - 2.0 * RADIUS).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::floor::Plan;
    use crate::world::{Place, World};

    #[test]
    fn fallen_pieces_need_no_memory() {
        let world = World::new().place(Place::new("table"));
        let mut floor = Plan::of(&[("", &world)], &[]).unwrap().floor;
        for fallen in 1..=100 {
            floor.add(Piece::Red, 0).unwrap();
            assert_eq!(floor.add(Piece::Blue, 0), Err(Refusal::Taken));
            floor.fall(0);
            assert_eq!((floor.pieces.len(), floor.fallen), (1, fallen));
        }
    }

    #[test]
    fn the_way_is_free_up_to_the_next_piece_on_the_same_belt() {
        // In no order, two at one place, and one between them that is on another belt.
        let places = [(0, 90.0), (0, 10.0), (1, 50.0), (0, 200.0), (0, 90.0), (0, 95.0)];
        let at = |(belt, mm)| PlacedPiece { piece: Piece::Red, whereabouts: At::Belt { belt, mm } };
        let mut all: Vec<_> = places.into_iter().map(at).collect();
        let row = Row::of(&all, 0);
        let free = |all: &[PlacedPiece], is_forward| {
            [0, 1, 3, 4, 5].map(|piece| row.free_way(all, piece, is_forward))
        };
        let (no, far) = (f64::INFINITY, 2.0 * RADIUS);
        assert_eq!(free(&all, true), [0.0, 80.0 - far, no, 0.0, 105.0 - far]);
        assert_eq!(free(&all, false), [80.0 - far, no, 105.0 - far, 80.0 - far, 0.0]);
        // One has left the belt meanwhile, and one has moved.
        all[5].whereabouts = At::Fallen;
        all[3].whereabouts = At::Belt { belt: 0, mm: 190.0 };
        assert_eq!(row.free_way(&all, 0, true), 100.0 - far);
    }

    #[test]
    fn there_are_not_more_pieces_than_a_floor_can_look_at() {
        let world = World::new().place(Place::new("table"));
        let mut floor = Plan::of(&[("", &world)], &[]).unwrap().floor;
        let far = PlacedPiece { piece: Piece::Red, whereabouts: At::Belt { belt: 0, mm: 5e8 } };
        floor.pieces = vec![far; MOST];
        assert_eq!(floor.add(Piece::Red, 0), Err(Refusal::TooMany));
        floor.fall(7);
        floor.add(Piece::Red, 0).unwrap();
    }
}
