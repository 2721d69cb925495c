//! The values of an area, as they are sent.

use ft_transfer_area::transfer_area::{CounterMode, InputMode, MAX_EXTENSIONS};
use ft_transfer_area::tx::{Input, IrDevice, JoystickAxis, JoystickSwitch, Motor};
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;

use super::payload::{CounterModeName, InputModeName, PairMode};
use super::topics::What;

/// A value as its payload.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Value {
    Digital { value: i16 },
    Measured { value: i16, unit: &'static str, over_range: bool },
    InputConfig { mode: InputModeName, digital: bool },
    Counter { count: u16, level: bool },
    CounterConfig { mode: CounterModeName },
    Motor { duty: i16, distance: u16, done: bool },
    PairConfig { mode: PairMode },
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
            What::Input(input) => read_input(input, area),
            What::InputConfig(input) => {
                let config = area.config.uni[input.index()];
                let mode = InputModeName::try_from(config.mode).ok()?;
                Self::InputConfig { mode, digital: config.digital != 0 }
            }
            What::Counter(counter) => {
                let (count, level) = area.get_in_counter_value(counter);
                Self::Counter { count, level }
            }
            What::CounterConfig(counter) => {
                let inverted = u8::from(CounterMode::Inverted);
                let is_inverted = area.config.cnt[counter.index()].mode == inverted;
                Self::CounterConfig { mode: CounterModeName::new(is_inverted) }
            }
            What::Motor(motor) => read_motor(motor, area)?,
            What::MotorConfig(motor) => Self::PairConfig { mode: PairMode::of(area, motor) },
            What::Output(output) => Self::Output { duty: area.get_out_pwm_values(output).ok()? },
            What::Remote(device) => read_remote(device, area),
            What::Microphone => {
                Self::Microphone { linear: area.get_mic_lin(), logarithmic: area.get_mic_log() }
            }
            What::Sound => {
                let sound = area.txt_outputs.sound_index;
                Self::Sound { sound, done: area.is_sound_ready() }
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

fn read_input(input: Input, area: &FishX1Transfer) -> Value {
    let config = area.config.uni[input.index()];
    let reading = area.get_in_io_value(input);
    if config.digital != 0 {
        return Value::Digital { value: reading.value };
    }
    let unit = match InputMode::try_from(config.mode) {
        Ok(InputMode::Voltage) => "mV",
        Ok(InputMode::Ultrasonic) => "cm",
        _ => "Ω",
    };
    Value::Measured { value: reading.value, unit, over_range: reading.over_range }
}

fn read_motor(motor: Motor, area: &FishX1Transfer) -> Option<Value> {
    let duty = area.get_out_motor_values(motor).ok()?;
    let distance = area.output.distance[motor.index()];
    Some(Value::Motor { duty, distance, done: area.is_motor_ex_ready(motor) })
}

fn read_remote(device: IrDevice, area: &FishX1Transfer) -> Value {
    let axis = |axis| area.get_joystick_full(device, axis);
    Value::Remote {
        left: Stick { x: axis(JoystickAxis::LeftX), y: axis(JoystickAxis::LeftY) },
        right: Stick { x: axis(JoystickAxis::RightX), y: axis(JoystickAxis::RightY) },
        on: area.get_joystick_but_swi(device, JoystickSwitch::On),
        off: area.get_joystick_but_swi(device, JoystickSwitch::Off),
    }
}
