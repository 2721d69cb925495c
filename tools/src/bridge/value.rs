//! The values of an area, as they are sent.

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::{Counter, Input, IrDevice, Motor, Output};
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;

use crate::commands::Pair;
use crate::values::{CounterValue, InputValue, RemoteValue, SoundValue};

/// A value as its payload.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Value {
    Digital { value: i16 },
    Measured { value: i16, unit: &'static str, over_range: bool },
    InputConfig { mode: &'static str, digital: bool },
    Counter { count: u16, level: bool },
    CounterConfig { mode: &'static str },
    Motor { duty: i16, distance: u16, done: bool },
    PairConfig { mode: Pair },
    Output { duty: i16 },
    Remote { left: Stick, right: Stick, on: bool, off: bool },
    Microphone { linear: u16, logarithmic: u16 },
    Sound { sound: u16, done: bool },
    Extensions { connected: [bool; MAX_EXTENSIONS] },
}

/// Where a joystick is, −15..=15 on both axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Stick {
    x: i16,
    y: i16,
}

/// Reads a value; `None` for a motor that is configured as two outputs, and for outputs that are a motor.
pub(crate) type Read = Box<dyn Fn(&FishX1Transfer) -> Option<Value> + Send>;

/// All values of the master's area, or of an extension's: what follows prefix and name in their topics, and how
/// they are read.
pub(crate) fn values_of(area: usize) -> Vec<(String, Read)> {
    let mut all: Vec<(String, Read)> = Vec::new();
    let mut add = |tail: String, read: Read| match area {
        0 => all.push((tail, read)),
        _ => all.push((format!("ext{area}/{tail}"), read)),
    };
    for input in Input::ALL {
        add(input.to_string(), Box::new(move |area| Some(read_input(input, area))));
        add(format!("{input}/config"), Box::new(move |area| Some(read_config(input, area))));
    }
    for counter in Counter::ALL {
        let read = move |area: &_| CounterValue::of(area, counter);
        let value = move |area: &_| {
            let CounterValue { count, level, .. } = read(area);
            Some(Value::Counter { count, level })
        };
        let config = move |area: &_| Some(Value::CounterConfig { mode: read(area).mode });
        add(counter.to_string(), Box::new(value));
        add(format!("{counter}/config"), Box::new(config));
    }
    for motor in Motor::ALL {
        let config = move |area: &_| Some(Value::PairConfig { mode: Pair::of(area, motor) });
        add(motor.to_string(), Box::new(move |area| read_motor(motor, area)));
        add(format!("{motor}/config"), Box::new(config));
    }
    for output in Output::ALL {
        let duty = move |area: &FishX1Transfer| area.get_out_pwm_values(output).ok();
        add(output.to_string(), Box::new(move |area| Some(Value::Output { duty: duty(area)? })));
    }
    for device in IrDevice::ALL {
        let tail = format!("remote/{}", remote_name(device));
        add(tail, Box::new(move |area| Some(read_remote(device, area))));
    }
    let microphone = |area: &FishX1Transfer| {
        Some(Value::Microphone { linear: area.get_mic_lin(), logarithmic: area.get_mic_log() })
    };
    add("microphone".to_owned(), Box::new(microphone));
    let sound = |area: &_| {
        let SoundValue { index, playing, .. } = SoundValue::of(area);
        Some(Value::Sound { sound: index, done: !playing })
    };
    add("sound".to_owned(), Box::new(sound));
    if area == 0 {
        let extensions = |area: &FishX1Transfer| {
            let connected = area.state.io_slave_alive.map(|alive| alive != 0);
            Some(Value::Extensions { connected })
        };
        add("extensions".to_owned(), Box::new(extensions));
    }
    all
}

/// A remote by its two DIP switches.
fn remote_name(device: IrDevice) -> &'static str {
    match device {
        IrDevice::Any => "any",
        IrDevice::OffOff => "off-off",
        IrDevice::OnOff => "on-off",
        IrDevice::OffOn => "off-on",
        IrDevice::OnOn => "on-on",
    }
}

fn read_input(input: Input, area: &FishX1Transfer) -> Value {
    let InputValue { digital, value, unit, over_range, .. } = InputValue::of(area, input);
    match digital {
        true => Value::Digital { value },
        false => Value::Measured { value, unit, over_range },
    }
}

fn read_config(input: Input, area: &FishX1Transfer) -> Value {
    let InputValue { mode, digital, .. } = InputValue::of(area, input);
    Value::InputConfig { mode, digital }
}

fn read_motor(motor: Motor, area: &FishX1Transfer) -> Option<Value> {
    let duty = area.get_out_motor_values(motor).ok()?;
    let distance = area.output.distance[motor.index()];
    Some(Value::Motor { duty, distance, done: area.is_motor_ex_ready(motor) })
}

fn read_remote(device: IrDevice, area: &FishX1Transfer) -> Value {
    let remote = RemoteValue::from(&area.txt_inputs.ir_input[device.index()]);
    Value::Remote {
        left: Stick { x: remote.left_x, y: remote.left_y },
        right: Stick { x: remote.right_x, y: remote.right_y },
        on: remote.on,
        off: remote.off,
    }
}

impl Value {
    /// Whether another value is one of the same kind, in the same unit.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let unit = |value: &Self| value.measured().map(|(_, unit, _)| unit);
        unit(self) == unit(other)
    }

    /// How far a measured number is from that of another value; `None` when not only the number differs.
    pub(crate) fn distance(&self, other: &Self) -> Option<u32> {
        let ((numbers, unit, over_range), others) = (self.measured()?, other.measured()?);
        let differences = numbers.iter().zip(others.0).map(|(one, other)| one.abs_diff(other));
        differences.max().filter(|_| (unit, over_range) == (others.1, others.2))
    }

    /// The measured numbers, their unit if there is one, and whether they are over range.
    fn measured(&self) -> Option<([i32; 2], &'static str, bool)> {
        match *self {
            Self::Measured { value, unit, over_range } => {
                Some(([value.into(), 0], unit, over_range))
            }
            Self::Microphone { linear, logarithmic } => {
                Some(([linear.into(), logarithmic.into()], "", false))
            }
            Self::Counter { .. }
            | Self::Remote { .. }
            | Self::Digital { .. }
            | Self::InputConfig { .. }
            | Self::CounterConfig { .. }
            | Self::Motor { .. }
            | Self::PairConfig { .. }
            | Self::Output { .. }
            | Self::Sound { .. }
            | Self::Extensions { .. } => None,
        }
    }

    /// Whether a change to this value may wait, because many more may follow.
    pub(crate) fn may_wait(&self) -> bool {
        let counts = matches!(self, Self::Counter { .. } | Self::Remote { .. });
        counts || self.measured().is_some()
    }
}
