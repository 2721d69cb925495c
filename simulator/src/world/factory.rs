//! Several controllers and the workpieces that go between them.

use std::collections::BTreeSet;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use super::file;
use super::floor::{OwnFloor, Plan};
use super::mistake::{at, expect, short, Checked, Mistake};
use super::read::{list, text, Keys, Read};
use super::script::Script;
use super::World;
use crate::error::Error;
use crate::machine::Machine;

/// How many controllers a factory may have.
const MOST: usize = 1000;
const CONTROLLERS: &str = "expected double brackets, as in [[controllers]]";
const CONTROLLER: &str =
    "expected a controller, as in { name = \"sorting\", world = \"sorting_line\" }";
const SAME_PLACES: &str =
    "expected pairs of places, as in same_places = [[\"sorting.exit\", \"robot.table\"]]";

/// Several controllers, each with its world, and the workpieces that go between them.
///
/// A name of a place is first looked for in a controller's own world. With the name of a controller and
/// a dot before it, as in `sorting.entry`, it is a place of that one. So belts and grippers bring
/// workpieces to the places of other controllers.
///
/// [`SimulatedFactory`](crate::SimulatedFactory) starts a simulated TXT for each controller;
/// [`machines`](Self::machines) has machines for a test to step.
///
/// ```
/// use ft_transfer_area_simulator::world::Factory;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let factory = Factory::shipped("factory")?;
/// let names: Vec<_> = factory.controllers.iter().map(|(name, _)| name.as_str()).collect();
/// assert_eq!(names, ["warehouse", "robot", "processing", "sorting"]);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Factory {
    /// The controllers, each with its name, 1 to 1000. The names are different and have no dot. A
    /// single controller may have an empty name.
    pub controllers: Vec<(String, World)>,
    /// Pairs of names for the same place. The first of each pair is a place that does not move and has
    /// nothing at the start, such as the one behind the end of a belt.
    pub same_places: Vec<[String; 2]>,
}

impl From<World> for Factory {
    /// A single controller, with an empty name.
    fn from(world: World) -> Self {
        Self::new().controller("", world)
    }
}

