//! Worlds in TOML.

use std::fs;
use std::ops::Range;
use std::path::Path;

use toml::de::{DeTable, DeValue};
use toml::Spanned;

use super::check::Mistake;
use super::{shape, World};
use crate::error::Error;

impl World {
    /// Reads a world from the text of a TOML file. `docs/simulator.md` in the repository has every
    /// key.
    ///
    /// # Errors
    ///
    /// [`Error::World`] with the line that is wrong and what was expected there.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let mistaken = |mistake: Mistake| Error::World {
            line: line_of(text, &mistake.place),
            reason: mistake.reason,
        };
        let table = DeTable::parse(text).map_err(|error| misread(text, &error))?;
        shape::check(table.get_ref()).map_err(mistaken)?;
        let world: Self = toml::from_str(text).map_err(|error| misread(text, &error))?;
        world.find_mistake().map_err(mistaken)?;
        Ok(world)
    }

    /// Reads a world from a TOML file.
    ///
    /// # Errors
    ///
    /// [`Error::World`] with the line that is wrong and what was expected there; with line 0 when
    /// the file can't be read.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let bytes = fs::read(path).map_err(|error| Error::World {
            line: 0,
            reason: format!("{} can't be read ({error})", path.display()),
        })?;
        let text = std::str::from_utf8(&bytes).map_err(|error| Error::World {
            line: line_at(&bytes, error.valid_up_to()),
            reason: String::from("text in UTF-8 is expected; save the file with that encoding"),
        })?;
        Self::from_toml(text)
    }

    /// Checks a world that was built in code, and so has no lines.
    pub(in crate::simulator) fn check(&self) -> Result<(), Error> {
        self.find_mistake().map_err(|Mistake { place, reason }| {
            let reason = format!("{}: {reason}", place.join("."));
            Error::World { line: 0, reason }
        })
    }
}

fn misread(text: &str, error: &toml::de::Error) -> Error {
    let line = error.span().map_or(1, |span| line_at(text.as_bytes(), span.start));
    let mut reason = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
    for (theirs, ours) in IN_WORDS {
        reason = reason.replace(theirs, ours);
    }
    Error::World { line, reason }
}

/// What the library says of a mistake, in words for somebody who only knows the file.
const IN_WORDS: [(&str, &str); 9] = [
    // This alone does not say what is expected.
    ("duplicate key", "this is there already, and expected only once"),
    ("unknown variant", "unknown name"),
    ("unknown field", "unknown key"),
    ("expected a boolean", "expected true or false"),
    ("expected f64", "expected a number"),
    ("expected i8", "expected a whole number from -15 to 15"),
    ("expected u16", "expected a whole number from 0 to 65535"),
    ("expected u32", "expected a whole number, 0 or more"),
    ("expected usize", "expected a whole number, 0 or more"),
];

/// The line in which the value at this place stands, or what it should stand in.
fn line_of(text: &str, place: &[String]) -> usize {
    let Ok(table) = DeTable::parse(text) else { return 1 };
    let root = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
    let (mut value, mut span) = (&root, 0..0);
    for name in place {
        let Some((next, at)) = step_into(value.get_ref(), name) else { break };
        (value, span) = (next, at);
    }
    line_at(text.as_bytes(), span.start)
}

