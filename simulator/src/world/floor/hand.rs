//! What grippers do.

use ft_transfer_area::tx::{Motor, Output};

use super::{At, Floor};
use crate::world::gripper::Grip;
use crate::world::mishap::Mishap;
use crate::world::piece::Piece;
use crate::world::plug::Plug;

/// A gripper with its present state.
#[derive(Clone, Debug)]
pub(super) struct Hand {
    pub(super) holder: usize,
    pub(super) axes: Vec<Plug<Motor>>,
    /// The places that it reaches, each with the positions of the axes.
    pub(super) positions: Vec<(usize, Vec<f64>)>,
    pub(super) tolerance: f64,
    pub(super) grip: Grip,
    /// Where the fork was lifted to when it went out; `None` while it is in.
    pub(super) out_at: Option<f64>,
    /// Whether it has reported why it can't do what it should.
    pub(super) is_told: bool,
}

/// What grippers look at: where slides are, and which outputs are on.
pub(super) struct Drives<'a> {
    pub(super) slide: &'a dyn Fn(Plug<Motor>) -> Option<f64>,
    /// A part of its travel, 0.0..=1.0.
    pub(super) part: &'a dyn Fn(Plug<Motor>) -> Option<f64>,
    pub(super) is_on: &'a dyn Fn(Plug<Output>) -> bool,
}

impl Hand {
    /// Takes or puts down what it should.
    pub(super) fn tick(&mut self, floor: &mut Floor, drives: &Drives<'_>) {
        match self.grip {
            Grip::Vacuum { valve, compressor, lower } => {
                let is_down = lower.is_none_or(drives.is_on);
                floor.holders[self.holder].over = self.place(drives).filter(|_| is_down);
                let has_pressure = compressor.is_none_or(drives.is_on);
                self.suck((drives.is_on)(valve), has_pressure, floor);
            }
            Grip::Fork { motor, lift } => {
                let is_out = (drives.part)(motor).is_some_and(|part| part > 0.5);
                floor.holders[self.holder].over = self.place(drives).filter(|_| is_out);
                let height = self.axes.get(1).and_then(|axis| (drives.slide)(*axis));
                match height.filter(|_| is_out) {
                    Some(height) => self.lift(height, lift, floor),
                    None => (self.out_at, self.is_told) = (None, false),
                }
            }
        }
    }

    /// The place that its axes reach.
    fn place(&self, drives: &Drives<'_>) -> Option<usize> {
        let is_at = |axis: &Plug<Motor>, at: &f64| {
            (drives.slide)(*axis).is_some_and(|slide| (slide - at).abs() <= self.tolerance)
        };
        let mut positions = self.positions.iter();
        let reached =
            positions.find(|(_, at)| self.axes.iter().zip(at).all(|(axis, at)| is_at(axis, at)));
        reached.map(|(place, _)| *place)
    }

    /// A vacuum gripper takes or lets go.
    fn suck(&mut self, is_on: bool, has_pressure: bool, floor: &mut Floor) {
        let over = floor.holders[self.holder].over;
        match (is_on, floor.find(At::Holder(self.holder))) {
            (true, None) if has_pressure => {
                if let Some(place) = over {
                    self.take_disc(place, floor);
                }
            }
            (true, _) => {}
            (false, held) => {
                self.is_told = false;
                if let Some(piece) = held {
                    self.let_go(piece, over, floor);
                }
            }
        }
    }

    /// Takes the workpiece that is at a place, also out of a container.
    fn take_disc(&mut self, place: usize, floor: &mut Floor) {
        let disc = floor.lying(place).and_then(|lying| match floor.pieces[lying].piece {
            Piece::Container => floor.find(At::Container(lying)),
            Piece::White | Piece::Red | Piece::Blue => Some(lying),
        });
        if let Some(disc) = disc {
            floor.pieces[disc].whereabouts = At::Holder(self.holder);
        } else if let Some((other, piece)) = floor.held_over(place).filter(|_| !self.is_told) {
            self.is_told = true;
            let piece = floor.pieces[piece].piece;
            let [gripper, holder] =
                [self.holder, other].map(|holder| floor.holders[holder].name.clone());
            floor.report(Mishap::NotGripped { piece, gripper, holder });
        }
    }

    fn let_go(&self, piece: usize, over: Option<usize>, floor: &mut Floor) {
        let Some(place) = over else {
            let (kind, gripper) =
                (floor.pieces[piece].piece, floor.holders[self.holder].name.clone());
            floor.fall(piece);
            floor.report(Mishap::FallsBesides { piece: kind, gripper });
            return;
        };
        if floor.put(piece, place).is_err() {
            let (kind, place) = (floor.pieces[piece].piece, floor.spots[place].name.clone());
            floor.fall(piece);
            floor.report(Mishap::FallsAt { piece: kind, place });
        }
    }

    /// A fork that is out is at this height; less is higher up.
    fn lift(&mut self, height: f64, lift: f64, floor: &mut Floor) {
        let out_at = *self.out_at.get_or_insert(height);
        let Some(place) = floor.holders[self.holder].over else { return };
        match floor.find(At::Holder(self.holder)) {
            None if height <= out_at - lift => {
                let lying = floor.lying(place);
                let container =
                    lying.filter(|lying| floor.pieces[*lying].piece == Piece::Container);
                if let Some(container) = container {
                    floor.pieces[container].whereabouts = At::Holder(self.holder);
                }
            }
            Some(container) if height >= out_at + lift => {
                if floor.put(container, place).is_err() && !self.is_told {
                    self.is_told = true;
                    let gripper = floor.holders[self.holder].name.clone();
                    let place = floor.spots[place].name.clone();
                    floor.report(Mishap::NotPutDown { gripper, place });
                }
            }
            None | Some(_) => {}
        }
    }
}
