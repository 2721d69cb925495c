//! The commands that a bridge takes: from topic and payload to what they change in the areas.

use std::fmt::Display;

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::{Counter, Input, Motor, Output, Sound};
use ft_transfer_area::{Error, FishX1Transfer};

use super::payload::{self, read};
use super::topics::{HEARTBEAT, STOP};
use crate::commands::{sentence, stop_all, Command, Follower};

/// What a message on a command topic says.
#[derive(Debug, PartialEq)]
pub(crate) enum Received {
    /// The master is alive; nothing else.
    Heartbeat,
    StopAll,
    /// For one of the areas.
    Area(usize, Command),
}

impl Received {
    /// The command of a topic, without prefix and name, and its payload; or what is wrong, as a sentence.
    pub(crate) fn parse(tail: &str, payload: &[u8]) -> Result<Self, String> {
        match tail {
            // Whatever a master likes to send there.
            HEARTBEAT => return Ok(Self::Heartbeat),
            STOP => return nothing(payload).map(|()| Self::StopAll),
            _ => {}
        }
        let (area, place) = split_area(tail)?;
        let (terminal, verb) = place.split_once('/').ok_or_else(|| unknown(place))?;
        let command = parse_command(terminal, verb, payload)?;
        command.check().map_err(explain)?;
        Ok(Self::Area(area, command))
    }

    /// Whether the command may come while the controller is away.
    pub(crate) fn needs_nothing(&self) -> bool {
        match self {
            Self::Heartbeat | Self::StopAll => true,
            Self::Area(..) => false,
        }
    }

    /// Does what the command says; or says why it does nothing.
    pub(crate) fn apply(self, areas: &mut [FishX1Transfer]) -> Result<(), String> {
        match self {
            Self::Heartbeat => Ok(()),
            Self::StopAll => {
                stop_all(areas);
                Ok(())
            }
            Self::Area(index, command) => {
                let extensions = areas.len() - 1;
                let area = areas.get_mut(index).ok_or_else(|| {
                    format!(
                        "there is no extension {index}; the bridge was started for {extensions} \
                         extensions, see --extensions"
                    )
                })?;
                command.apply(area).map_err(explain)
            }
        }
    }
}

/// An error as a sentence, with what to send.
fn explain(error: Error) -> String {
    match error {
        Error::NotAMotor { motor } => {
            let [first, second] = motor.outputs();
            format!(
                "{motor} is the two outputs {first} and {second}; send {{\"mode\": \"motor\"}} to \
                 {motor}/mode, or use {first}/set"
            )
        }
        Error::NotAnOutput { output } => {
            let motor = output.motor();
            let [first, second] = motor.outputs();
            format!(
                "{first} and {second} are the motor {motor}; send {{\"mode\": \"outputs\"}} to \
                 {motor}/mode, or use {motor}/set"
            )
        }
        other => sentence(&other),
    }
}

/// The area that a topic names, and the rest of it.
fn split_area(tail: &str) -> Result<(usize, &str), String> {
    let Some((extension, rest)) = tail.strip_prefix("ext").and_then(|rest| rest.split_once('/'))
    else {
        return Ok((0, tail));
    };
    match extension.parse() {
        Ok(area) if (1..=MAX_EXTENSIONS).contains(&area) => Ok((area, rest)),
        _ => Err(format!("there is no ext{extension}; extensions are ext1 to ext{MAX_EXTENSIONS}")),
    }
}

fn parse_command(terminal: &str, verb: &str, payload: &[u8]) -> Result<Command, String> {
    if let Some(motor) = named(&Motor::ALL, terminal) {
        return parse_motor(motor, verb, payload);
    }
    match (named(&Output::ALL, terminal), named(&Input::ALL, terminal), verb) {
        (Some(output), _, "set") => {
            let payload::Duty { duty } = read(payload, r#"{"duty": 0 to 512}"#)?;
            return Ok(Command::Output { output, duty });
        }
        (_, Some(input), "mode") => {
            let form = r#"{"mode": "resistance", "digital": true}"#;
            let payload::InputConfig { mode, digital } = read(payload, form)?;
            return Ok(Command::InputMode { input, mode, digital });
        }
        _ => {}
    }
    match (named(&Counter::ALL, terminal), terminal, verb) {
        (Some(counter), _, "reset") => {
            nothing(payload)?;
            Ok(Command::ResetCounter(counter))
        }
        (Some(counter), _, "mode") => {
            let payload::CounterConfig { mode } = read(payload, r#"{"mode": "normal"}"#)?;
            Ok(Command::CounterMode { counter, mode })
        }
        (_, "sound", "set") => parse_sound(payload),
        _ => Err(unknown(&format!("{terminal}/{verb}"))),
    }
}

fn parse_motor(motor: Motor, verb: &str, payload: &[u8]) -> Result<Command, String> {
    match verb {
        "set" => {
            let payload::Duty { duty } = read(payload, r#"{"duty": -512 to 512}"#)?;
            Ok(Command::Motor { motor, duty, stops_followers: false })
        }
        "move" => {
            let form = r#"{"duty": 512, "distance": 100, "with": [{"motor": "M2"}]}"#;
            let payload::Move { duty, distance, with } = read(payload, form)?;
            let follower = |payload::Follower { motor, reverse }| {
                let found = named(&Motor::ALL, &motor);
                let motor = found.ok_or_else(|| format!("there is no motor {motor:?}"))?;
                Ok(Follower { motor, opposite: reverse })
            };
            let with = with.into_iter().map(follower).collect::<Result<_, String>>()?;
            Ok(Command::Move { motor, duty, pulses: distance, with })
        }
        "stop" => {
            nothing(payload)?;
            Ok(Command::StopMotor(motor))
        }
        "mode" => {
            let payload::PairConfig { mode } = read(payload, r#"{"mode": "motor"}"#)?;
            Ok(Command::Pair { motor, kind: mode })
        }
        _ => Err(unknown(&format!("{motor}/{verb}"))),
    }
}

fn parse_sound(payload: &[u8]) -> Result<Command, String> {
    let payload::Sound { sound, repeat } = read(payload, r#"{"sound": "Bell", "repeat": 1}"#)?;
    let index = match sound {
        payload::SoundName::Number(number) => number,
        payload::SoundName::Name(name) => {
            let found = Sound::ALL.iter().find(|sound| sound.name() == name);
            found.ok_or_else(|| format!("there is no sound {name:?}"))?.index().into()
        }
    };
    Ok(Command::Sound { index, repeat })
}

fn nothing(payload: &[u8]) -> Result<(), String> {
    read::<payload::Nothing>(payload, "{} or nothing").map(drop)
}

fn named<T: Copy + Display>(all: &[T], name: &str) -> Option<T> {
    all.iter().copied().find(|one| one.to_string() == name)
}

fn unknown(place: &str) -> String {
    let short: String = place.chars().take(60).collect();
    format!("there is no command {short:?}; docs/bridge.md lists the topics")
}

#[cfg(test)]
mod tests;
