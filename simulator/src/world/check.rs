//! Checks of a world whose values all have the right type.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::ops::RangeInclusive;

use super::remote::AXIS_MAX;
use super::script::{Script, ScriptAction, ScriptEvent};
use super::sensor::Sensor;
use super::{Board, I2cDevice, MotorModel, Remote, SeenBy, Slide, Travel, World};
use crate::i2c::ADDRESS_MAX;
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::Input;

/// The number of different switch settings of remotes.
const REMOTES: usize = 4;

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
    fn within(mut self, name: impl Display) -> Self {
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
fn each<T>(name: &str, values: &[T], check: impl Fn(&T) -> Checked) -> Checked {
    let numbered = values.iter().enumerate();
    numbered.into_iter().try_for_each(|(number, value)| at(name, at(number, check(value))))
}

fn expect(holds: bool, reason: impl FnOnce() -> String) -> Checked {
    if holds {
        Ok(())
    } else {
        Err(Mistake::new(reason()))
    }
}

/// Checks that a number is in a range. NaN is in none.
fn in_range(name: &str, value: f64, range: RangeInclusive<f64>) -> Checked {
    let (least, most) = (range.start(), range.end());
    at(name, expect(range.contains(&value), || format!("expected {least} to {most}, not {value}")))
}

fn not_negative(name: &str, value: f64) -> Checked {
    let right = value >= 0.0 && value.is_finite();
    at(name, expect(right, || format!("expected 0 or more, not {value}")))
}

fn positive(name: &str, value: f64, most: f64) -> Checked {
    let right = value > 0.0 && value <= most;
    at(name, expect(right, || format!("expected more than 0 and at most {most}, not {value}")))
}

impl World {
    /// Checks the ranges, and that the parts fit together.
    pub(super) fn find_mistake(&self) -> Checked {
        at("master", self.master.check())?;
        let count = self.extensions.len();
        let reason = || format!("expected at most {MAX_EXTENSIONS} extensions, not {count}");
        let too_many = at(MAX_EXTENSIONS, expect(count <= MAX_EXTENSIONS, reason));
        at("extensions", too_many)?;
        each("extensions", &self.extensions, Board::check)?;
        at("script", self.script.check())?;
        at("script", each("events", &self.script.events, |event| self.check_event(event)))?;
        each("remotes", &self.remotes, check_axes)?;
        at("remotes", check_settings(&self.remotes))?;
        each("i2c", &self.i2c, |device| check_address(device.address))?;
        at("i2c", check_addresses(&self.i2c))
    }

    fn check_event(&self, event: &ScriptEvent) -> Checked {
        let time = event.at;
        not_negative("at", time)?;
        let most = self.script.period.unwrap_or(f64::INFINITY);
        at("at", expect(time < most, || format!("expected less than the period, {most}")))?;
        match &event.action {
            ScriptAction::Press { controller, input, .. } => self.check_press(*controller, *input),
            ScriptAction::Remote(remote) => {
                let known = self.remotes.iter().any(|known| known.is_set_like(remote));
                let reason = || String::from("expected dip1 and dip2 of a remote in this world");
                at("remote", check_axes(remote).and_then(|()| expect(known, reason)))
            }
            ScriptAction::I2c { address, .. } => {
                let known = self.i2c.iter().any(|device| device.address == *address);
                let reason = || format!("expected a device of this world, not {address:#04x}");
                at("i2c", at("address", expect(known, reason)))
            }
        }
    }

    fn check_press(&self, controller: usize, input: Input) -> Checked {
        let Some(board) = self.board(controller) else {
            let reason = format!("expected a controller of this world, not {controller}");
            return Err(Mistake::new(reason).within("controller"));
        };
        let sensor = board.inputs.get(&input);
        let presses = matches!(sensor, Some(Sensor::Switch { .. } | Sensor::Button { .. }));
        at("input", expect(presses, || format!("expected a button or switch on {input}")))?;
        let moved = board.moved_inputs().any(|(_, _, moved)| moved == input);
        at("input", expect(!moved, || format!("{input} is pressed by a slide")))
    }
}

impl Script {
    fn check(&self) -> Checked {
        let period = self.period.unwrap_or(1.0);
        let right = period >= 0.001 && period.is_finite();
        at("period", expect(right, || format!("expected 0.001 or more, not {period}")))
    }
}

impl Board {
    fn check(&self) -> Checked {
        for (input, sensor) in &self.inputs {
            at("inputs", at(input, sensor.check()))?;
        }
        for (output, motor) in &self.motors {
            at("motors", at(output, motor.check()))?;
        }
        self.check_moved()?;
        for lamp in &self.lamps {
            let motor = lamp.motor();
            let reason = || format!("{lamp} is a terminal of the motor on {motor}");
            at("lamps", at(lamp, expect(!self.motors.contains_key(&motor), reason)))?;
        }
        Ok(())
    }

    /// The inputs that slides move: the motor's name, the key, the input.
    fn moved_inputs(&self) -> impl Iterator<Item = (String, &'static str, Input)> + '_ {
        self.motors.iter().flat_map(|(output, motor)| {
            let inputs = motor.slide.as_ref().map(Slide::moved_inputs);
            let inputs = inputs.into_iter().flatten();
            inputs.map(move |(key, input)| (output.to_string(), key, input))
        })
    }

    /// Checks that each input that a slide moves has the right sensor, and only one slide.
    fn check_moved(&self) -> Checked {
        let mut moved = BTreeSet::new();
        for (motor, key, input) in self.moved_inputs() {
            let (right, expected) = match (key, self.inputs.get(&input)) {
                (SEEN_BY, sensor) => {
                    (matches!(sensor, Some(Sensor::Ultrasonic { .. })), "an ultrasonic sensor")
                }
                (_, sensor) => (matches!(sensor, Some(Sensor::Switch { .. })), "a switch"),
            };
            let checked = expect(right, || format!("expected {expected} on {input}"))
                .and_then(|()| expect(moved.insert(input), || format!("{input} is used twice")));
            at("motors", at(motor, at("slide", at(key, checked))))?;
        }
        Ok(())
    }
}

const START_SWITCH: &str = "start_switch";
const END_SWITCH: &str = "end_switch";
const SEEN_BY: &str = "seen_by";

impl Slide {
    fn moved_inputs(&self) -> impl Iterator<Item = (&'static str, Input)> {
        let inputs = [
            (START_SWITCH, self.start_switch),
            (END_SWITCH, self.end_switch),
            (SEEN_BY, self.seen_by.map(|seen_by| seen_by.input)),
        ];
        inputs.into_iter().filter_map(|(key, input)| Some((key, input?)))
    }

    fn check(&self) -> Checked {
        at("travel", self.travel.check())?;
        in_range("position", self.position, 0.0..=self.travel.length())?;
        let Some(SeenBy { start_cm, end_cm, .. }) = self.seen_by else { return Ok(()) };
        let near = not_negative("start_cm", start_cm);
        at(SEEN_BY, near.and_then(|()| not_negative("end_cm", end_cm)))
    }
}

impl Travel {
    fn check(self) -> Checked {
        match self {
            Self::Pulses(pulses) => positive("pulses", pulses, f64::MAX),
            Self::Mm { length, per_turn } => {
                let length = positive("length", length, f64::MAX);
                at("mm", length.and_then(|()| positive("per_turn", per_turn, f64::MAX)))
            }
        }
    }
}

impl MotorModel {
    fn check(&self) -> Checked {
        positive("top_speed", self.top_speed, 100.0)?;
        in_range("time_constant", self.time_constant, 0.0..=1.0)?;
        in_range("load", self.load, 0.0..=1.0)?;
        if let Some(pulses) = self.pulses_per_turn {
            positive("pulses_per_turn", pulses, 1000.0)?;
        }
        let Some(slide) = &self.slide else { return Ok(()) };
        let in_pulses = matches!(slide.travel, Travel::Pulses(_));
        let countable = !in_pulses || self.pulses_per_turn.is_some();
        let reason = || String::from("a travel in pulses needs pulses_per_turn of the motor");
        at("slide", at("travel", expect(countable, reason)).and_then(|()| slide.check()))
    }
}

impl Sensor {
    fn check(&self) -> Checked {
        match *self {
            Self::Ntc { celsius } => at("ntc", in_range("celsius", celsius, -50.0..=150.0)),
            Self::PhotoTransistor { light } => {
                at("photo_transistor", in_range("light", light, 0.0..=1.0))
            }
            Self::Ultrasonic { cm } => at("ultrasonic", not_negative("cm", cm)),
            _ => Ok(()),
        }
    }
}

fn check_axes(remote: &Remote) -> Checked {
    remote.axes().into_iter().try_for_each(|(axis, value)| {
        let right = (-AXIS_MAX..=AXIS_MAX).contains(&value);
        at(axis, expect(right, || format!("expected -{AXIS_MAX} to {AXIS_MAX}, not {value}")))
    })
}

fn check_settings(remotes: &[Remote]) -> Checked {
    for (number, remote) in remotes.iter().enumerate() {
        let taken = remotes.iter().take(number).any(|other| other.is_set_like(remote));
        let reason = || {
            format!("expected a different switch setting (dip1, dip2); there are only {REMOTES}")
        };
        at(number, expect(!taken, reason))?;
    }
    Ok(())
}

fn check_address(address: u8) -> Checked {
    let right = address <= ADDRESS_MAX;
    at("address", expect(right, || format!("expected 0 to {ADDRESS_MAX:#04x}, not {address:#04x}")))
}

fn check_addresses(devices: &[I2cDevice]) -> Checked {
    for (number, device) in devices.iter().enumerate() {
        let taken = devices.iter().take(number).any(|other| other.address == device.address);
        at(number, expect(!taken, || format!("there are two devices at {:#04x}", device.address)))?;
    }
    Ok(())
}