impl Factory {
    /// The names of the worlds with several controllers that come with the library.
    pub const SHIPPED: &'static [&'static str] = &["factory"];

    /// A factory without controllers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a controller with its world.
    pub fn controller(mut self, name: &str, world: World) -> Self {
        self.controllers.push((name.to_owned(), world));
        self
    }

    /// Makes two places the same. The first one is a place that does not move and has nothing at the start.
    pub fn same_places(mut self, first: &str, second: &str) -> Self {
        self.same_places.push([first.to_owned(), second.to_owned()]);
        self
    }

    /// The shipped world with this name, one of [`SHIPPED`](Self::SHIPPED) or of [`World::SHIPPED`].
    ///
    /// # Errors
    ///
    /// [`Error::World`] with a list of the names, when there is no world with this name.
    pub fn shipped(name: &str) -> Result<Self, Error> {
        World::shipped_text(name).and_then(Self::from_toml)
    }

    /// Reads a factory, or a world with one controller, from the text of a TOML file.
    ///
    /// # Errors
    ///
    /// [`Error::World`] with the line that is wrong and what was expected there.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        file::parse(text, |table| {
            let factory = Self::read(table)?;
            factory.find_mistake().map(|()| factory)
        })
    }

    /// Reads a factory, or a world with one controller, from a TOML file.
    ///
    /// # Errors
    ///
    /// [`Error::WorldNotRead`] when the file can't be read, and [`Error::World`] with the line that is
    /// wrong and what was expected there.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::from_toml(&file::read(path.as_ref())?)
    }

    /// A machine for each controller, with its name. They share the workpieces; each is stepped by itself.
    ///
    /// # Errors
    ///
    /// [`Error::World`] when a world has a mistake, or their parts don't fit.
    pub fn machines(&self) -> Result<Vec<(String, Machine)>, Error> {
        let floors = self.floors()?;
        let machines = self.controllers.iter().zip(floors).map(|((name, world), floor)| {
            (name.clone(), Machine::on_floor(world.extensions.len(), world, floor))
        });
        Ok(machines.collect())
    }

    /// The floor that the controllers share, once for each.
    pub(crate) fn floors(&self) -> Result<Vec<Option<OwnFloor>>, Error> {
        let checked = self.find_mistake();
        checked.map_err(|mistake| Error::World { line: 0, reason: mistake.sentence() })?;
        let none = || self.controllers.iter().map(|_| None).collect();
        let floors = OwnFloor::of(&self.worlds(), &self.same_places);
        Ok(floors.map_or_else(none, |floors| floors.into_iter().map(Some).collect()))
    }

    fn worlds(&self) -> Vec<(&str, &World)> {
        self.controllers.iter().map(|(name, world)| (name.as_str(), world)).collect()
    }

    fn read(table: &DeTable<'_>) -> Read<Self> {
        if !table.contains_key("controllers") {
            return World::read(table).map(Self::from);
        }
        let keys = Keys::of_table(table, &["controllers", "same_places"])?;
        Ok(Self {
            controllers: keys.required("controllers", controllers)?,
            same_places: keys.or("same_places", Vec::new(), list(SAME_PLACES, pair))?,
        })
    }

    fn find_mistake(&self) -> Checked {
        let mut names = BTreeSet::new();
        let count = self.controllers.len();
        at("controllers", expect(count > 0, || String::from("expected at least one controller")))?;
        at("controllers", expect_not_too_many(count))?;
        for (number, (name, world)) in self.controllers.iter().enumerate() {
            let is_good = count == 1 || !name.is_empty();
            let reason = || format!("expected a name without a dot, not {name:?}");
            let named = short(name).and_then(|()| expect(is_good && !name.contains('.'), reason));
            let named = named.and_then(|()| {
                let reason = || format!("there are two controllers with the name {name:?}");
                expect(names.insert(name), reason)
            });
            let checked = at("name", named).and_then(|()| world.find_mistake());
            checked.map_err(|mistake| self.of_controller(number, mistake))?;
        }
        let plan = Plan::of(&self.worlds(), &self.same_places);
        plan.map(|_| ()).map_err(|(world, mistake)| match world {
            Some(number) => self.of_controller(number, mistake),
            None => mistake,
        })
    }

    /// A mistake in the world of a controller, with its whole place. A world that is no list of controllers has the
    /// keys of its only one.
    fn of_controller(&self, number: usize, mistake: Mistake) -> Mistake {
        match &self.controllers[..] {
            [(name, _)] if name.is_empty() => mistake,
            _ => mistake.within(number).within("controllers"),
        }
    }
}

fn expect_not_too_many(count: usize) -> Checked {
    expect(count <= MOST, || format!("expected at most {MOST} controllers"))
        .map_err(|it| it.within(MOST))
}

/// All controllers. They are counted before they are read, which takes longer.
fn controllers(value: &DeValue<'_>) -> Read<Vec<(String, World)>> {
    expect_not_too_many(value.as_array().map_or(0, |values| values.len()))?;
    list(CONTROLLERS, controller)(value)
}

/// A controller: a shipped world, or the keys of a world.
fn controller(value: &DeValue<'_>) -> Read<(String, World)> {
    let mut known = vec!["name", "world"];
    known.extend(World::KEYS);
    let all = Keys::of(value, CONTROLLER, &known)?;
    let name = all.required("name", text)?;
    let Some(shipped) = all.optional("world", text)? else {
        return Ok((name, World::read_keys(&all)?));
    };
    // Of a shipped world only the script can be replaced.
    let keys = Keys::of(value, CONTROLLER, &["name", "world", "script"])?;
    let text = World::shipped_text(&shipped).ok().filter(|_| World::SHIPPED.contains(&&*shipped));
    let world = text.and_then(|text| World::from_toml(text).ok()).ok_or_else(|| {
        let names = World::SHIPPED.join(", ");
        let reason = format!("there is no shipped world {shipped:?}; there are {names}");
        Mistake::new(reason).within("world")
    })?;
    let script = keys.optional("script", Script::read)?;
    Ok((name, World { script: script.unwrap_or_else(|| world.script.clone()), ..world }))
}

