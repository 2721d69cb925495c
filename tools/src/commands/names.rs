//! The library's names of modes, in messages.

use ft_transfer_area::transfer_area::{CounterMode, InputMode};
use serde::de::{Deserialize, Deserializer, Error};

pub(crate) fn input_mode<'de, D: Deserializer<'de>>(from: D) -> Result<InputMode, D::Error> {
    named(from, InputMode::ALL, InputMode::name)
}

pub(crate) fn counter_mode<'de, D: Deserializer<'de>>(from: D) -> Result<CounterMode, D::Error> {
    named(from, &CounterMode::ALL, CounterMode::name)
}

fn named<'de, D: Deserializer<'de>, T: Copy>(
    from: D,
    all: &[T],
    name: fn(T) -> &'static str,
) -> Result<T, D::Error> {
    let given = String::deserialize(from)?;
    all.iter().copied().find(|one| name(*one) == given).ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|one| name(*one)).collect();
        D::Error::custom(format!("unknown mode {given:?}, not one of {}", names.join(", ")))
    })
}
