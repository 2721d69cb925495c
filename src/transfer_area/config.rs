//! The configuration part: what is plugged in where.

use std::ops::RangeInclusive;

use super::{
    PerCounter, PerInput, PerMotor, R2_MAX, R2_MIN, R_MAX, R_MIN, ULTRASONIC_MAX, ULTRASONIC_MIN,
    U_MAX,
};

/// What a universal input measures.
///
/// [`UniConfig::mode`] holds its number, because the area is plain data:
///
/// ```
/// use ft_transfer_area::prelude::*;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let mut area = FishX1Transfer::default();
/// area.config.uni[I1].mode = InputMode::Ultrasonic.into();
/// area.config.uni[I1].digital = 0;
/// area.raise_config_id(); // goes out before the next exchange
/// assert_eq!(InputMode::try_from(area.config.uni[I1].mode)?, InputMode::Ultrasonic);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum InputMode {
    /// Voltage in mV: 0..=9999, [`U_OVR`](super::U_OVR) when over range. Colour sensor.
    #[doc(alias = "MODE_U")]
    Voltage = 0,
    /// Resistance in Ω: 10..=4999, [`R_OVR`](super::R_OVR) when over range. Switches,
    /// photo transistors and NTCs.
    #[doc(alias = "MODE_R")]
    Resistance = 1,
    /// Resistance in Ω: 30..=14999, [`R2_OVR`](super::R2_OVR) when over range. The maker's firmware 4.7.0 (measured
    /// under emulation) asks its board for the voltage in this mode.
    #[doc(alias = "MODE_R2")]
    Resistance15k = 2,
    /// Distance in cm: 2..=1023, [`ULTRASONIC_OVR`](super::ULTRASONIC_OVR) when over range,
    /// [`NO_ULTRASONIC`](super::NO_ULTRASONIC) without a sensor.
    #[doc(alias = "MODE_ULTRASONIC")]
    Ultrasonic = 3,
}

impl InputMode {
    /// All modes, in the order of their numbers.
    pub const ALL: &'static [Self] =
        &[Self::Voltage, Self::Resistance, Self::Resistance15k, Self::Ultrasonic];

    /// Its name in files and messages: `voltage`, `resistance`, `resistance15k`, `ultrasonic`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Voltage => "voltage",
            Self::Resistance => "resistance",
            Self::Resistance15k => "resistance15k",
            Self::Ultrasonic => "ultrasonic",
        }
    }

    /// The unit of what it measures: `mV`, `Ω` or `cm`.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Voltage => "mV",
            Self::Resistance | Self::Resistance15k => "Ω",
            Self::Ultrasonic => "cm",
        }
    }

    /// The values that it measures. A value above them is over range.
    pub const fn range(self) -> RangeInclusive<i16> {
        match self {
            Self::Voltage => 0..=U_MAX,
            Self::Resistance => R_MIN..=R_MAX,
            Self::Resistance15k => R2_MIN..=R2_MAX,
            Self::Ultrasonic => ULTRASONIC_MIN..=ULTRASONIC_MAX,
        }
    }
}

/// Its number, 0..=3: what [`UniConfig::mode`] holds.
impl From<InputMode> for u8 {
    fn from(mode: InputMode) -> Self {
        mode as Self
    }
}

/// What one universal input (I1 to I8) measures and how it is reported, 4 bytes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "UNI_CONFIG")]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UniConfig {
    /// The number of an [`InputMode`], 0..=3: `InputMode::Ultrasonic.into()`, and back
    /// `InputMode::try_from(mode)`. Call [`raise_config_id`](super::FishX1Transfer::raise_config_id)
    /// after a change, or use [`set_ft_uni_config`](super::FishX1Transfer::set_ft_uni_config).
    pub mode: u8,
    /// 1 when the input reports 0 or 1, 0 when it reports the measured value. An ultrasonic sensor reports cm with
    /// both.
    pub digital: u8,
    /// Unused.
    pub dummy: [u8; 2],
}

impl UniConfig {
    /// An input that reports its measured value, in the unit of `mode`.
    pub const fn analog(mode: InputMode) -> Self {
        Self { mode: mode as u8, digital: 0, dummy: [0; 2] }
    }

    /// An input that reports 0 or 1.
    ///
    /// A switch is a digital [`Resistance`](InputMode::Resistance) input, a trail sensor a
    /// digital [`Voltage`](InputMode::Voltage) input.
    pub const fn digital(mode: InputMode) -> Self {
        Self { mode: mode as u8, digital: 1, dummy: [0; 2] }
    }

    /// What it measures; `None` for a number that is not a mode.
    pub fn input_mode(&self) -> Option<InputMode> {
        InputMode::try_from(self.mode).ok()
    }

    /// Whether it reports 0 or 1, not the measured value. A distance is always measured.
    pub const fn is_digital(&self) -> bool {
        self.digital != 0 && self.mode != InputMode::Ultrasonic as u8
    }

