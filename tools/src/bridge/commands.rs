//! The commands that a bridge takes: from topic and payload to what they change in the areas.

use std::fmt::Display;

use ft_transfer_area::transfer_area::{CounterMode, InputMode, DUTY_MAX, MAX_EXTENSIONS};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor, Output, Sound, SILENCE};
use ft_transfer_area::FishX1Transfer;

use super::payload::{self, in_range, read, CounterModeName, PairMode};
use super::topics::{HEARTBEAT, STOP};

/// A command for one of the areas.
#[derive(Debug, PartialEq)]
pub(crate) struct Command {
    area: usize,
    order: Order,
}

#[derive(Debug, PartialEq)]
enum Order {
    /// The master is alive; nothing else.
    Heartbeat,
    StopAll,
    Turn {
        motor: Motor,
        duty: i16,
    },
    Move {
        motor: Motor,
        duty: i16,
        distance: u32,
        with: Vec<(Motor, Direction)>,
    },
    StopMotor(Motor),
    Light {
        output: Output,
        duty: i16,
    },
    ResetCounter(Counter),
    InputMode {
        input: Input,
        mode: InputMode,
        digital: bool,
    },
    CounterMode {
        counter: Counter,
        mode: CounterMode,
    },
    PairMode {
        motor: Motor,
        mode: PairMode,
    },
    Sound {
        sound: u16,
        repeat: u16,
    },
}

impl Command {
    /// The command of a topic, without prefix and name, and its payload; or what is wrong, as a sentence.
    pub(crate) fn parse(tail: &str, payload: &[u8]) -> Result<Self, String> {
        if tail == HEARTBEAT {
            // Whatever a master likes to send there.
            return Ok(Self { area: 0, order: Order::Heartbeat });
        }
        let (area, place) = split_area(tail)?;
        let order = if area == 0 && tail == STOP {
            read::<payload::Nothing>(payload, "{} or nothing").map(|_| Order::StopAll)
        } else {
            match place.split_once('/') {
                Some((terminal, verb)) => parse_order(terminal, verb, payload),
                None => Err(unknown(place)),
            }
        };
        order.map(|order| Self { area, order })
    }

    /// Whether the command may come while the controller is away.
    pub(crate) fn needs_nothing(&self) -> bool {
        matches!(self.order, Order::Heartbeat | Order::StopAll)
    }

    /// Does what the command says; or says why it does nothing.
    pub(crate) fn apply(self, areas: &mut [FishX1Transfer]) -> Result<(), String> {
        let Self { area: index, order } = self;
        let count = areas.len();
        let Some(area) = areas.get_mut(index) else {
            return Err(format!(
                "there is no extension {index}; the bridge was started for {} extensions, see \
                 --extensions",
                count - 1
            ));
        };
        match order {
            Order::Heartbeat => {}
            Order::StopAll => stop_all(areas),
            Order::Turn { motor, duty } => {
                check_pair(area, motor, PairMode::Motor)?;
                turn(area, motor, duty).map_err(say)?;
            }
            Order::Move { motor, duty, distance, with } => {
                check_pair(area, motor, PairMode::Motor)?;
                for (follower, _) in &with {
                    check_pair(area, *follower, PairMode::Motor)?;
                }
                start(area, motor, duty, distance, &with).map_err(say)?;
            }
            Order::StopMotor(motor) => {
                check_pair(area, motor, PairMode::Motor)?;
                area.stop_motor_ex_cmd(motor).map_err(say)?;
            }
            Order::Light { output, duty } => {
                check_pair(area, output.motor(), PairMode::Outputs)?;
                area.set_out_pwm_values(output, duty).map_err(say)?;
            }
            Order::ResetCounter(counter) => area.start_counter_reset(counter),
            Order::InputMode { input, mode, digital } => {
                area.set_ft_uni_config(input, mode, digital);
            }
            Order::CounterMode { counter, mode } => area.set_ft_cnt_config(counter, mode),
            Order::PairMode { motor, mode } => {
                area.set_ft_motor_config(motor, mode == PairMode::Motor);
            }
            Order::Sound { sound, repeat } => {
                area.set_sound(sound, repeat).map_err(say)?;
            }
        }
        Ok(())
    }
}

/// Switches off all motors, outputs and sounds.
pub(crate) fn stop_all(areas: &mut [FishX1Transfer]) {
    for area in areas {
        area.output.stop_motors();
        if !area.is_sound_ready() && area.txt_outputs.sound_index != SILENCE {
            area.txt_outputs.sound_index = SILENCE;
            area.raise_sound_cmd_id();
        }
    }
}

fn turn(area: &mut FishX1Transfer, motor: Motor, duty: i16) -> Result<(), ft_transfer_area::Error> {
    let index = motor.index();
    if area.output.distance[index] == 0 && area.output.master[index] == 0 {
        area.set_out_motor_power(motor, duty)
    } else {
        // This ends the distance, or the motor would turn no further than that.
        area.start_synchronised(motor, duty.abs(), direction(duty, false), &[])
    }
}

