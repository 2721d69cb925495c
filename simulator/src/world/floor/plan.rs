//! The floor of one or several worlds: names become indices.

use std::collections::{HashMap, HashSet};

use super::hand::Hand;
use super::part::{Part, Pusher, Sense, Sight};
use super::{Floor, Holder, Refusal, Run, Seat, Spot, SpotKind, RADIUS};
use crate::world::check::at_motor;
use crate::world::gripper::Gripper;
use crate::world::mistake::{at, expect, Mistake};
use crate::world::motor_model::MotorModel;
use crate::world::place::{Barrier, Place};
use crate::world::script::ScriptAction;
use crate::world::World;

/// A seat is at a place within this part of its slide's travel, unless the place says how near.
const SEAT_REACH: f64 = 0.02;

/// The most places, ejectors and grippers, each. A machine looks at all workpieces for each of them, in each millisecond.
const MOST: usize = 1000;

/// A floor, and what each machine has to do with it.
#[derive(Debug)]
pub(in crate::world) struct Plan {
    pub(super) floor: Floor,
    pub(super) parts: Vec<Part>,
}

/// A mistake, and the index of the world that has it, if it is in one.
type Mistaken = (Option<usize>, Mistake);

impl Plan {
    /// The floor of these worlds, each with its name, with pairs of names for the same place. The worlds' own
    /// values are right.
    pub(in crate::world) fn of(
        worlds: &[(&str, &World)],
        same: &[[String; 2]],
    ) -> Result<Self, Mistaken> {
        let names = Names::of(worlds);
        let mut plan = Self {
            floor: Floor {
                spots: Vec::new(),
                belts: Vec::new(),
                seats: Vec::new(),
                holders: Vec::new(),
                pieces: Vec::new(),
                fallen: 0,
                mishaps: Default::default(),
            },
            parts: vec![Part::default(); worlds.len()],
        };
        for (index, (_, world)) in worlds.iter().enumerate() {
            for (number, place) in world.places.iter().enumerate() {
                at("places", at(number, room(plan.floor.spots.len(), "places")))
                    .map_err(|mistake| (Some(index), mistake))?;
                let kind = plan.kind(index, world, &names, place);
                let name = names.full(index, &place.name);
                plan.floor.spots.push(Spot { name, kind, is_refused: false });
            }
        }
        plan.join(worlds, &names, same).map_err(|mistake| (None, mistake))?;
        for (index, (_, world)) in worlds.iter().enumerate() {
            plan.connect(index, world, &names).map_err(|mistake| (Some(index), mistake))?;
        }
        let mut place = 0;
        for (index, (_, world)) in worlds.iter().enumerate() {
            for (number, declared) in world.places.iter().enumerate() {
                for piece in [declared.piece, declared.content].into_iter().flatten() {
                    let added = plan.floor.add(piece, place);
                    let added = added.map_err(|refusal| Mistake::new(refusal.at_start()));
                    at("places", at(number, at("piece", added)))
                        .map_err(|mistake| (Some(index), mistake))?;
                }
                place += 1;
            }
        }
        Ok(plan)
    }

    /// Makes places the same.
    fn join(
        &mut self,
        worlds: &[(&str, &World)],
        names: &Names<'_>,
        same: &[[String; 2]],
    ) -> Result<(), Mistake> {
        let pieces = worlds.iter().flat_map(|(_, world)| &world.places);
        let is_empty: Vec<bool> = pieces.map(|place| place.piece.is_none()).collect();
        let mut replaced = HashSet::new();
        for (number, pair) in same.iter().enumerate() {
            let find = |which: usize| {
                at("same_places", at(number, at(which, names.find(0, &pair[which]))))
            };
            let (first, second) = (find(0)?, find(1)?);
            let is_free = matches!(self.floor.spots[first].kind, SpotKind::Fixed(place) if place == first)
                && is_empty[first]
                && first != second
                && !replaced.contains(&second);
            let reason = "expected first a place that does not move and has nothing at the start";
            let checked = if is_free { Ok(()) } else { Err(Mistake::new(reason)) };
            at("same_places", at(number, checked))?;
            self.floor.spots[first].kind = self.floor.spots[second].kind;
            replaced.insert(first);
        }
        Ok(())
    }

