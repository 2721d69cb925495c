//! What is wrong with a world, and where.

use std::fmt::Display;
use std::ops::RangeInclusive;

/// A mistake and its place.
#[derive(Debug)]
pub(super) struct Mistake {
    /// The names and numbers of the keys that lead to the value, the outermost first.
    pub(super) place: Vec<String>,
    /// What was expected.
    reason: String,
}

impl Mistake {
    pub(super) fn new(reason: impl Into<String>) -> Self {
        Self { place: Vec::new(), reason: reason.into() }
    }

    /// What is wrong, with the keys that lead to it.
    pub(super) fn sentence(&self) -> String {
        let Self { place, reason } = self;
        if place.is_empty() {
            return reason.clone();
        }
        // Keys of the file may contain line breaks.
        let place: Vec<_> = place.iter().map(|name| name.escape_debug().to_string()).collect();
        format!("{}: {reason}", place.join("."))
    }

    /// The same mistake, with this name before its place.
    pub(super) fn within(mut self, name: impl Display) -> Self {
        self.place.insert(0, name.to_string());
        self
    }
}

pub(super) type Checked = Result<(), Mistake>;

/// Adds the name to the place of a mistake.
pub(super) fn at<T>(name: impl Display, checked: Result<T, Mistake>) -> Result<T, Mistake> {
    checked.map_err(|mistake| mistake.within(name))
}

/// Checks each value of a list. Its number is part of the place.
pub(super) fn each<T>(name: &str, values: &[T], check: impl Fn(&T) -> Checked) -> Checked {
    let numbered = values.iter().enumerate();
    numbered.into_iter().try_for_each(|(number, value)| at(name, at(number, check(value))))
}

pub(super) fn expect(holds: bool, reason: impl FnOnce() -> String) -> Checked {
    if holds {
        Ok(())
    } else {
        Err(Mistake::new(reason()))
    }
}

/// How long a name may be, in bytes. Pages get all of them again and again.
const LONGEST_NAME: usize = 100;

pub(super) fn short(name: &str) -> Checked {
    expect(name.len() <= LONGEST_NAME && !name.contains(char::is_control), || {
        format!("expected a name of at most {LONGEST_NAME} bytes without control characters")
    })
}

/// Checks that a number is in a range. NaN is in none.
pub(super) fn in_range(name: &str, value: f64, range: RangeInclusive<f64>) -> Checked {
    let (least, most) = (range.start(), range.end());
    at(name, expect(range.contains(&value), || format!("expected {least} to {most}, not {value}")))
}

pub(super) fn not_negative(name: &str, value: f64) -> Checked {
    let right = value >= 0.0 && value.is_finite();
    at(name, expect(right, || format!("expected 0 or more, not {value}")))
}

pub(super) fn positive(name: &str, value: f64, most: f64) -> Checked {
    let right = value > 0.0 && value <= most;
    let limit = if most == f64::MAX { String::new() } else { format!(" and at most {most}") };
    at(name, expect(right, || format!("expected more than 0{limit}, not {value}")))
}

pub(super) fn finite(name: &str, value: f64) -> Checked {
    at(name, expect(value.is_finite(), || format!("expected a number, not {value}")))
}
