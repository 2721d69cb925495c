//! The worlds that come with the library.

use super::{Factory, World, FACTORY_ONLY};
use crate::error::Error;

/// Name and text of each.
const FILES: [(&str, &str); 8] = [
    ("car", include_str!("../../worlds/car.toml")),
    ("default", include_str!("../../worlds/default.toml")),
    ("everything", include_str!("../../worlds/everything.toml")),
    ("high_bay_warehouse", include_str!("../../worlds/high_bay_warehouse.toml")),
    ("kit", include_str!("../../worlds/kit.toml")),
    ("processing_station", include_str!("../../worlds/processing_station.toml")),
    ("slide", include_str!("../../worlds/slide.toml")),
    ("sorting_line", include_str!("../../worlds/sorting_line.toml")),
];

/// Name and text of the one with several controllers.
const FACTORY: (&str, &str) = ("factory", include_str!("../../worlds/factory.toml"));

const NAMES: [&str; FILES.len()] = {
    let mut names = [""; FILES.len()];
    let mut index = 0;
    while index < FILES.len() {
        names[index] = FILES[index].0;
        index += 1;
    }
    names
};

impl World {
    /// The names of the worlds that come with the library, in alphabetical order.
    /// [`docs/simulator.md`](https://docs.rs/ft-transfer-area/latest/ft_transfer_area/guide/simulator/) describes each of them.
    pub const SHIPPED: &'static [&'static str] = &NAMES;

    /// The world with this name, one of [`SHIPPED`](Self::SHIPPED).
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::World;
    /// use ft_transfer_area_simulator::SimulatedTxt;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let txt = SimulatedTxt::builder().world(World::shipped("car")?).start()?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::World`] with a list of the names, when there is no world with this name.
    pub fn shipped(name: &str) -> Result<Self, Error> {
        if Factory::SHIPPED.contains(&name) {
            let reason = format!("{name} has several controllers, and {FACTORY_ONLY}");
            return Err(Error::World { line: 0, reason });
        }
        Self::shipped_text(name).and_then(Self::from_toml)
    }

    /// The text of the shipped world with this name, also of one with several controllers.
    pub(super) fn shipped_text(name: &str) -> Result<&'static str, Error> {
        let mut all = FILES.iter().chain([&FACTORY]);
        let found = all.find(|(shipped, _)| *shipped == name);
        found.map(|(_, text)| *text).ok_or_else(|| {
            let names = [Self::SHIPPED, Factory::SHIPPED].concat().join(", ");
            let reason = format!("there is no shipped world {name:?}; there are {names}");
            Error::World { line: 0, reason }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_shipped_world_is_found_by_its_name() {
        for name in World::SHIPPED {
            World::shipped(name).unwrap();
        }
        assert!(World::SHIPPED.is_sorted(), "{:?}", World::SHIPPED);
        for name in Factory::SHIPPED {
            Factory::shipped(name).unwrap();
            let sentence = World::shipped(name).unwrap_err().to_string();
            assert!(sentence.contains("several controllers"), "{sentence}");
        }
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_list_of_names() {
        for wrong in ["Slide", "slide.toml", ""] {
            let sentence = World::shipped(wrong).unwrap_err().to_string();
            assert!(sentence.contains(&format!("{wrong:?}")), "{sentence}");
            for name in World::SHIPPED {
                assert!(sentence.contains(name), "{name} is missing in {sentence}");
            }
        }
    }
}
