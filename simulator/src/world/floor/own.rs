//! The floor as one machine and its program see it.

use std::iter;

use parking_lot::MutexGuard;

use super::{At, Floor, Part, Plan, SharedFloor};
use crate::machine::controller::Controller;
use crate::world::board::BoardState;
use crate::world::mishap::Mishap;
use crate::world::piece::Piece;
use crate::world::plug::Plug;
use crate::world::state::WorldState;
use crate::world::World;

/// The floor of a machine.
#[derive(Clone, Debug)]
pub(crate) struct OwnFloor {
    shared: SharedFloor,
    /// What the machine moves and sees there.
    part: Part,
    /// The name of the machine and a dot, if others share the floor.
    prefix: String,
}

/// The floor of a machine while it is locked.
pub(in crate::world) struct LockedFloor<'a> {
    floor: MutexGuard<'a, Floor>,
    part: &'a mut Part,
    prefix: &'a str,
}

impl OwnFloor {
    /// The floor of a checked world that shares it with no other; `None` for a world without places.
    pub(crate) fn alone(world: &World) -> Option<Self> {
        Self::of(&[("", world)], &[])?.pop()
    }

    /// The floor of these checked worlds, for the machine of each; `None` if they have no places.
    pub(crate) fn of(worlds: &[(&str, &World)], same: &[[String; 2]]) -> Option<Vec<Self>> {
        if worlds.iter().all(|(_, world)| world.places.is_empty()) {
            return None;
        }
        let Plan { floor, parts } = Plan::of(worlds, same).ok()?;
        let shared = SharedFloor::new(floor);
        let prefix = |name: &str| match worlds.len() {
            1 => String::new(),
            _ => format!("{name}."),
        };
        let own = parts.into_iter().zip(worlds);
        let own = own.map(|(part, (name, _))| Self {
            shared: shared.share(),
            part,
            prefix: prefix(name),
        });
        Some(own.collect())
    }

    pub(in crate::world) fn lock(&mut self) -> LockedFloor<'_> {
        let Self { shared, part, prefix } = self;
        LockedFloor { floor: shared.lock(), part, prefix }
    }
}

impl LockedFloor<'_> {
    pub(in crate::world) fn tick(&mut self, boards: &[BoardState], controllers: &[Controller]) {
        self.part.tick(&mut self.floor, boards, controllers);
    }

    pub(in crate::world) fn show(&self, boards: &mut [BoardState], controllers: &mut [Controller]) {
        self.part.show(&self.floor, boards, controllers);
    }

    /// Puts a new piece at a place. Returns whether there is room for it.
    pub(in crate::world) fn add(&mut self, piece: Piece, name: &str) -> bool {
        let place = self.floor.place(self.prefix, name);
        place.is_some_and(|place| self.floor.add(piece, place).is_ok())
    }

    /// Puts a new piece at a place, or logs why it can't, once until the next one that it can take.
    pub(in crate::world) fn add_or_tell(&mut self, piece: Piece, name: &str) {
        let Some(place) = self.floor.place(self.prefix, name) else { return };
        let is_refused = self.floor.add(piece, place).is_err();
        if is_refused && !self.floor.spots[place].is_refused {
            self.floor.report(Mishap::NotPutIn { piece, place: name.to_owned() });
        }
        self.floor.spots[place].is_refused = is_refused;
    }
}

impl Floor {
    /// The place with this name, which may be one of the machine with this prefix.
    fn place(&self, prefix: &str, name: &str) -> Option<usize> {
        let own = self
            .spots
            .iter()
            .position(|spot| spot.name.strip_prefix(prefix).is_some_and(|rest| rest == name));
        own.or_else(|| self.spots.iter().position(|spot| spot.name == name))
    }

    fn whereabouts(&self, piece: usize) -> Whereabouts {
        match self.pieces[piece].whereabouts {
            At::Spot(place) => Whereabouts::Place(self.spots[place].name.clone()),
            At::Belt { belt, mm } => Whereabouts::Belt { motor: self.belts[belt].name.clone(), mm },
            At::Seat(seat) => Whereabouts::Slide(self.seats[seat].name.clone()),
            At::Holder(holder) => Whereabouts::Gripper(self.holders[holder].name.clone()),
            At::Container(container) => {
                let before = self.pieces[..container].iter();
                let shown = before.filter(|piece| piece.whereabouts != At::Fallen).count();
                Whereabouts::Container(shown)
            }
            At::Fallen => Whereabouts::Fallen,
        }
    }
}

