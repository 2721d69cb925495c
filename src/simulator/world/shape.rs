//! Which kind of value stands where in the file of a world. A value of another kind is told of in the
//! words of the file, before what the values say is read.

use toml::de::{DeArray, DeTable, DeValue};

use super::check::{at, expect, Checked, Mistake};

const TABLE: &str = "a table is expected, as in [master]";
const SENSOR: &str = "one sensor is expected, as in I1 = { button = {} }";
const VALUES: &str = "what belongs to it is expected in braces, as in { ultrasonic = { cm = 30 } }";
const MOTOR: &str = "a motor is expected, as in M1 = { pulses_per_turn = 63.3 }";
const SLIDE: &str = "a slide is expected, as in slide = { travel = { pulses = 1000 } }";
const TRAVEL: &str = "one length is expected, as in travel = { pulses = 1000 }";

/// Checks the tables and lists of a world.
pub(super) fn check(world: &DeTable<'_>) -> Checked {
    within(world, "master", board)?;
    within(world, "script", |script| {
        let script = table(script, "a table is expected, as in [script]")?;
        within(script, "events", |events| {
            list(events, "a list is expected, as in [[script.events]]").map(drop)
        })
    })?;
    within(world, "remotes", |remotes| {
        list(remotes, "double brackets are expected, as in [[remotes]]").map(drop)
    })?;
    within(world, "extensions", |extensions| {
        let boards = list(extensions, "double brackets are expected, as in [[extensions]]")?;
        let mut boards = boards.iter().enumerate();
        boards.try_for_each(|(number, value)| at(number, board(value.get_ref())))
    })
}

fn board(value: &DeValue<'_>) -> Checked {
    let board = table(value, TABLE)?;
    within(board, "inputs", |inputs| {
        each(table(inputs, "a table is expected, as in [master.inputs]")?, |sensor| {
            one(sensor, SENSOR, |values| table(values, VALUES).map(drop))
        })
    })?;
    within(board, "motors", |motors| {
        each(table(motors, "a table is expected, as in [master.motors.M1]")?, motor)
    })
}

fn motor(value: &DeValue<'_>) -> Checked {
    within(table(value, MOTOR)?, "slide", |slide| {
        within(table(slide, SLIDE)?, "travel", |travel| one(travel, TRAVEL, |_| Ok(())))
    })
}

fn table<'a, 'i>(value: &'a DeValue<'i>, expected: &str) -> Result<&'a DeTable<'i>, Mistake> {
    value.as_table().ok_or_else(|| Mistake::new(expected))
}

fn list<'a, 'i>(value: &'a DeValue<'i>, expected: &str) -> Result<&'a DeArray<'i>, Mistake> {
    value.as_array().ok_or_else(|| Mistake::new(expected))
}

/// Checks a table with a single key.
fn one(value: &DeValue<'_>, expected: &str, check: impl Fn(&DeValue<'_>) -> Checked) -> Checked {
    let table = table(value, expected)?;
    expect(table.len() == 1, || expected.to_owned())?;
    each(table, check)
}

/// Checks every value of a table.
fn each(table: &DeTable<'_>, check: impl Fn(&DeValue<'_>) -> Checked) -> Checked {
    table.iter().try_for_each(|(key, value)| at(key.get_ref(), check(value.get_ref())))
}

/// Checks the value of this key, if it is there.
fn within(table: &DeTable<'_>, name: &str, check: impl FnOnce(&DeValue<'_>) -> Checked) -> Checked {
    let found = table.iter().find(|(key, _)| key.get_ref() == name);
    found.map_or(Ok(()), |(_, value)| at(name, check(value.get_ref())))
}