fn start(
    area: &mut FishX1Transfer,
    motor: Motor,
    duty: i16,
    distance: u32,
    with: &[(Motor, Direction)],
) -> Result<(), ft_transfer_area::Error> {
    let ahead = direction(duty, false);
    match distance {
        0 => area.start_synchronised(motor, duty.abs(), ahead, with),
        _ => area.start_motor_ex_cmd(motor, duty.abs(), ahead, with, distance),
    }
}

fn direction(duty: i16, reverse: bool) -> Direction {
    if (duty < 0) == reverse {
        Direction::Cw
    } else {
        Direction::Ccw
    }
}

fn say(error: ft_transfer_area::Error) -> String {
    error.to_string()
}

/// An error with what to send, unless the pair is this.
fn check_pair(area: &FishX1Transfer, motor: Motor, needed: PairMode) -> Result<(), String> {
    let [first, second] = motor.outputs();
    match (PairMode::of(area, motor), needed) {
        (PairMode::Outputs, PairMode::Motor) => Err(format!(
            "{motor} is the two outputs {first} and {second}; send {{\"mode\": \"motor\"}} to \
             {motor}/mode, or use {first}/set"
        )),
        (PairMode::Motor, PairMode::Outputs) => Err(format!(
            "{first} and {second} are the motor {motor}; send {{\"mode\": \"outputs\"}} to \
             {motor}/mode, or use {motor}/set"
        )),
        _ => Ok(()),
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

fn parse_order(terminal: &str, verb: &str, payload: &[u8]) -> Result<Order, String> {
    if let Some(motor) = named(&Motor::ALL, terminal) {
        return parse_motor(motor, verb, payload);
    }
    match (named(&Output::ALL, terminal), named(&Input::ALL, terminal), verb) {
        (Some(output), _, "set") => {
            let payload::Duty { duty } = read(payload, r#"{"duty": 0 to 512}"#)?;
            let duty = in_range("duty", duty, 0..=i64::from(DUTY_MAX))?;
            return Ok(Order::Light { output, duty });
        }
        (_, Some(input), "mode") => {
            let form = r#"{"mode": "resistance", "digital": true}"#;
            let payload::InputConfig { mode, digital } = read(payload, form)?;
            return Ok(Order::InputMode { input, mode: mode.into(), digital });
        }
        _ => {}
    }
    match (named(&Counter::ALL, terminal), terminal, verb) {
        (Some(counter), _, "reset") => {
            read::<payload::Nothing>(payload, "{} or nothing")?;
            Ok(Order::ResetCounter(counter))
        }
        (Some(counter), _, "mode") => {
            let payload::CounterConfig { mode } = read(payload, r#"{"mode": "normal"}"#)?;
            let mode = match mode {
                CounterModeName::Normal => CounterMode::Normal,
                CounterModeName::Inverted => CounterMode::Inverted,
            };
            Ok(Order::CounterMode { counter, mode })
        }
        (_, "sound", "set") => parse_sound(payload),
        _ => Err(unknown(&format!("{terminal}/{verb}"))),
    }
}

fn parse_motor(motor: Motor, verb: &str, payload: &[u8]) -> Result<Order, String> {
    let most = i64::from(DUTY_MAX);
    match verb {
        "set" => {
            let payload::Duty { duty } = read(payload, r#"{"duty": -512 to 512}"#)?;
            Ok(Order::Turn { motor, duty: in_range("duty", duty, -most..=most)? })
        }
        "move" => {
            let form = r#"{"duty": 512, "distance": 100, "with": [{"motor": "M2"}]}"#;
            let payload::Move { duty, distance, with } = read(payload, form)?;
            let duty = in_range("duty", duty, -most..=most)?;
            let distance = match distance {
                Some(pulses) => in_range("distance", pulses, 1..=i64::from(u16::MAX))?,
                None => 0,
            };
            let follower = |follower: payload::Follower| {
                let found = named(&Motor::ALL, &follower.motor);
                let motor =
                    found.ok_or_else(|| format!("there is no motor {:?}", follower.motor))?;
                Ok((motor, direction(duty, follower.reverse)))
            };
            let with = with.into_iter().map(follower).collect::<Result<_, String>>()?;
            Ok(Order::Move { motor, duty, distance, with })
        }
        "stop" => {
            read::<payload::Nothing>(payload, "{} or nothing")?;
            Ok(Order::StopMotor(motor))
        }
        "mode" => {
            let payload::PairConfig { mode } = read(payload, r#"{"mode": "motor"}"#)?;
            Ok(Order::PairMode { motor, mode })
        }
        _ => Err(unknown(&format!("{motor}/{verb}"))),
    }
}

fn parse_sound(payload: &[u8]) -> Result<Order, String> {
    let payload::Sound { sound, repeat } = read(payload, r#"{"sound": "Bell", "repeat": 1}"#)?;
    let sound = match sound {
        payload::SoundName::Number(number) => in_range("sound", number, 0..=99)?,
        payload::SoundName::Name(name) => {
            let found = Sound::ALL.iter().find(|sound| sound.name() == name);
            found.ok_or_else(|| format!("there is no sound {name:?}"))?.index()
        }
    };
    let repeat = in_range("repeat", repeat, 0..=i64::from(u16::MAX))?;
    Ok(Order::Sound { sound, repeat })
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