/// Where a workpiece is. Names are those of the world; in a [`Factory`](crate::world::Factory) the name of the
/// controller and a dot come before them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Whereabouts {
    /// At the place with this name, which does not move.
    Place(String),
    /// On a belt.
    Belt {
        /// The motor of the belt, such as `M1` or `E1.M1`.
        motor: String,
        /// How far its middle is from the start of the belt, in mm.
        mm: f64,
    },
    /// On the seat of the slide of this motor, such as `M1` or `E1.M1`.
    Slide(String),
    /// In the gripper with this name.
    Gripper(String),
    /// In the container with this index in [`WorldState::pieces`].
    Container(usize),
    /// On the ground.
    Fallen,
}

impl WorldState {
    /// The workpieces and containers, with where they are. Those that have fallen are left out. In a
    /// [`Factory`](crate::world::Factory) these are the pieces of all controllers.
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::{Piece, Place, Whereabouts, World};
    /// use ft_transfer_area_simulator::Machine;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let world = World::new().place(Place::new("storage"));
    /// let mut machine = Machine::with_world(0, world)?;
    /// let world = machine.world_mut().expect("it has one");
    /// assert!(world.put(Piece::Red, "storage"));
    /// assert!(!world.put(Piece::Blue, "storage"), "it is full");
    /// let place = Whereabouts::Place(String::from("storage"));
    /// assert_eq!(world.pieces(), [(Piece::Red, place)]);
    /// # Ok(())
    /// # }
    /// ```
    pub fn pieces(&self) -> Vec<(Piece, Whereabouts)> {
        let Some(own) = &self.floor else { return Vec::new() };
        let floor = own.shared.lock();
        let present =
            (0..floor.pieces.len()).filter(|piece| floor.pieces[*piece].whereabouts != At::Fallen);
        present.map(|piece| (floor.pieces[piece].piece, floor.whereabouts(piece))).collect()
    }

    /// The names of all places, each with what is there: what lies there, not what a gripper holds
    /// there. A place on the seat of a slide that is elsewhere has nothing.
    pub fn places(&self) -> Vec<(String, Option<Piece>)> {
        let Some(own) = &self.floor else { return Vec::new() };
        let floor = own.shared.lock();
        let places = (0..floor.spots.len()).map(|place| {
            let lying = floor.lying(place).map(|piece| floor.pieces[piece].piece);
            (floor.spots[place].name.clone(), lying)
        });
        places.collect()
    }

    /// Whether there is a place with this name. Those of this controller are found without its name, too.
    pub fn has_place(&self, name: &str) -> bool {
        let Some(own) = &self.floor else { return false };
        own.shared.lock().place(&own.prefix, name).is_some()
    }

    /// Puts a new workpiece or container at the place with this name, or a workpiece into the container
    /// there.
    ///
    /// Returns whether there is such a place, and room.
    pub fn put(&mut self, piece: Piece, place: &str) -> bool {
        self.floor.as_mut().is_some_and(|own| own.lock().add(piece, place))
    }

    /// Takes away what is at the place with this name, a container with its content. What is in a gripper
    /// stays.
    ///
    /// Returns what was there.
    pub fn take(&mut self, place: &str) -> Option<Piece> {
        let own = self.floor.as_mut()?.lock();
        let (prefix, mut floor) = (own.prefix, own.floor);
        let lying = floor.place(prefix, place).and_then(|place| floor.lying(place))?;
        let content = floor.find(At::Container(lying));
        for piece in iter::once(lying).chain(content) {
            floor.pieces[piece].whereabouts = At::Fallen;
        }
        Some(floor.pieces[lying].piece)
    }

    /// How many workpieces and containers have fallen since the start.
    pub fn fallen(&self) -> u64 {
        self.floor.as_ref().map_or(0, |own| own.shared.lock().fallen)
    }

    /// What has gone wrong with workpieces: the newest 100 since the start, the oldest
    /// first. Each is logged as a warning, too.
    ///
    /// * A belt or an ejector has brought a piece to a place that can't take it, once until the next one
    ///   that it can take.
    /// * A gripper lets a piece go where there is no place, or where the place can't take it.
    /// * A gripper should take what another one holds, or a fork can't put its container down.
    /// * The script puts a piece where there is no room, once until there is room for one.
    pub fn mishaps(&self) -> Vec<Mishap> {
        let Some(own) = &self.floor else { return Vec::new() };
        let floor = own.shared.lock();
        floor.mishaps.iter().cloned().collect()
    }

    /// The name of the place that the sensor on this input looks at, if it looks at one. The next step
    /// replaces what a program sets there.
    pub fn place_seen(
        &self,
        controller: usize,
        input: ft_transfer_area::tx::Input,
    ) -> Option<String> {
        let own = self.floor.as_ref()?;
        let place = own.part.place_seen(Plug { controller, terminal: input })?;
        Some(own.shared.lock().spots[place].name.clone())
    }
}