    /// What a place of this world is on. Belts and seats are noted when their first place comes.
    fn kind(&mut self, index: usize, world: &World, names: &Names<'_>, place: &Place) -> SpotKind {
        let model = place.on.and_then(|motor| Some((motor, world.motor(motor)?)));
        match model {
            Some((motor, MotorModel { slide: Some(slide), .. })) => {
                let known = self.parts[index].seats.iter().find(|(other, _)| *other == motor);
                let seat = known.map(|(_, seat)| *seat).unwrap_or_else(|| {
                    let seat = self.floor.seats.len();
                    let name = names.full(index, &motor.to_string());
                    self.floor.seats.push(Seat { name, position: slide.position });
                    self.parts[index].seats.push((motor, seat));
                    seat
                });
                let reach = place.reach.unwrap_or(SEAT_REACH * slide.travel.length());
                SpotKind::Seat { seat, at: place.at, reach }
            }
            Some((motor, MotorModel { belt: Some(belt), .. })) => {
                let known = self.parts[index].belts.iter().find(|(other, ..)| *other == motor);
                let number = known.map(|(.., number)| *number).unwrap_or_else(|| {
                    let number = self.floor.belts.len();
                    let name = names.full(index, &motor.to_string());
                    let (length, ends) = (belt.length, [None; 2]);
                    self.floor.belts.push(Run { name, length, ends, is_jammed: false });
                    self.parts[index].belts.push((motor, belt.per_turn, number));
                    number
                });
                let reach = place.reach.unwrap_or(RADIUS);
                SpotKind::Belt { belt: number, at: place.at, reach }
            }
            Some((_, MotorModel { slide: None, belt: None, .. })) | None => {
                SpotKind::Fixed(self.floor.spots.len())
            }
        }
    }

    /// Finds the places that the parts of this world name.
    fn connect(&mut self, index: usize, world: &World, names: &Names<'_>) -> Result<(), Mistake> {
        for (motor, _, belt) in &self.parts[index].belts {
            let Some(model) = world.motor(*motor).and_then(|model| model.belt.as_ref()) else {
                continue;
            };
            let find = |key: &str, place: &Option<String>| {
                let found = place.as_ref().map(|place| names.find(index, place)).transpose();
                at_motor(*motor, at("belt", at(key, found)))
            };
            self.floor.belts[*belt].ends = [find("start", &model.start)?, find("end", &model.end)?];
        }
        let before: usize = self.parts.iter().map(|part| part.ejectors.len()).sum();
        let part = &mut self.parts[index];
        for (number, ejector) in world.ejectors.iter().enumerate() {
            at("ejectors", at(number, room(before + number, "ejectors")))?;
            let find = |key: &str, place: &str| {
                at("ejectors", at(number, at(key, names.find(index, place))))
            };
            part.ejectors.push(Pusher {
                valve: ejector.valve,
                compressor: ejector.compressor,
                from: find("from", &ejector.from)?,
                to: find("to", &ejector.to)?,
                is_told: false,
            });
        }
        for (number, gripper) in world.grippers.iter().enumerate() {
            at("grippers", at(number, room(self.floor.holders.len(), "grippers")))?;
            let positions = at("grippers", at(number, names.positions(index, gripper)))?;
            let holder = self.floor.holders.len();
            let name = names.full(index, &gripper.name);
            self.floor.holders.push(Holder { name, over: None });
            part.hands.push(Hand {
                holder,
                axes: gripper.axes.clone(),
                positions,
                tolerance: gripper.tolerance,
                grip: gripper.grip,
                out_at: None,
                is_told: false,
            });
        }
        for (number, event) in world.script.events.iter().enumerate() {
            if let ScriptAction::Put { place, .. } = &event.action {
                let found = at("place", names.find(index, place));
                at("script", at("events", at(number, found)))?;
            }
        }
        part.sights = names.sights(index);
        Ok(())
    }
}

