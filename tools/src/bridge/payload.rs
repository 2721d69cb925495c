//! What payloads of commands have in them, and the names of modes.

use std::ops::RangeInclusive;

use ft_transfer_area::transfer_area::InputMode;
use ft_transfer_area::tx::Motor;
use ft_transfer_area::FishX1Transfer;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// A payload longer than this is none of the commands.
const PAYLOAD_LIMIT: usize = 4096;

/// The modes of inputs, by the names in payloads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum InputModeName {
    Voltage,
    Resistance,
    Resistance15k,
    Ultrasonic,
}

/// The modes of counters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum CounterModeName {
    Normal,
    Inverted,
}

/// What a pair of outputs is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PairMode {
    Motor,
    Outputs,
}

impl PairMode {
    pub(crate) fn of(area: &FishX1Transfer, motor: Motor) -> Self {
        match area.config.motor[motor.index()] {
            0 => Self::Outputs,
            _ => Self::Motor,
        }
    }
}

impl CounterModeName {
    pub(crate) fn new(inverted: bool) -> Self {
        if inverted {
            Self::Inverted
        } else {
            Self::Normal
        }
    }
}

impl From<InputModeName> for InputMode {
    fn from(name: InputModeName) -> Self {
        match name {
            InputModeName::Voltage => Self::Voltage,
            InputModeName::Resistance => Self::Resistance,
            InputModeName::Resistance15k => Self::Resistance15k,
            InputModeName::Ultrasonic => Self::Ultrasonic,
        }
    }
}

impl TryFrom<u8> for InputModeName {
    type Error = ();

    fn try_from(mode: u8) -> Result<Self, ()> {
        let names = [Self::Voltage, Self::Resistance, Self::Resistance15k, Self::Ultrasonic];
        names.into_iter().find(|name| u8::from(InputMode::from(*name)) == mode).ok_or(())
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Nothing {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Duty {
    pub(crate) duty: i64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Move {
    pub(crate) duty: i64,
    #[serde(default)]
    pub(crate) distance: Option<i64>,
    #[serde(default)]
    pub(crate) with: Vec<Follower>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Follower {
    pub(crate) motor: String,
    #[serde(default)]
    pub(crate) reverse: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct InputConfig {
    pub(crate) mode: InputModeName,
    pub(crate) digital: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CounterConfig {
    pub(crate) mode: CounterModeName,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PairConfig {
    pub(crate) mode: PairMode,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sound {
    pub(crate) sound: SoundName,
    #[serde(default = "once")]
    pub(crate) repeat: i64,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a sound is a number or a name")]
pub(crate) enum SoundName {
    Number(i64),
    Name(String),
}

fn once() -> i64 {
    1
}

/// Reads a payload; a command without details may have none at all.
pub(crate) fn read<T: DeserializeOwned>(payload: &[u8], form: &str) -> Result<T, String> {
    if payload.len() > PAYLOAD_LIMIT {
        let (length, limit) = (payload.len(), PAYLOAD_LIMIT);
        return Err(format!("the payload has {length} bytes, but at most {limit} are read"));
    }
    let Ok(text) = std::str::from_utf8(payload) else {
        return Err(format!("the payload is no UTF-8 text; send {form}"));
    };
    let text = if text.trim().is_empty() { "{}" } else { text };
    serde_json::from_str(text)
        .map_err(|error| format!("the payload is wrong: {error}; send {form}"))
}

pub(crate) fn in_range<T: TryFrom<i64>>(
    what: &str,
    given: i64,
    range: RangeInclusive<i64>,
) -> Result<T, String> {
    let inside = range.contains(&given).then(|| T::try_from(given).ok()).flatten();
    let (least, most) = (range.start(), range.end());
    inside.ok_or_else(|| format!("the {what} is {given}, but has to be {least} to {most}"))
}
