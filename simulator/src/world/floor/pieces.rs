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
        for piece in 0..self.pieces.len() {
            if let At::Belt { belt: on, mm: before } = self.pieces[piece].whereabouts {
                if on == belt {
                    self.carry(piece, belt, before, mm);
                }
            }
        }
    }

    /// Moves a piece on a belt as far as it can go.
    fn carry(&mut self, piece: usize, belt: usize, before: f64, mm: f64) {
        let free = self.free_way(piece, belt, before, mm.is_sign_positive());
        let after = before + mm.clamp(-free, free);
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

    /// How far a piece on a belt can move in this direction until it meets the next one.
    fn free_way(&self, piece: usize, belt: usize, mm: f64, is_forward: bool) -> f64 {
        let mut free = f64::INFINITY;
        for (index, other) in self.pieces.iter().enumerate() {
            let At::Belt { belt: on, mm: other } = other.whereabouts else { continue };
            let ahead = if is_forward { other - mm } else { mm - other };
            if on == belt && index != piece && ahead > 0.0 {
                free = free.min((ahead - 2.0 * RADIUS).max(0.0));
            }
        }
        free
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
