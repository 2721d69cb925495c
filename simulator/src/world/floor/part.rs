//! What one machine moves on a floor, and what it sees there.

use ft_transfer_area::tx::{Counter, Input, Motor, Output};

use super::hand::{Drives, Hand};
use super::Floor;
use crate::machine::controller::Controller;
use crate::world::board::BoardState;
use crate::world::mishap::Mishap;
use crate::world::plug::Plug;
use crate::world::sensor::Sensor;
use crate::world::shaft::Shaft;

/// What one machine moves on a floor, and what it sees there.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    /// The motors of belts, with the mm that a turn moves them.
    pub(super) belts: Vec<(Plug<Motor>, f64, usize)>,
    /// The motors of slides that have a seat.
    pub(super) seats: Vec<(Plug<Motor>, usize)>,
    pub(super) ejectors: Vec<Pusher>,
    pub(super) hands: Vec<Hand>,
    pub(super) sights: Vec<Sight>,
}

/// An ejector.
#[derive(Clone, Debug)]
pub(super) struct Pusher {
    pub(super) valve: Plug<Output>,
    pub(super) compressor: Option<Plug<Output>>,
    pub(super) from: usize,
    pub(super) to: usize,
    /// Whether it has reported that the other place is taken, since its valve is open.
    pub(super) is_told: bool,
}

/// A sensor that looks at a place.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    pub(super) place: usize,
    pub(super) sense: Sense,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Sense {
    /// A light barrier, with its light when nothing interrupts it.
    Barrier(Plug<Input>, f64),
    /// A light barrier on a counter input.
    Counter(Plug<Counter>),
    /// A colour sensor, with its mV when it sees nothing.
    Colour(Plug<Input>, f64),
}

impl Part {
    /// Moves what the motors and outputs of the machine have moved in this tick.
    pub(super) fn tick(
        &mut self,
        floor: &mut Floor,
        boards: &[BoardState],
        controllers: &[Controller],
    ) {
        let shaft = |motor: Plug<Motor>| {
            boards.get(motor.controller)?.shafts[motor.terminal.index()].as_ref()
        };
        let is_on = |output: Plug<Output>| {
            let controller = controllers.get(output.controller);
            controller.is_some_and(|it| it.outputs.duty[output.terminal.index()] > 0)
        };
        for (motor, seat) in &self.seats {
            if let Some(shaft) = shaft(*motor) {
                floor.seats[*seat].position = shaft.position();
            }
        }
        for (motor, per_turn, belt) in &self.belts {
            let turned = shaft(*motor).map_or(0.0, Shaft::turned);
            if turned != 0.0 {
                floor.run(*belt, turned * per_turn);
            }
        }
        for ejector in &mut self.ejectors {
            let has_pressure = ejector.compressor.is_none_or(is_on);
            ejector.push(is_on(ejector.valve) && has_pressure, floor);
        }
        let drives = Drives {
            slide: &|motor| shaft(motor).map(Shaft::position),
            part: &|motor| shaft(motor).and_then(Shaft::part_of_travel),
            is_on: &is_on,
        };
        for hand in &mut self.hands {
            hand.tick(floor, &drives);
        }
    }

    /// Sets the sensors that look at places.
    pub(super) fn show(
        &self,
        floor: &Floor,
        boards: &mut [BoardState],
        controllers: &mut [Controller],
    ) {
        for Sight { place, sense } in &self.sights {
            match *sense {
                Sense::Barrier(input, clear) => {
                    let bright = if floor.interrupts(*place) { 0.0 } else { clear };
                    if let Some(Sensor::PhotoTransistor { light }) = sensor(boards, input) {
                        *light = bright;
                    }
                }
                Sense::Colour(input, nothing) => {
                    let seen = floor.colour_mv(*place, nothing);
                    if let Some(Sensor::Colour { mv }) = sensor(boards, input) {
                        *mv = seen.round() as u16;
                    }
                }
                Sense::Counter(counter) => {
                    if let Some(controller) = controllers.get_mut(counter.controller) {
                        let is_bright = !floor.interrupts(*place);
                        controller.set_counter_level(counter.terminal, is_bright);
                    }
                }
            }
        }
    }

    /// The place that the sensor on this input looks at.
    pub(super) fn place_seen(&self, input: Plug<Input>) -> Option<usize> {
        let seen = self.sights.iter().find(|sight| match sight.sense {
            Sense::Barrier(plug, _) | Sense::Colour(plug, _) => plug == input,
            Sense::Counter(_) => false,
        });
        seen.map(|sight| sight.place)
    }
}

impl Pusher {
    /// Empties its place, if it has air.
    fn push(&mut self, has_air: bool, floor: &mut Floor) {
        let piece = if has_air { floor.lying(self.from) } else { None };
        self.is_told &= has_air;
        let Some(piece) = piece else { return };
        if floor.put(piece, self.to).is_err() && !self.is_told {
            self.is_told = true;
            let [ejector, place] =
                [self.from, self.to].map(|place| floor.spots[place].name.clone());
            let piece = floor.pieces[piece].piece;
            floor.report(Mishap::JamsAtEjector { piece, ejector, place });
        }
    }
}

fn sensor(boards: &mut [BoardState], input: Plug<Input>) -> Option<&mut Sensor> {
    boards.get_mut(input.controller)?.inputs.get_mut(&input.terminal)
}
