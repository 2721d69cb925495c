//! What payloads of commands have in them. An error names a field as the payload does.

use std::fmt::Display;
use std::ops::RangeInclusive;

use ft_transfer_area::tx::{Motor, Sound, SILENCE};
use serde_json::{Map, Value};

use crate::commands::Follower;
use crate::print::beginning;

/// A payload longer than this is none of the commands.
const PAYLOAD_LIMIT: usize = 4096;

/// How many characters of what came are reported.
const TOLD: usize = 60;

/// The numbers of sounds have two digits: there may be others than those that a TXT is delivered with.
const SOUNDS: RangeInclusive<i64> = 0..=99;

/// The fields of a payload. Each is taken once; at the end none may be left.
pub(crate) struct Fields {
    left: Map<String, Value>,
    /// A right payload.
    form: &'static str,
}

impl Fields {
    /// Of a payload that should look like `form`; one without any text has no fields.
    pub(crate) fn read(payload: &[u8], form: &'static str) -> Result<Self, String> {
        if payload.len() > PAYLOAD_LIMIT {
            let (length, limit) = (payload.len(), PAYLOAD_LIMIT);
            return Err(format!("the payload has {length} bytes, but at most {limit} are read"));
        }
        let Ok(text) = std::str::from_utf8(payload) else {
            return Err(format!("the payload is not UTF-8 text; send {form}"));
        };
        let text = if text.trim().is_empty() { "{}" } else { text };
        match serde_json::from_str(text) {
            Ok(Value::Object(left)) => Ok(Self { left, form }),
            Ok(other) => Err(format!("the payload is {}; send {form}", short(&other))),
            Err(error) => Err(format!("the payload is not JSON ({error}); send {form}")),
        }
    }

    /// A field that has to be there; `wanted` says what it is.
    fn take<T>(
        &mut self,
        name: &str,
        wanted: &str,
        right: impl FnOnce(&Value) -> Option<T>,
    ) -> Result<T, String> {
        let form = self.form;
        self.take_if_there(name, wanted, right)?
            .ok_or_else(|| format!("{name} is missing: {wanted}; send {form}"))
    }

    /// A field that may be missing or `null`.
    fn take_if_there<T>(
        &mut self,
        name: &str,
        wanted: &str,
        right: impl FnOnce(&Value) -> Option<T>,
    ) -> Result<Option<T>, String> {
        match self.left.remove(name) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => match right(&value) {
                Some(taken) => Ok(Some(taken)),
                None => Err(format!("{name} is {wanted}, not {}", short(&value))),
            },
        }
    }

    pub(crate) fn number(&mut self, name: &str, range: RangeInclusive<i64>) -> Result<i64, String> {
        self.take(name, &numbers(&range), |value| in_range(value, &range))
    }

    pub(crate) fn number_if_there(
        &mut self,
        name: &str,
        range: RangeInclusive<i64>,
    ) -> Result<Option<i64>, String> {
        self.take_if_there(name, &numbers(&range), |value| in_range(value, &range))
    }

    pub(crate) fn truth(&mut self, name: &str) -> Result<bool, String> {
        self.take(name, TRUTH, Value::as_bool)
    }

    /// One of several, by their names.
    pub(crate) fn one_of<T: Copy>(
        &mut self,
        name: &str,
        all: &[T],
        name_of: impl Fn(T) -> &'static str,
    ) -> Result<T, String> {
        let names: Vec<_> = all.iter().map(|one| name_of(*one)).collect();
        self.take(name, &names.join(" or "), |value| {
            let given = value.as_str()?;
            all.iter().copied().find(|one| name_of(*one) == given)
        })
    }

    /// A sound by its name or number, as its number.
    pub(crate) fn sound(&mut self) -> Result<i64, String> {
        let right = |value: &Value| match value.as_str() {
            Some(name) => Sound::ALL.iter().find(|sound| sound.name() == name).map(|&s| s.into()),
            None => in_range(value, &SOUNDS),
        };
        self.take("sound", "a sound's name or number", right).map_err(|wrong| {
            let name = |sound: &Sound| format!("{} {}", sound.index(), sound.name());
            let names: Vec<_> = Sound::ALL.iter().map(name).collect();
            let (silence, most) = (SILENCE, SOUNDS.end());
            format!(
                "{wrong}; the sounds are {}; {silence} is silence, and numbers up to {most} are for \
                 sounds of your own",
                names.join(", ")
            )
        })
    }

    /// Motors that turn together with another one.
    pub(crate) fn followers(&mut self) -> Result<Vec<Follower>, String> {
        const WANTED: &str = r#"a list of motors, as [{"motor": "M2", "reverse": true}]"#;
        let form = self.form;
        let list = self.take_if_there("with", WANTED, |value| value.as_array().cloned())?;
        let follower = |one: Value| {
            let Value::Object(left) = one else {
                return Err(format!("with is {WANTED}, but {} is in it", short(&one)));
            };
            let mut fields = Self { left, form };
            let motor =
                fields.take("motor", "M1 to M4", |value| named(&Motor::ALL, value.as_str()?))?;
            let opposite = fields.take_if_there("reverse", TRUTH, Value::as_bool)?;
            fields.end()?;
            Ok(Follower { motor, opposite: opposite.unwrap_or(false) })
        };
        list.unwrap_or_default().into_iter().map(follower).collect()
    }

    /// What is left has a name that nobody knows.
    pub(crate) fn end(self) -> Result<(), String> {
        match self.left.keys().next() {
            None => Ok(()),
            Some(name) => {
                Err(format!("{:?} is not a field of this command; send {}", short(name), self.form))
            }
        }
    }
}

const TRUTH: &str = "true or false";

fn numbers(range: &RangeInclusive<i64>) -> String {
    format!("a whole number from {} to {}", range.start(), range.end())
}

fn in_range(value: &Value, range: &RangeInclusive<i64>) -> Option<i64> {
    value.as_i64().filter(|number| range.contains(number))
}

/// The terminal with this name.
pub(crate) fn named<T: Copy + Display>(all: &[T], name: &str) -> Option<T> {
    all.iter().copied().find(|one| one.to_string() == name)
}

/// The beginning of what came.
pub(crate) fn short(given: &(impl Display + ?Sized)) -> String {
    beginning(&given.to_string(), TOLD).into_owned()
}