/// Whether there is room for one more than these.
fn room(count: usize, what: &str) -> Result<(), Mistake> {
    expect(count < MOST, || format!("expected at most {MOST} {what} in all"))
}

/// The worlds of a floor, with their names, and the places in them.
struct Names<'a> {
    worlds: &'a [(&'a str, &'a World)],
    /// The index of each world.
    indices: HashMap<&'a str, usize>,
    /// The index of each place, by its world and its name there.
    places: HashMap<(usize, &'a str), usize>,
}

impl<'a> Names<'a> {
    fn of(worlds: &'a [(&'a str, &'a World)]) -> Self {
        let indices = worlds.iter().enumerate().map(|(index, (name, _))| (*name, index));
        let places = worlds.iter().enumerate().flat_map(|(index, (_, world))| {
            world.places.iter().map(move |place| (index, place.name.as_str()))
        });
        Self { worlds, indices: indices.collect(), places: places.zip(0..).collect() }
    }

    /// A name of one of the worlds, as people read it.
    fn full(&self, world: usize, name: &str) -> String {
        match self.worlds {
            [_] => name.to_owned(),
            worlds => format!("{}.{name}", worlds[world].0),
        }
    }

    /// The place with this name in this world, or, with the name of a controller and a dot before it, in
    /// another one.
    fn find(&self, own: usize, name: &str) -> Result<usize, Mistake> {
        let elsewhere = || {
            let (world, name) = name.split_once('.')?;
            self.places.get(&(*self.indices.get(world)?, name))
        };
        let place = self.places.get(&(own, name)).or_else(elsewhere);
        place.copied().ok_or_else(|| self.unknown(own, name))
    }

    fn unknown(&self, own: usize, name: &str) -> Mistake {
        let all = self.worlds.iter().enumerate().flat_map(|(index, (world, plugged))| {
            plugged.places.iter().map(move |place| match index == own {
                true => place.name.clone(),
                false => format!("{world}.{}", place.name),
            })
        });
        let all: Vec<_> = all.collect();
        let known = match &all[..] {
            [] => String::from("this world has none"),
            names => format!("there are {}", names.join(", ")),
        };
        Mistake::new(format!("there is no place {name:?}; {known}"))
    }

    fn positions(&self, own: usize, gripper: &Gripper) -> Result<Vec<(usize, Vec<f64>)>, Mistake> {
        let positions = gripper.positions.iter().enumerate();
        let found = positions.map(|(number, position)| {
            let place = at("place", self.find(own, &position.place));
            Ok((at("positions", at(number, place))?, position.at.clone()))
        });
        found.collect()
    }

    /// The sensors of a world that look at its places.
    fn sights(&self, own: usize) -> Vec<Sight> {
        let world = self.worlds[own].1;
        let places = world.places.iter().filter_map(|declared| {
            Some((*self.places.get(&(own, declared.name.as_str()))?, declared))
        });
        let sights = places.flat_map(|(place, declared)| {
            let barrier = declared.barrier.map(|barrier| match barrier {
                Barrier::Input(input) => {
                    let light = world.sensor(input).map_or(0.0, |sensor| sensor.value().value);
                    Sense::Barrier(input, light / 100.0)
                }
                Barrier::Counter(counter) => Sense::Counter(counter),
            });
            let colour = declared.colour.map(|input| {
                let nothing = world.sensor(input).map_or(0.0, |sensor| sensor.value().value);
                Sense::Colour(input, nothing)
            });
            [barrier, colour].into_iter().flatten().map(move |sense| Sight { place, sense })
        });
        sights.collect()
    }
}

impl Refusal {
    /// Why a piece can't be there at the start.
    fn at_start(self) -> &'static str {
        match self {
            Self::NoSeat => "expected nothing here, because the slide is elsewhere at the start",
            Self::Taken => "expected nothing here, because another piece is in the way",
            Self::TooMany => "expected nothing here, because there are as many as there may be",
        }
    }
}
