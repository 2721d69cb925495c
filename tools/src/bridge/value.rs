//! The values of an area, as they are sent.

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::tx::Motor;
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;

use super::topics::What;
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

impl Value {
    /// The value in this area; `None` for a motor that is configured as two outputs, and for outputs that
    /// are a motor.
    pub(crate) fn read(what: What, area: &FishX1Transfer) -> Option<Self> {
        Some(match what {
            What::Input(input) => {
                let InputValue { digital, value, unit, over_range, .. } =
                    InputValue::of(area, input);
                match digital {
                    true => Self::Digital { value },
                    false => Self::Measured { value, unit, over_range },
                }
            }
            What::InputConfig(input) => {
                let InputValue { mode, digital, .. } = InputValue::of(area, input);
                Self::InputConfig { mode, digital }
            }
            What::Counter(counter) => {
                let CounterValue { count, level, .. } = CounterValue::of(area, counter);
                Self::Counter { count, level }
            }
            What::CounterConfig(counter) => {
                Self::CounterConfig { mode: CounterValue::of(area, counter).mode }
            }
            What::Motor(motor) => read_motor(motor, area)?,
            What::MotorConfig(motor) => Self::PairConfig { mode: Pair::of(area, motor) },
            What::Output(output) => Self::Output { duty: area.get_out_pwm_values(output).ok()? },
            What::Remote(device) => {
                read_remote(&RemoteValue::from(&area.txt_inputs.ir_input[device.index()]))
            }
            What::Microphone => {
                Self::Microphone { linear: area.get_mic_lin(), logarithmic: area.get_mic_log() }
            }
            What::Sound => {
                let SoundValue { index, playing, .. } = SoundValue::of(area);
                Self::Sound { sound: index, done: !playing }
            }
            What::Extensions => {
                Self::Extensions { connected: area.state.io_slave_alive.map(|alive| alive != 0) }
            }
        })
    }

    /// How far a measured number is from that of another value; `None` when not only the number differs.
    pub(crate) fn distance(&self, other: &Self) -> Option<u32> {
        match (self, other) {
            (
                Self::Measured { value, unit, over_range },
                Self::Measured { value: other, unit: other_unit, over_range: other_over },
            ) if (unit, over_range) == (other_unit, other_over) => {
                Some(i32::from(*value).abs_diff(i32::from(*other)))
            }
            (
                Self::Microphone { linear, logarithmic },
                Self::Microphone { linear: other_linear, logarithmic: other_logarithmic },
            ) => {
                let differences =
                    [linear.abs_diff(*other_linear), logarithmic.abs_diff(*other_logarithmic)];
                differences.into_iter().max().map(u32::from)
            }
            _ => None,
        }
    }

    /// Whether a change to this value may wait, because many more may follow.
    pub(crate) fn may_wait(&self) -> bool {
        matches!(
            self,
            Self::Measured { .. }
                | Self::Counter { .. }
                | Self::Remote { .. }
                | Self::Microphone { .. }
        )
    }
}

fn read_motor(motor: Motor, area: &FishX1Transfer) -> Option<Value> {
    let duty = area.get_out_motor_values(motor).ok()?;
    let distance = area.output.distance[motor.index()];
    Some(Value::Motor { duty, distance, done: area.is_motor_ex_ready(motor) })
}

fn read_remote(remote: &RemoteValue) -> Value {
    Value::Remote {
        left: Stick { x: remote.left_x, y: remote.left_y },
        right: Stick { x: remote.right_x, y: remote.right_y },
        on: remote.on,
        off: remote.off,
    }
}
