//! The commands that a bridge accepts: from topic and payload to what they change in the areas.

use std::ops::RangeInclusive;

use ft_transfer_area::transfer_area::{CounterMode, InputMode, DUTY_MAX, MAX_EXTENSIONS};
use ft_transfer_area::tx::{Counter, Input, InvalidCall, Motor, Output};
use ft_transfer_area::FishX1Transfer;

use super::payload::{named, short, Fields};
use super::topics::{HEARTBEAT, STOP};
use crate::commands::{absent, is_connected, sentence, stop_all, Command, Pair};

/// What has commands: its terminals, and the last words of their topics.
const COMMANDS: [(&str, &[&str]); 5] = [
    ("M1 to M4", &["set", "move", "stop", "mode"]),
    ("O1 to O8", &["set"]),
    ("C1 to C4", &["reset", "mode"]),
    ("I1 to I8", &["mode"]),
    (SOUND, &["set"]),
];

const SOUND: &str = "sound";

/// The duty of a motor, negative for counterclockwise.
const POWER: RangeInclusive<i64> = -(DUTY_MAX as i64)..=DUTY_MAX as i64;

/// The duty of a single output.
const DUTY: RangeInclusive<i64> = 0..=DUTY_MAX as i64;

/// How far a motor turns, in pulses of its counter.
const DISTANCE: RangeInclusive<i64> = 1..=u16::MAX as i64;

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
            STOP => return Ok(Self::StopAll),
            _ => {}
        }
        let (area, place) = split_area(tail)?;
        let (terminal, verb) = place.split_once('/').unwrap_or((place, ""));
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
                let (extensions, connected) = (areas.len() - 1, is_connected(areas, index));
                let area = areas.get_mut(index).ok_or_else(|| {
                    format!(
                        "there is no extension {index}; the bridge was started for {extensions} \
                         extensions, see --extensions"
                    )
                })?;
                if !connected {
                    return Err(absent(index));
                }
                command.apply(area).map_err(explain)
            }
        }
    }
}

/// An error as a sentence, with what to send.
fn explain(error: InvalidCall) -> String {
    match error {
        InvalidCall::NotAMotor { motor } => {
            let [first, second] = motor.outputs();
            format!(
                "{motor} is the two outputs {first} and {second}; send {{\"mode\": \"motor\"}} to \
                 {motor}/mode, or use {first}/set"
            )
        }
        InvalidCall::NotAnOutput { output } => {
            let motor = output.motor();
            let [first, second] = motor.outputs();
            format!(
                "{first} and {second} are the motor {motor}; send {{\"mode\": \"outputs\"}} to \
                 {motor}/mode, or use {motor}/set"
            )
        }
        other => sentence(&other.into()),
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
        _ => Err(format!(
            "there is no ext{}; extensions are ext1 to ext{MAX_EXTENSIONS}",
            short(extension)
        )),
    }
}

fn parse_command(terminal: &str, verb: &str, payload: &[u8]) -> Result<Command, String> {
    if let Some(motor) = named(&Motor::ALL, terminal) {
        return parse_motor(motor, verb, payload);
    }
    match (named(&Output::ALL, terminal), named(&Input::ALL, terminal), verb) {
        (Some(output), _, "set") => {
            let mut fields = Fields::read(payload, r#"{"duty": 300}"#)?;
            let duty = fields.number("duty", DUTY)?;
            return fields.end().map(|()| Command::Output { output, duty });
        }
        (_, Some(input), "mode") => {
            let mut fields = Fields::read(payload, r#"{"mode": "resistance", "digital": true}"#)?;
            let mode = fields.one_of("mode", InputMode::ALL, InputMode::name)?;
            let digital = fields.truth("digital")?;
            return fields.end().map(|()| Command::InputMode { input, mode, digital });
        }
        _ => {}
    }
    match (named(&Counter::ALL, terminal), terminal, verb) {
        (Some(counter), _, "reset") => {
            Fields::read(payload, NOTHING)?.end().map(|()| Command::ResetCounter(counter))
        }
        (Some(counter), _, "mode") => {
            let mut fields = Fields::read(payload, r#"{"mode": "normal"}"#)?;
            let mode = fields.one_of("mode", &CounterMode::ALL, CounterMode::name)?;
            fields.end().map(|()| Command::CounterMode { counter, mode })
        }
        (_, SOUND, "set") => {
            let mut fields = Fields::read(payload, r#"{"sound": "Bell", "repeat": 1}"#)?;
            let index = fields.sound()?;
            let repeat = fields.number_if_there("repeat", 0..=u16::MAX.into())?.unwrap_or(1);
            // It is in the range.
            fields.end().map(|()| Command::Sound { index, repeat: repeat as u16 })
        }
        _ => Err(unknown(terminal, verb)),
    }
}

fn parse_motor(motor: Motor, verb: &str, payload: &[u8]) -> Result<Command, String> {
    match verb {
        "set" => {
            let mut fields = Fields::read(payload, r#"{"duty": 300}"#)?;
            let duty = fields.number("duty", POWER)?;
            fields.end().map(|()| Command::Motor { motor, duty, stops_followers: false })
        }
        "move" => {
            let form = r#"{"duty": 512, "distance": 100, "with": [{"motor": "M2"}]}"#;
            let mut fields = Fields::read(payload, form)?;
            let duty = fields.number("duty", POWER)?;
            // It is in the range.
            let pulses = fields.number_if_there("distance", DISTANCE)?.map(|pulses| pulses as u32);
            let with = fields.followers()?;
            fields.end().map(|()| Command::Move { motor, duty, pulses, with })
        }
        // As with the stop of everything, nobody is asked for a right payload first.
        "stop" => Ok(Command::StopMotor(motor)),
        "mode" => {
            let mut fields = Fields::read(payload, r#"{"mode": "motor"}"#)?;
            let kind = fields.one_of("mode", &[Pair::Motor, Pair::Outputs], Pair::name)?;
            fields.end().map(|()| Command::Pair { motor, kind })
        }
        _ => Err(unknown(&motor.to_string(), verb)),
    }
}

const NOTHING: &str = "{} or nothing";

/// What a topic could have been instead of one that is not a command.
fn unknown(terminal: &str, verb: &str) -> String {
    let is_one = [
        named(&Motor::ALL, terminal).is_some(),
        named(&Output::ALL, terminal).is_some(),
        named(&Counter::ALL, terminal).is_some(),
        named(&Input::ALL, terminal).is_some(),
        terminal == SOUND,
    ];
    if let Some(((_, verbs), _)) = COMMANDS.iter().zip(is_one).find(|(_, is_one)| *is_one) {
        let topics: Vec<_> = verbs.iter().map(|verb| format!("{terminal}/{verb}")).collect();
        let (verb, topics) = (short(verb), topics.join(", "));
        return format!("{terminal} has no command {verb:?}; its commands are {topics}");
    }
    let all = COMMANDS.map(|(terminals, verbs)| format!("{terminals} with /{}", verbs.join(", /")));
    format!(
        "there is no terminal {:?} that takes commands; there are {}, on extensions behind ext1/ to \
         ext{MAX_EXTENSIONS}/, and {STOP} and {HEARTBEAT} for the whole controller",
        short(terminal),
        all.join("; ")
    )
}

#[cfg(test)]
mod tests;
