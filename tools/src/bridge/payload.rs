//! What payloads of commands have in them.

use ft_transfer_area::transfer_area::{CounterMode, InputMode};
use serde::de::DeserializeOwned;
use serde::Deserialize;

use crate::commands::{names, Pair};

/// A payload longer than this is none of the commands.
const PAYLOAD_LIMIT: usize = 4096;

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
    pub(crate) distance: Option<u32>,
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
    #[serde(deserialize_with = "names::input_mode")]
    pub(crate) mode: InputMode,
    pub(crate) digital: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CounterConfig {
    #[serde(deserialize_with = "names::counter_mode")]
    pub(crate) mode: CounterMode,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PairConfig {
    pub(crate) mode: Pair,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sound {
    pub(crate) sound: SoundName,
    #[serde(default = "once")]
    pub(crate) repeat: u16,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a sound is a number or a name")]
pub(crate) enum SoundName {
    Number(i64),
    Name(String),
}

fn once() -> u16 {
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
