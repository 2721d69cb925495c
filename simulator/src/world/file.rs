//! Worlds in TOML.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::ops::Range;
use std::path::Path;

use toml::de::{DeTable, DeValue};
use toml::Spanned;

use super::read::Read;
use super::World;
use crate::error::Error;

impl World {
    /// Reads a world from the text of a TOML file. [`docs/simulator.md`](https://docs.rs/ft-transfer-area/latest/ft_transfer_area/guide/simulator/) has every
    /// key.
    ///
    /// # Errors
    ///
    /// [`Error::World`] with the line that is wrong and what was expected there.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        parse(text, |table| {
            let world = Self::read(table)?;
            world.find_mistake_alone().map(|()| world)
        })
    }

    /// Reads a world from a TOML file.
    ///
    /// # Errors
    ///
    /// [`Error::WorldNotRead`] when the file can't be read, and [`Error::World`] with the line that is
    /// wrong and what was expected there.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::from_toml(&read(path.as_ref())?)
    }

    /// Checks a world that was built in code, and so has no lines.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.find_mistake_alone()
            .map_err(|mistake| Error::World { line: 0, reason: mistake.sentence() })
    }
}

/// Reads a text with this function. A mistake gets its line.
pub(super) fn parse<T>(text: &str, read: impl FnOnce(&DeTable<'_>) -> Read<T>) -> Result<T, Error> {
    let table = DeTable::parse(text).map_err(|error| misread(text, &error))?;
    read(table.get_ref()).map_err(|mistake| Error::World {
        line: line_at(text.as_bytes(), start_of(table, &mistake.place)),
        reason: mistake.sentence(),
    })
}

/// No world is longer: that of a factory has a few thousand bytes.
const LONGEST: u64 = 4 << 20;

/// The text of a file.
pub(super) fn read(path: &Path) -> Result<String, Error> {
    let bytes = bytes(path)
        .map_err(|error| Error::WorldNotRead { path: path.to_owned(), cause: error.into() })?;
    String::from_utf8(bytes).map_err(|error| Error::World {
        line: line_at(error.as_bytes(), error.utf8_error().valid_up_to()),
        reason: String::from("text in UTF-8 is expected; save the file with that encoding"),
    })
}

/// What is in a file. A device may have no end, and a pipe may never have one, so both are refused before they are
/// opened.
fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let refused = |why| Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    let found = fs::metadata(path)?;
    if found.is_dir() {
        return refused("it is a folder");
    }
    if !found.is_file() {
        return refused("it is a device or a pipe, and a file is expected");
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(LONGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST {
        return refused("it is larger than any world");
    }
    Ok(bytes)
}

/// The error for a text that is not TOML: the parser's message on one line.
fn misread(text: &str, error: &toml::de::Error) -> Error {
    let line = error.span().map_or(1, |span| line_at(text.as_bytes(), span.start));
    let reason = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
    Error::World { line, reason }
}

/// Where the value at this place begins in the text, or, if it is missing, the table around it.
fn start_of(table: Spanned<DeTable<'_>>, place: &[String]) -> usize {
    let root = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
    let (mut value, mut span) = (&root, 0..0);
    for name in place {
        let Some((next, at)) = step_into(value.get_ref(), name) else { break };
        (value, span) = (next, at);
    }
    span.start
}

/// The value with this name or number, or the string itself, and its position: its key's, if it has one.
fn step_into<'a, 'i>(
    value: &'a DeValue<'i>,
    name: &str,
) -> Option<(&'a Spanned<DeValue<'i>>, Range<usize>)> {
    match value {
        DeValue::Table(table) => {
            let (key, value) = table.iter().find(|(key, _)| key.get_ref() == name)?;
            Some((value, key.span()))
        }
        DeValue::Array(values) => {
            let numbered = name.parse::<usize>().ok().and_then(|number| values.get(number));
            let named = || values.iter().find(|value| value.get_ref().as_str() == Some(name));
            let value = numbered.or_else(named)?;
            Some((value, value.span()))
        }
        _ => None,
    }
}

/// The line of the byte with this index, counted from 1.
fn line_at(text: &[u8], index: usize) -> usize {
    1 + text.iter().take(index).filter(|byte| **byte == b'\n').count()
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::tx::Input;

    use super::*;
    use crate::world::{Factory, Sensor};

    const SLIDE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/worlds/slide.toml"));

    /// Line and reason of the mistake in this text. A factory with one controller has the same ones.
    fn mistake(text: &str) -> (usize, String) {
        let world = World::from_toml(text);
        if !text.contains("controllers]]") {
            assert_eq!(Factory::from_toml(text).err(), world.clone().err());
        }
        match world {
            Err(Error::World { line, reason }) => (line, reason),
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn the_world_with_everything_has_all_keys() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/worlds/everything.toml");
        let world = World::load(path).unwrap();
        let count = (world.master.inputs.len(), world.master.motors.len(), world.extensions.len());
        assert_eq!((count, world.remotes.len()), ((8, 4, 1), 2));
        assert_eq!((world.script.events.len(), world.script.period), (6, Some(10.0)));
        assert_eq!((world.places.len(), world.ejectors.len(), world.grippers.len()), (4, 1, 2));
    }

    #[test]
    fn mistakes_are_reported_with_their_line_in_one_sentence() {
        let slide = "\n[master.motors.M1]\npulses_per_turn = 10\n[master.motors.M1.slide]\n";
        for (text, line, expected) in [
            // For a text that is not TOML the words are the parser's.
            ("[master\n", 1, ""),
            ("\n[[controllers]]\nname = \"a\"", 2, "controllers: there are several controllers, and only"),
            ("\n\n[boss]\n", 3, "boss: there is no such key here; there are master, extensions"),
            ("[master.inputs]\n\nI9 = { resistor = { ohms = 1 } }", 3, "there is no \"I9\" here; there are I1, I2"),
            ("[master.inputs]\nI1 = { resistor = { ohm = 1 } }", 2, "master.inputs.I1.resistor.ohm: there is no such key here; there are ohms"),
            ("[master.inputs]\nI1 = { resistor = { ohms = -1 } }", 2, "expected a whole number"),
            ("[master.inputs]\nI1 = { heater = {} }", 2, "there is no such sensor; there are switch"),
            ("[master.inputs]\nI1 = { voltage = {} }", 2, "the key mv is missing"),
            ("[master.inputs]\nI1 = { ntc = { celsius = 900 } }", 2, "-50 to 150"),
            ("[master.inputs]\n\nI1.ntc.celsius = nan", 3, "-50 to 150"),
            ("[master.inputs]\nI1 = { photo_transistor = { light = 2 } }", 2, "0 to 1"),
            ("[master.inputs]\nI1 = { ultrasonic = { cm = -1 } }", 2, "0 or more"),
            ("[master.motors.M1]\nload = \"heavy\"", 2, "expected a number"),
            ("[master]\nlamps = []\nlamps = []", 3, ""),
            ("master = 5", 1, "expected a table, as in [master]"),
            ("[[master]]\nlamps = []", 1, "expected a table, as in [master]"),
            ("\n[extensions]\nlamps = []", 2, "expected double brackets, as in [[extensions]]"),
            ("[remotes]\ndip1 = true", 1, "expected double brackets, as in [[remotes]]"),
            ("script = []", 1, "as in [script]"),
            ("[script]\nevents = {}", 2, "as in [[script.events]]"),
            ("[script]\nevents = [1]", 2, "expected an event, as in { at = 1,"),
            ("remotes = [\"1\"]", 1, "expected a remote, as in { dip1 = true }"),
            (&format!("{slide}travel.pulses = 9\nseen_by = \"I4\""), 6, "as in { input = \"I4\""),
            ("[master]\ninputs = [\"I1\"]", 2, "as in [master.inputs]"),
            ("[master.inputs]\nI1 = {}", 2, "expected one sensor, as in I1 = { button = {} }"),
            ("[master.inputs]\nI1 = \"button\"", 2, "expected one sensor"),
            ("[[extensions]]\n[[extensions]]\ninputs.I1 = 5", 3, "expected one sensor"),
            ("[master.inputs]\nI1 = { button = {}, switch = {} }", 2, "expected one sensor"),
            ("[master.inputs]\n\nI1 = { ultrasonic = 30 }", 3, "{ ultrasonic = { cm = 30 } }"),
            ("[master.inputs]\nI1 = { button = { pressed = \"yes\" } }", 2, "expected true or false"),
            ("[master.inputs]\ni1 = { button = {} }", 2, "there is no \"i1\" here; there are I1"),
            ("[master.motors]\nM1 = 3", 2, "expected a motor, as in M1 ="),
            ("[master.motors.M1]\nslide = true", 2, "expected a slide, as in slide ="),
            ("[master.motors.M1.slide]\ntravel = 1000", 2, "as in travel = { pulses = 1000 }"),
            ("[master.motors.M1.slide]\ntravel = {}", 2, "as in travel = { pulses = 1000 }"),
            ("[master.motors.M1]\nload = 0,5", 2, ""),
            ("[master.inputs]\nI1 = button", 2, ""),
            ("[master.inputs]\nI1 = { button = {}", 2, ""),
            ("[master.motors.M1]\n\nload = 1.5", 3, "0 to 1"),
            ("[master.motors.M1]\ntop_speed = 0", 2, "more than 0"),
            ("[master.motors.M1]\ntime_constant = 2", 2, "0 to 1"),
            ("[master.motors.M1]\npulses_per_turn = -3", 2, "more than 0"),
            ("[master]\nmotors.M4 = {}\nlamps = [\n\"O8\",\n\"O1\"]", 4, "M4"),
            (&format!("{slide}travel = {{ pulses = 0 }}"), 5, "more than 0"),
            (&format!("{slide}travel.pulses = 9\nposition = 10"), 6, "0 to 9"),
            (&format!("{slide}travel.pulses = 9\nend_switch = \"I2\""), 6, "a switch on I2"),
            (
                "[master.motors.M1.slide]\ntravel = { pulses = 5 }",
                2,
                "pulses_per_turn of the motor",
            ),
            (
                &format!("{slide}travel.pulses=9\nseen_by={{ input=\"I3\", start_cm=1, end_cm=2 }}"),
                6,
                "an ultrasonic sensor on I3",
            ),
            ("[script]\nevents = [{ controller = -1 }]", 2, "the key at is missing"),
            (
                "[script]\nevents = [{ at = 1, controller = 9, input = \"I1\", pressed = true }]",
                2,
                "controller: expected a whole number from 0 to 8",
            ),
            ("[script]\nperiod = 0", 2, "0.001"),
            (
                "master.inputs.I1.button = {}\n[script]\nperiod=1\n[[script.events]]\nat=0.9996\ninput=\"I1\"\npressed=true",
                5,
                "at least 0.001 less than the period",
            ),
            (
                "master.inputs.I1.button = {}\n[[script.events]]\nat=-1\ninput=\"I1\"\npressed=true",
                3,
                "0 or more",
            ),
            ("[[script.events]]\nat = 1\ninput = \"I1\"\npressed = true", 3, "a button or switch"),
            ("[[remotes]]\n[[remotes]]\ndip1 = true\n[[remotes]]\n", 4, "switch setting"),
            ("[[remotes]]\nleft_x = 16", 2, "remotes.0.left_x: expected a whole number from -15 to 15"),
            ("[[i2c]]\naddress = 128", 2, "i2c.0.address: expected a whole number from 0 to 127"),
            ("[[i2c]]\naddress = 256", 2, "expected a whole number from 0 to 127"),
            ("[[i2c]]\naddress = 1\n[[i2c]]\naddress = 1", 3, "two devices at 0x01"),
            ("[[i2c]]\n", 1, "the key address is missing"),
            (
                "[[i2c]]\naddress=1\nregisters = [{ register = 1, values = [1, -1] }]",
                3,
                "registers.0.values.1: expected a whole number from 0 to 255",
            ),
            ("[script]\nevents = [{ at = 1 }]", 2, "script.events.0: the key input is missing"),
            ("[script]\nevents = [{ at = 1, remote = {}, input = \"I1\" }]", 2, "at, remote"),
            ("[script]\nevents = [{ at = 1, remote = {} }]", 2, "dip1 and dip2 of a remote in this world"),
            (
                "[script]\nevents = [{ at = 1, i2c = { address = 1, register = 0, values = [] } }]",
                2,
                "expected a device of this world, not 0x01",
            ),
            ("[master.motors.M1]\nreversed = 1", 2, "expected true or false"),
            ("[master.motors.M1]\npulses_per_turn = 1\nrun_out = 101", 3, "0 to 100"),
            ("[master.motors.M1]\nrun_out = 5", 2, "it needs pulses_per_turn"),
            ("[master.motors.M1]\nbelt = 5", 2, "expected a belt, as in belt ="),
            ("[master.motors.M1]\nbelt.length = 5", 2, "the key per_turn is missing"),
            ("[master.motors.M1]\nbelt = { length = 0, per_turn = 1 }", 2, "belt.length: expected more than 0, not 0"),
            (&format!("{slide}travel.pulses = 0"), 5, "travel.pulses: expected more than 0, not 0"),
            (&format!("{slide}travel.pulses = 9\n[master.motors.M1.belt]\nlength = 5\nper_turn = 1"), 6, "a belt or a slide"),
            (&format!("{slide}travel.pulses = 9\nswitches = [{{ input = \"I1\", at = 3 }}]"), 6, "a switch on I1"),
            (&format!("{slide}travel.pulses = 9\nswitches = [{{ input = \"I1\", at = 10 }}]"), 6, "0 to 9"),
            (&format!("{slide}travel.pulses = 9\nswitches = [{{ input = \"I1\", at = 1, width = 0 }}]"), 6, "width: expected more than 0, not 0"),
            (&format!("{slide}travel.pulses = 9\nswitches = [{{ input = \"I1\", controller = 2, at = 1 }}]"), 6, "a switch on I1"),
            ("[[places]]\nat = 1", 1, "the key name is missing"),
            ("[[places]]\nname = \"\"", 2, "expected a text"),
            ("[[places]]\nname = \"a\"\n[[places]]\nname = \"a\"", 4, "two places with the name \"a\""),
            ("[[places]]\nname = \"a\"\non = \"M1\"\nat = 1", 3, "expected a belt or a slide on M1"),
            ("[[places]]\nname = \"a\"\non = \"E9.M1\"\nat = 1", 3, "expected E1 to E8 before the dot, not \"E9\""),
            ("[[places]]\nname = \"a\"\non = \"E1.M9\"\nat = 1", 3, "there is no \"M9\" here; there are M1"),
            ("[[places]]\nname = \"a\"\non = \"M1\"", 1, "the key at is missing"),
            ("[[places]]\nname = \"a\"\non = \"M1\"\nat = 50\n[master.motors.M1]\nbelt = { length = 40, per_turn = 9 }", 4, "expected 0 to 40, not 50"),
            ("[[places]]\nname = \"a\"\nbarrier = \"I1\"", 3, "expected a photo_transistor on I1"),
            ("[[places]]\nname = \"a\"\nbarrier = \"C5\"", 3, "there is no \"C5\" here; there are C1"),
            ("[[places]]\nname = \"a\"\nbarrier = \"E1.C1\"", 3, "there is no E1.C1 in this world"),
            ("[[places]]\nname = \"a\"\nbarrier = \"C1\"\n[master.motors.M1]\npulses_per_turn = 3", 3, "C1 is used twice"),
            ("[[places]]\nname = \"a\"\ncolour = \"I1\"", 3, "expected a colour on I1"),
            ("[[places]]\nname = \"a\"\npiece = \"green\"", 3, "expected one of \"white\", \"red\""),
            ("[[places]]\nname = \"a\"\npiece = \"red\"\ncontent = \"blue\"", 4, "expected a workpiece in a container"),
            ("[[places]]\nname = \"a\"\non = \"M1\"\nat = 10\npiece = \"red\"\n[[places]]\nname = \"b\"\non = \"M1\"\nat = 20\npiece = \"red\"\n[master.motors.M1]\nbelt = { length = 40, per_turn = 9 }", 10, "another piece is in the way"),
            ("[[places]]\nname = \"a\"\non = \"M1\"\nat = 90\npiece = \"red\"\n[master.motors.M1.slide]\ntravel = { mm = { length = 100, per_turn = 9 } }", 5, "the slide is elsewhere"),
            ("[[places]]\nname = \"a\"\nreach = 0", 3, "reach: expected more than 0, not 0"),
            ("[[places]]\nname = \"a\"\nat = inf", 3, "at: expected a number, not inf"),
            ("[[places]]\nname = \"a\"\ndrawn = 5", 3, "expected two numbers, as in [20, 60]"),
            ("[[places]]\nname = \"a\"\ndrawn = [1, 2, 3]", 3, "expected two numbers"),
            ("[[places]]\nname = \"a\"\ndrawn = [1, 2001]", 3, "places.0.drawn.1: expected 0 to 2000, not 2001"),
            ("[[places]]\nname = \"a\"\non = \"M1\"\nat = 1\ndrawn = [1, 2]\n[master.motors.M1]\nbelt = { length = 40, per_turn = 9 }", 5, "drawn where it is on its motor"),
            ("[master.motors.M1]\ndrawn = [1, 2]", 2, "expected a table, as in drawn = { from ="),
            ("[master.motors.M1]\ndrawn.to = [1, 2]", 2, "the key from is missing"),
            ("[master.motors.M1]\ndrawn = { from = [-1, 2] }", 2, "drawn.from.0: expected 0 to 2000, not -1"),
            ("[master.motors.M1]\n\ndrawn = { from = [1, 2], turn = 90 }", 3, "drawn.turn: it needs a slide"),
            (&format!("{slide}travel.pulses = 9\n[master.motors.M1.drawn]\nfrom = [1, 2]\nto = [1, 3]\nturn = 361"), 9, "-360 to 360"),
            (&format!("{slide}travel.pulses = 9\n[master.motors.M1.drawn]\nfrom = [1, 2]"), 6, "to: expected another point than from"),
            ("[[ejectors]]\nvalve = \"O1\"\nfrom = \"a\"", 1, "the key to is missing"),
            ("[[ejectors]]\nvalve = \"O1\"\nfrom = \"a\"\nto = \"b\"", 3, "there is no place \"a\"; this world has none"),
            ("[[places]]\nname = \"b\"\n[[ejectors]]\nvalve = \"O1\"\nfrom = \"a\"\nto = \"b\"", 5, "there is no place \"a\"; there are b"),
            ("[[ejectors]]\nvalve = \"O8\"\nfrom = \"a\"\nto = \"b\"\n[master.motors.M4]", 2, "O8 is a terminal of the motor on M4"),
            ("[[ejectors]]\nvalve = \"E1.O8\"\nfrom = \"a\"\nto = \"b\"", 2, "there is no E1.O8 in this world"),
            ("[[grippers]]\nname = \"g\"\naxes = [\"M1\"]", 1, "expected either the key vacuum or the key fork"),
            ("[[grippers]]\nname = \"g\"\naxes = []\nvacuum = { valve = \"O1\" }", 3, "expected at least 1, not 0"),
            ("[[grippers]]\nname = \"g\"\naxes = [\"M1\"]\nvacuum = { valve = \"O1\" }", 3, "expected a motor with a slide on M1"),
            (&format!("{slide}travel.pulses = 9\n[[grippers]]\nname = \"g\"\naxes = [\"M1\"]\nvacuum.valve = \"O8\"\npositions = [{{ place = \"a\", at = [1, 2] }}]"), 10, "expected a number for each of the 1 axes, not 2"),
            (&format!("{slide}travel.pulses = 9\n[[grippers]]\nname = \"g\"\naxes = [\"M1\"]\nvacuum.valve = \"O8\"\npositions = [{{ place = \"a\", at = [1] }}]"), 10, "there is no place \"a\""),
            ("[script]\nevents = [{ at = 1, piece = \"red\", place = \"a\" }]", 2, "there is no place \"a\""),
            ("[script]\nevents = [{ at = 1, piece = \"red\" }]", 2, "the key place is missing"),
            ("[script]\nevents = [{ at = 1, input = \"I1\", sensor = { voltage = { mv = 1 } } }]", 2, "expected a sensor of the kind voltage on I1"),
            ("master.inputs.I1.photo_transistor.light = 1\n[[places]]\nname = \"a\"\nbarrier = \"I1\"\n[[script.events]]\nat = 1\ninput = \"I1\"\nsensor.photo_transistor.light = 0", 7, "I1 is set by what is at a"),
            ("master.inputs.I1.button.contact = \"open\"", 1, "\"normally_open\" or"),
            ("master.motors.M1.slide.travel.cm = 5", 1, "there are pulses, mm"),
            ("master.lamps = [\"M1\"]", 1, "master.lamps.0: there is no \"M1\" here; there are O1"),
            ("master.lamps = [1]", 1, "expected a name, as in \"O1\""),
            ("master.lamps.O1 = \"pink\"", 1, "expected one of \"red\", \"yellow\""),
            ("master.lamps = \"O1\"", 1, "or a table with colours"),
        ] {
            let (found, reason) = mistake(text);
            assert!(reason.contains(expected), "{text}\n{found}: {reason}");
            assert_eq!(found, line, "{text}\n{reason}");
            assert!(!reason.is_empty() && !reason.contains('\n'), "{reason}");
        }
        assert_eq!(mistake(&"[[extensions]]\n".repeat(9)).0, 9);
        assert!(mistake("\"a\\nb\" = 1").1.starts_with("a\\nb: there is no such key"));
    }

    #[test]
    fn too_many_places_are_a_mistake_in_one_world_and_in_several() {
        let places = |count: usize, key: &str| -> String {
            (0..count).map(|number| format!("[[{key}]]\nname = \"p{number}\"\n")).collect()
        };
        World::from_toml(&places(1000, "places")).unwrap();
        let (line, reason) = mistake(&places(60_000, "places"));
        assert_eq!((line, &*reason), (2001, "places.1000: expected at most 1000 places in all"));

        let part = |name| {
            format!("[[controllers]]\nname = \"{name}\"\n{}", places(501, "controllers.places"))
        };
        let several = Factory::from_toml(&[part("a"), part("b")].concat()).unwrap_err();
        assert!(
            several.to_string().contains("controllers.1.places.499: expected at most 1000"),
            "{several}"
        );
    }

    #[test]
    fn too_many_ejectors_and_grippers_are_a_mistake() {
        let place = "[[places]]\nname = \"p\"\n[[places]]\nname = \"q\"\n";
        let ejector = "[[ejectors]]\nvalve = \"O5\"\nfrom = \"p\"\nto = \"q\"\n";
        let ejectors = |count| [place, &ejector.repeat(count)].concat();
        World::from_toml(&ejectors(1000)).unwrap();
        let reason = mistake(&ejectors(1001)).1;
        assert_eq!(reason, "ejectors.1000: expected at most 1000 ejectors in all");
        let gripper = |number| {
            format!("[[grippers]]\nname = \"g{number}\"\naxes = [\"M1\"]\nvacuum = {{ valve = \"O5\" }}\n")
        };
        let slide =
            "[master.motors.M1]\npulses_per_turn = 63\nslide = { travel = { pulses = 1000 } }\n";
        let grippers = |count| -> String {
            std::iter::once(slide.to_owned()).chain((0..count).map(gripper)).collect()
        };
        let reason = mistake(&grippers(1001)).1;
        assert_eq!(reason, "grippers.1000: expected at most 1000 grippers in all");
    }

    #[test]
    fn a_name_has_a_limit() {
        let named = |name: &str| {
            let name = format!("{name:?}");
            let slide =
                "[master.motors.M1.slide]\ntravel = { mm = { length = 120, per_turn = 4.5 } }\n";
            let gripper = "axes = [\"M1\"]\nvacuum = { valve = \"O5\" }";
            [
                World::from_toml(&format!("[[places]]\nname = {name}")).map(drop),
                World::from_toml(&format!("{slide}[[grippers]]\nname = {name}\n{gripper}"))
                    .map(drop),
                Factory::from_toml(&format!("[[controllers]]\nname = {name}")).map(drop),
            ]
        };
        for right in named(&"n".repeat(100)) {
            right.unwrap();
        }
        for wrong in ["n".repeat(101), String::from("two\nlines")] {
            for error in named(&wrong) {
                let error = error.unwrap_err().to_string();
                assert!(error.contains("0.name: expected a name of at most 100 bytes"), "{error}");
            }
        }
    }

    #[test]
    fn numbers_are_read_in_each_of_their_forms() {
        for (text, ohms) in [("0x1F", 31), ("1_000", 1000), ("+5", 5), ("0b11", 3), ("0o17", 15)] {
            let text = format!("master.inputs.I1.resistor.ohms = {text}");
            let world = World::from_toml(&text).unwrap();
            assert_eq!(world.master.inputs[&Input::I1], Sensor::Resistor { ohms });
        }
        for (text, cm) in [("5", 5.0), ("5.5", 5.5), ("1e2", 100.0), ("1_0.0", 10.0)] {
            let text = format!("master.inputs.I1.ultrasonic.cm = {text}");
            let world = World::from_toml(&text).unwrap();
            assert_eq!(world.master.inputs[&Input::I1], Sensor::Ultrasonic { cm });
        }
        for text in ["1.0", "4294967296", "99999999999999999999", "\"1\""] {
            let (_, reason) = mistake(&format!("master.inputs.I1.resistor.ohms = {text}"));
            assert!(reason.contains("a whole number from 0 to 4294967295"), "{reason}");
        }
    }

    #[test]
    fn every_text_gives_a_world_or_an_error_with_its_line() {
        let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/worlds/everything.toml"));
        let lines = text.lines().count();
        // Each third place, so that it does not take too long.
        for cut in (0..text.len()).step_by(3) {
            let odd = [&text[..cut], &text[cut..], &[&text[..cut], "\0", &text[cut..]].concat()]
                .map(World::from_toml);
            for error in odd.into_iter().filter_map(Result::err) {
                assert!(matches!(error, Error::World { line, .. } if (1..=lines).contains(&line)));
            }
        }
        for nested in ["[", "a=[", "a.", "a={a=", "[a."].map(|part| part.repeat(100_000)) {
            assert!(World::from_toml(&nested).is_err());
        }
    }

    #[test]
    fn one_input_is_not_moved_by_two_things() {
        let text = SLIDE.replace("end_switch = \"I2\"", "end_switch = \"I1\"");
        let (line, reason) = mistake(&text);
        assert!(text.lines().nth(line - 1).unwrap().starts_with("end_switch"), "{line}");
        assert!(reason.contains("I1"), "{reason}");
        let scripted =
            format!("{SLIDE}\n[[script.events]]\nat = 1\ninput = \"I1\"\npressed = true\n");
        assert!(mistake(&scripted).1.contains("slide"));
    }

    #[test]
    fn a_file_in_another_encoding_is_reported_with_its_line() {
        let path = std::env::temp_dir().join(format!("latin-1-{}.toml", std::process::id()));
        fs::write(&path, b"[master]\n# T\xFCr\nlamps = []\n").unwrap();
        let result = World::load(&path);
        fs::remove_file(&path).unwrap();
        let Err(Error::World { line: 2, reason }) = result else { panic!("{result:?}") };
        assert!(reason.contains("UTF-8 is expected"), "{reason}");
    }

    #[test]
    fn only_a_file_of_a_sensible_length_is_read() {
        let sentence = |path: &Path| format!("{:#}", World::load(path).unwrap_err());
        assert!(sentence(&std::env::temp_dir()).contains("it is a folder"));
        // The first has no end.
        if cfg!(unix) {
            for device in ["/dev/zero", "/dev/null"] {
                let said = sentence(Path::new(device));
                assert!(
                    said.contains(device) && said.contains("it is a device or a pipe"),
                    "{said}"
                );
            }
        }
        let path = std::env::temp_dir().join(format!("long-{}.toml", std::process::id()));
        File::create(&path).unwrap().set_len(LONGEST + 1).unwrap();
        let said = sentence(&path);
        fs::remove_file(&path).unwrap();
        assert!(said.contains("it is larger than any world"), "{said}");
    }

    #[test]
    fn a_missing_file_is_reported_by_name() {
        let error = World::load("no/such/world.toml").unwrap_err();
        assert!(matches!(&error, Error::WorldNotRead { .. }));
        assert!(error.to_string().contains("no/such/world.toml"), "{error}");
    }

    #[test]
    fn a_mistake_in_a_world_built_in_code_is_reported_by_its_place() {
        let mut world = World::default();
        for motor in world.master.motors.values_mut() {
            motor.load = -1.0;
        }
        let error = world.check().unwrap_err().to_string();
        assert!(error.contains("master.motors.M1.load"), "{error}");
    }
}