/// The value of this name or number, or the string itself, and where it is: at its key, if it has one.
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
    use super::*;

    const SLIDE: &str =
        include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/worlds/slide.toml"));

    /// Line and reason of the mistake in this text.
    fn mistake(text: &str) -> (usize, String) {
        match World::from_toml(text) {
            Err(Error::World { line, reason }) => (line, reason),
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn the_shipped_world_is_the_default() {
        assert_eq!(World::from_toml(SLIDE), Ok(World::default()));
    }

    #[test]
    fn the_world_with_everything_has_it_all() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/worlds/everything.toml");
        let world = World::load(path).unwrap();
        let count = (world.master.inputs.len(), world.master.motors.len(), world.extensions.len());
        assert_eq!((count, world.remotes.len()), ((8, 3, 1), 2));
        assert_eq!((world.script.events.len(), world.script.period), (2, Some(10.0)));
    }

    #[test]
    fn mistakes_are_told_with_their_line_in_one_sentence() {
        let slide = "\n[master.motors.M1]\npulses_per_turn = 10\n[master.motors.M1.slide]\n";
        for (text, line, expected) in [
            ("[master\n", 1, "expected"),
            ("\n\n[boss]\n", 3, "unknown key `boss`, expected one of `master`"),
            ("[master.inputs]\n\nI9 = { resistor = { ohms = 1 } }", 3, "unknown name `I9`"),
            ("[master.inputs]\nI1 = { resistor = { ohm = 1 } }", 2, "available keys: ohms"),
            ("[master.inputs]\nI1 = { resistor = { ohms = -1 } }", 2, "expected a whole number"),
            ("[master.inputs]\nI1 = { heater = {} }", 2, "unknown name `heater`"),
            ("[master.inputs]\nI1 = { voltage = {} }", 2, "missing field `mv`"),
            ("[master.inputs]\nI1 = { ntc = { celsius = 900 } }", 2, "-50 to 150"),
            ("[master.inputs]\n\nI1.ntc.celsius = nan", 3, "-50 to 150"),
            ("[master.inputs]\nI1 = { photo_transistor = { light = 2 } }", 2, "0 to 1"),
            ("[master.inputs]\nI1 = { ultrasonic = { cm = -1 } }", 2, "0 or more"),
            ("[master.motors.M1]\nload = \"heavy\"", 2, "expected a number"),
            ("[master]\nlamps = []\nlamps = []", 3, "expected only once"),
            ("master = 5", 1, "a table is expected, as in [master]"),
            ("[[master]]\nlamps = []", 1, "a table is expected, as in [master]"),
            ("\n[extensions]\nlamps = []", 2, "double brackets are expected, as in [[extensions]]"),
            ("[remotes]\ndip1 = true", 1, "double brackets are expected, as in [[remotes]]"),
            ("script = []", 1, "as in [script]"),
            ("[script]\nevents = {}", 2, "as in [[script.events]]"),
            ("[script]\nevents = [1]", 2, "expected an event, as in { at = 1,"),
            ("remotes = [\"1\"]", 1, "expected a remote, as in { dip1 = true }"),
            (&format!("{slide}travel.pulses = 9\nseen_by = \"I4\""), 6, "expected { input = \"I4\""),
            ("[master]\ninputs = [\"I1\"]", 2, "as in [master.inputs]"),
            ("[master.inputs]\nI1 = {}", 2, "one sensor is expected, as in I1 = { button = {} }"),
            ("[master.inputs]\nI1 = \"button\"", 2, "one sensor is expected"),
            ("[[extensions]]\n[[extensions]]\ninputs.I1 = 5", 3, "one sensor is expected"),
            ("[master.inputs]\nI1 = { button = {}, switch = {} }", 2, "one sensor is expected"),
            ("[master.inputs]\n\nI1 = { ultrasonic = 30 }", 3, "{ ultrasonic = { cm = 30 } }"),
            ("[master.inputs]\nI1 = { button = { pressed = \"yes\" } }", 2, "expected true or false"),
            ("[master.inputs]\ni1 = { button = {} }", 2, "expected one of `I1`"),
            ("[master.motors]\nM1 = 3", 2, "a motor is expected, as in M1 ="),
            ("[master.motors.M1]\nslide = true", 2, "a slide is expected, as in slide ="),
            ("[master.motors.M1.slide]\ntravel = 1000", 2, "as in travel = { pulses = 1000 }"),
            ("[master.motors.M1.slide]\ntravel = {}", 2, "as in travel = { pulses = 1000 }"),
            ("[master.motors.M1]\nload = 0,5", 2, "expected newline"),
            ("[master.inputs]\nI1 = button", 2, "must be quoted"),
            ("[master.inputs]\nI1 = { button = {}", 2, "expected `}`"),
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
            ("[script]\nevents = [{ controller = -1 }]", 2, "a whole number, 0 or more"),
            ("[script]\nperiod = 0", 2, "0.001"),
            (
                "master.inputs.I1.button = {}\n[[script.events]]\nat=-1\ninput=\"I1\"\npressed=true",
                3,
                "0 or more",
            ),
            ("[[script.events]]\nat = 1\ninput = \"I1\"\npressed = true", 3, "a button or switch"),
            ("[[remotes]]\n[[remotes]]\ndip1 = true\n[[remotes]]\n", 4, "switch setting"),
            ("[[remotes]]\nleft_x = 16", 2, "-15 to 15"),
        ] {
            let (found, reason) = mistake(text);
            assert!(reason.contains(expected), "{text}\n{found}: {reason}");
            assert_eq!(found, line, "{text}\n{reason}");
            assert!(!reason.contains('\n'), "{reason}");
        }
        assert_eq!(mistake(&"[[extensions]]\n".repeat(9)).0, 9);
    }

    #[test]
    fn no_text_is_too_odd() {
        let text =
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/worlds/everything.toml"));
        let lines = text.lines().count();
        for cut in 0..text.len() {
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
    fn a_file_in_another_encoding_is_told_with_its_line() {
        let path = std::env::temp_dir().join(format!("latin-1-{}.toml", std::process::id()));
        fs::write(&path, b"[master]\n# T\xFCr\nlamps = []\n").unwrap();
        let result = World::load(&path);
        fs::remove_file(&path).unwrap();
        let Err(Error::World { line: 2, reason }) = result else { panic!("{result:?}") };
        assert!(reason.contains("UTF-8 is expected"), "{reason}");
    }

    #[test]
    fn a_file_that_is_not_there_is_told_by_name() {
        let error = World::load("no/such/world.toml").unwrap_err();
        assert!(matches!(&error, Error::World { line: 0, .. }));
        assert!(error.to_string().contains("no/such/world.toml"), "{error}");
    }

    #[test]
    fn a_world_built_in_code_is_told_by_its_place() {
        let mut world = World::default();
        for motor in world.master.motors.values_mut() {
            motor.load = -1.0;
        }
        let error = world.check().unwrap_err().to_string();
        assert!(error.contains("master.motors.M1.load"), "{error}");
    }
}