    /// The unit of what it reports; empty for 0 or 1, and for a number that is not a mode.
    pub fn unit(&self) -> &'static str {
        self.input_mode().filter(|_| !self.is_digital()).map_or("", InputMode::unit)
    }

    /// Whether a value that it reports is over range, which 0 and 1 never are.
    pub fn is_over_range(&self, value: i16) -> bool {
        let over = |mode: InputMode| value > *mode.range().end();
        !self.is_digital() && self.input_mode().is_some_and(over)
    }
}

/// The kit's default: a switch.
impl Default for UniConfig {
    fn default() -> Self {
        Self::digital(InputMode::Resistance)
    }
}

/// Which level of a counter input counts as 1. Closed on purpose: a controller has these two modes.
///
/// The maker's firmware 4.7.0 (measured under emulation) does not pass it on to its board, so it has no effect there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum CounterMode {
    /// The input is inverted.
    Inverted = 0,
    /// The input is not inverted, the kit's default.
    Normal = 1,
}

impl CounterMode {
    /// Both modes, in the order of their numbers.
    pub const ALL: [Self; 2] = [Self::Inverted, Self::Normal];

    /// Its name in files and messages: `inverted`, `normal`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Inverted => "inverted",
            Self::Normal => "normal",
        }
    }
}

/// Its number, 0 or 1: what [`CounterConfig::mode`] holds.
impl From<CounterMode> for u8 {
    fn from(mode: CounterMode) -> Self {
        mode as Self
    }
}

/// How one counter input (C1 to C4) counts, 4 bytes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "CNT_CONFIG")]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CounterConfig {
    /// The number of a [`CounterMode`], 0 or 1: `CounterMode::Inverted.into()`. Call
    /// [`raise_config_id`](super::FishX1Transfer::raise_config_id) after a change, or use
    /// [`set_ft_cnt_config`](super::FishX1Transfer::set_ft_cnt_config).
    pub mode: u8,
    /// Unused.
    pub dummy: [u8; 3],
}

impl CounterConfig {
    /// A counter input with this mode.
    pub const fn new(mode: CounterMode) -> Self {
        Self { mode: mode as u8, dummy: [0; 3] }
    }
}

/// The kit's default: not inverted.
impl Default for CounterConfig {
    fn default() -> Self {
        Self::new(CounterMode::Normal)
    }
}

/// What is plugged in where, 88 bytes.
///
/// The controller takes over a change only when [`State::config_id`](super::State::config_id)
/// changes as well, so raise it after writing here. The default is the kit's.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_CONFIG")]
#[doc(alias = "m_config")]
#[doc(alias = "TA_CONFIG")]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// Requested state of a program on the ROBO TX. 0 online.
    pub pgm_state_req: u8,
    /// Use of the old serial transfer on the ROBO TX. 0 online.
    #[doc(alias = "old_FtTransfer")]
    pub old_ft_transfer: u8,
    /// Unused.
    pub dummy: [u8; 2],
    /// M1 to M4: 1 a motor output, 0 two single outputs.
    pub motor: PerMotor<u8>,
    /// I1 to I8.
    pub uni: PerInput<UniConfig>,
    /// C1 to C4.
    pub cnt: PerCounter<CounterConfig>,
    /// Settings of the ROBO TX's motor control. 0 online.
    pub motor_config: PerMotor<[i16; 4]>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            pgm_state_req: 0,
            old_ft_transfer: 0,
            dummy: [0; 2],
            motor: [1; 4].into(),
            uni: PerInput::default(),
            cnt: PerCounter::default(),
            motor_config: PerMotor::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_have_names_of_their_own() {
        let names: Vec<_> = InputMode::ALL.iter().map(|mode| mode.name()).collect();
        assert_eq!(names, ["voltage", "resistance", "resistance15k", "ultrasonic"]);
        assert_eq!(CounterMode::ALL.map(CounterMode::name), ["inverted", "normal"]);
    }

    #[test]
    fn an_input_has_the_unit_of_its_mode_unless_it_is_digital() {
        for (mode, unit) in InputMode::ALL.iter().zip(["mV", "Ω", "Ω", "cm"]) {
            let is_distance = *mode == InputMode::Ultrasonic;
            let (analog, digital) = (UniConfig::analog(*mode), UniConfig::digital(*mode));
            assert_eq!((analog.input_mode(), analog.unit()), (Some(*mode), unit));
            assert_eq!(digital.unit(), if is_distance { unit } else { "" });
            assert_eq!(digital.input_mode(), Some(*mode));
            assert_eq!(digital.is_over_range(i16::MAX), is_distance);
        }
        let unknown = UniConfig { mode: 9, digital: 0, dummy: [0; 2] };
        assert_eq!((unknown.input_mode(), unknown.unit()), (None, ""));
    }
}
