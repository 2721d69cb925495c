//! The values of a world file, and this crate's messages for wrong ones.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::RangeInclusive;

use toml::de::{DeTable, DeValue};

use super::mistake::{at, Mistake};

/// What was read, or what is wrong with it. The place of a mistake is relative to the value that was read.
pub(super) type Read<T> = Result<T, Mistake>;

/// The keys of a table.
pub(super) struct Keys<'a, 'i>(&'a DeTable<'i>);

impl<'a, 'i> Keys<'a, 'i> {
    /// The keys of a table. Only the known ones are allowed.
    pub(super) fn of(value: &'a DeValue<'i>, expected: &str, known: &[&str]) -> Read<Self> {
        let table = value.as_table().ok_or_else(|| Mistake::new(expected))?;
        Self::of_table(table, known)
    }

    /// The same for a value that is a table.
    pub(super) fn of_table(table: &'a DeTable<'i>, known: &[&str]) -> Read<Self> {
        for (key, _) in table {
            let name = key.get_ref().as_ref();
            if !known.contains(&name) {
                let reason = format!("there is no such key here; there are {}", known.join(", "));
                return at(name, Err(Mistake::new(reason)));
            }
        }
        Ok(Self(table))
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.value(key).is_some()
    }

    /// The value of a key that may be left out.
    pub(super) fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&DeValue<'_>) -> Read<T>,
    ) -> Read<Option<T>> {
        self.value(key).map(|value| at(key, read(value))).transpose()
    }

    /// The value of a key that may be left out, or its default.
    pub(super) fn or<T>(
        &self,
        key: &str,
        default: T,
        read: impl FnOnce(&DeValue<'_>) -> Read<T>,
    ) -> Read<T> {
        Ok(self.optional(key, read)?.unwrap_or(default))
    }

    /// The value of a required key.
    pub(super) fn required<T>(
        &self,
        key: &str,
        read: impl FnOnce(&DeValue<'_>) -> Read<T>,
    ) -> Read<T> {
        let value = self.optional(key, read)?;
        value.ok_or_else(|| Mistake::new(format!("the key {key} is missing")))
    }

    fn value(&self, key: &str) -> Option<&'a DeValue<'i>> {
        let found = self.0.iter().find(|(known, _)| known.get_ref() == key);
        found.map(|(_, value)| value.get_ref())
    }
}

/// The only key of a table, and its value.
pub(super) fn only<'a>(value: &'a DeValue<'_>, expected: &str) -> Read<(&'a str, &'a DeValue<'a>)> {
    let mut entries = value.as_table().into_iter().flatten();
    match (entries.next(), entries.next()) {
        (Some((key, value)), None) => Ok((key.get_ref().as_ref(), value.get_ref())),
        _ => Err(Mistake::new(expected)),
    }
}

/// A table whose keys are names, such as terminals.
pub(super) fn map<K: Ord, V>(
    value: &DeValue<'_>,
    expected: &str,
    key: impl Fn(&str) -> Read<K>,
    read: impl Fn(&DeValue<'_>) -> Read<V>,
) -> Read<BTreeMap<K, V>> {
    let table = value.as_table().ok_or_else(|| Mistake::new(expected))?;
    let entry = |name: &str, value| Ok((key(name)?, read(value)?));
    let entries = table.iter().map(|(name, value)| (name.get_ref().as_ref(), value.get_ref()));
    entries.map(|(name, value)| at(name, entry(name, value))).collect()
}

/// A list of values of one kind.
pub(super) fn list<T>(
    expected: &str,
    read: impl Fn(&DeValue<'_>) -> Read<T>,
) -> impl FnOnce(&DeValue<'_>) -> Read<Vec<T>> {
    let expected = expected.to_owned();
    move |value| {
        let values = value.as_array().ok_or_else(|| Mistake::new(expected))?;
        let numbered = values.iter().enumerate();
        numbered.map(|(number, value)| at(number, read(value.get_ref()))).collect()
    }
}

pub(super) fn truth(value: &DeValue<'_>) -> Read<bool> {
    value.as_bool().ok_or_else(|| Mistake::new("expected true or false"))
}

pub(super) fn text(value: &DeValue<'_>) -> Read<String> {
    let text = value.as_str().filter(|text| !text.is_empty());
    text.map(str::to_owned).ok_or_else(|| Mistake::new("expected a text, as in \"storage\""))
}

pub(super) fn number(value: &DeValue<'_>) -> Read<f64> {
    let number = match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => integer(value).map(|integer| integer as f64),
    };
    number.ok_or_else(|| Mistake::new("expected a number"))
}

/// A whole number in this range.
pub(super) fn whole<T: TryFrom<i64>>(
    range: RangeInclusive<i64>,
) -> impl Fn(&DeValue<'_>) -> Read<T> {
    move |value| {
        let number = integer(value).filter(|number| range.contains(number));
        let number = number.and_then(|number| T::try_from(number).ok());
        let (least, most) = (range.start(), range.end());
        number
            .ok_or_else(|| Mistake::new(format!("expected a whole number from {least} to {most}")))
    }
}

fn integer(value: &DeValue<'_>) -> Option<i64> {
    let integer = value.as_integer()?;
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// One of these terminals, by its name.
pub(super) fn terminal<T: Copy + Display>(all: &[T], name: &str) -> Read<T> {
    let found = all.iter().find(|terminal| terminal.to_string() == name);
    found.copied().ok_or_else(|| {
        let names: Vec<_> = all.iter().map(T::to_string).collect();
        Mistake::new(format!("there is no {name:?} here; there are {}", names.join(", ")))
    })
}

/// One of these terminals, as a value.
pub(super) fn terminal_value<T: Copy + Display>(
    all: &'static [T],
) -> impl Fn(&DeValue<'_>) -> Read<T> {
    move |value| match value.as_str() {
        Some(name) => terminal(all, name),
        None => Err(Mistake::new(format!("expected a name, as in \"{}\"", all[0]))),
    }
}