fn pair(value: &DeValue<'_>) -> Read<[String; 2]> {
    let names = list(SAME_PLACES, text)(value)?;
    names.try_into().map_err(|_| Mistake::new(SAME_PLACES))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line and reason of the mistake in this text.
    fn mistake(text: &str) -> (usize, String) {
        match Factory::from_toml(text) {
            Err(Error::World { line, reason }) => (line, reason),
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn mistakes_of_several_controllers_are_reported_with_their_line() {
        let two = "[[controllers]]\nname = \"a\"\n[[controllers.places]]\nname = \"x\"\n[[controllers]]\n";
        for (text, line, expected) in [
            ("controllers = 5", 1, "as in [[controllers]]"),
            ("controllers = []", 1, "expected at least one controller"),
            ("[[controllers]]\nname = \"a\"\n[master]", 3, "there are controllers, same_places"),
            ("[[controllers]]\nworld = \"car\"", 1, "the key name is missing"),
            ("[[controllers]]\nname = \"a.b\"", 2, "a name without a dot, not \"a.b\""),
            ("[[controllers]]\nname = \"a\"\n[[controllers]]\nname = \"a\"", 4, "two controllers with the name \"a\""),
            ("[[controllers]]\nname = \"a\"\nworld = \"cart\"", 3, "there is no shipped world \"cart\"; there are car"),
            ("[[controllers]]\nname = \"a\"\nworld = \"factory\"", 3, "there is no shipped world \"factory\""),
            ("[[controllers]]\nname = \"a\"\nworld = \"car\"\nmaster = {}", 4, "there are name, world, script"),
            ("[[controllers]]\nname = \"a\"\n[controllers.master.inputs]\nI1 = 5", 4, "controllers.0.master.inputs.I1: expected one sensor"),
            (&format!("{two}name = \"b\"\n[[controllers.ejectors]]\nvalve = \"O1\"\nfrom = \"x\"\nto = \"a.x\""), 9, "there is no place \"x\"; there are a.x"),
            (&format!("{two}name = \"b\"\n[[controllers.ejectors]]\nvalve = \"O1\"\nfrom = \"a.x\"\nto = \"c.x\""), 10, "there is no place \"c.x\""),
            (&format!("same_places = [[\"a.x\"]]\n{two}name = \"b\""), 1, "expected pairs of places"),
            (&format!("same_places = [[\"a.x\", \"b.y\"]]\n{two}name = \"b\""), 1, "there is no place \"b.y\""),
            (&format!("same_places = [[\"a.x\", \"a.x\"]]\n{two}name = \"b\""), 1, "expected first a place that does not move"),
        ] {
            let (found, reason) = mistake(text);
            assert!(reason.contains(expected), "{text}\n{found}: {reason}");
            assert_eq!(found, line, "{text}\n{reason}");
            assert!(!reason.contains('\n'), "{reason}");
        }
    }

    #[test]
    fn too_many_controllers_are_a_mistake() {
        let controller =
            |number: usize| format!("[[controllers]]\nname = \"c{number}\"\nworld = \"car\"\n");
        let text: String = (0..60_000).map(controller).collect();
        let (line, reason) = mistake(&text);
        assert_eq!((line, &*reason), (3001, "controllers.1000: expected at most 1000 controllers"));
        let most = (0..1001).fold(Factory::new(), |all, number| {
            all.controller(&format!("c{number}"), World::default())
        });
        assert!(most.machines().unwrap_err().to_string().contains("at most 1000 controllers"));
    }

    #[test]
    fn every_text_gives_a_factory_or_an_error_with_its_line() {
        let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/worlds/factory.toml"));
        let lines = text.lines().count();
        for cut in (0..text.len()).step_by(7) {
            for error in [&text[..cut], &text[cut..]]
                .map(Factory::from_toml)
                .into_iter()
                .filter_map(Result::err)
            {
                assert!(matches!(error, Error::World { line, .. } if (1..=lines).contains(&line)));
            }
        }
    }

    #[test]
    fn a_world_with_one_controller_is_a_factory_too() {
        let factory = Factory::shipped("slide").unwrap();
        assert_eq!(factory, Factory::from(World::shipped("slide").unwrap()));
        let machines = factory.machines().unwrap();
        assert_eq!((machines.len(), machines[0].0.as_str()), (1, ""));
        assert!(Factory::new().machines().unwrap_err().to_string().contains("at least one"));
    }
}
