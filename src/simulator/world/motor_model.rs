//! What a motor is and what it moves, as plain data.

use serde::Deserialize;

use crate::terminals::Input;

/// A motor on a motor output.
///
/// Its speed tends to `top_speed × (duty ÷ 512 − load)`, and stands still where that is negative.
/// Of the difference, 37 % is left after one [time constant](Self::time_constant).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotorModel {
    /// The speed at duty 512 without a load, in turns per second: more than 0, at most 100.
    pub top_speed: f64,
    /// The inertia of what turns, in seconds, 0..=1. With more than 0.1 s distances end [more than
    /// 3 pulses](super#how-it-moves) too late, and synchronised motors get more than 11 apart.
    pub time_constant: f64,
    /// What it has to turn against, as a part of the torque with which it starts, 0..=1. Either
    /// direction is as hard.
    pub load: f64,
    /// The pulses of its encoder per turn: more than 0, at most 1000. `None` for a motor without
    /// one, whose counter never counts, whose distances never end, and which nothing can be
    /// synchronised with.
    pub pulses_per_turn: Option<f64>,
    /// What it moves to and fro, if anything.
    pub slide: Option<Slide>,
}

impl Default for MotorModel {
    /// A motor without an encoder, 3 turns per second, 0.05 s of inertia, no load, no slide.
    fn default() -> Self {
        Self { top_speed: 3.0, time_constant: 0.05, load: 0.0, pulses_per_turn: None, slide: None }
    }
}

impl MotorModel {
    /// The pulses of fischertechnik's encoder motor per turn.
    pub const ENCODER: f64 = 63.3;

    /// A motor with [fischertechnik's encoder](Self::ENCODER), otherwise the default.
    pub fn with_encoder() -> Self {
        Self { pulses_per_turn: Some(Self::ENCODER), ..Self::default() }
    }
}

/// What a motor moves to and fro between two stops. Forward is towards its end.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slide {
    /// The way between the stops.
    pub travel: Travel,
    /// Where it is at first, in the unit of [`travel`](Self::travel), from 0 to its length.
    #[serde(default)]
    pub position: f64,
    /// The switch that it presses at its start, in the first hundredth of its travel.
    pub start_switch: Option<Input>,
    /// The switch that it presses at its end, in the last hundredth of its travel.
    pub end_switch: Option<Input>,
    /// The ultrasonic sensor that looks at it.
    pub seen_by: Option<SeenBy>,
}

/// How long the way of a slide is.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Travel {
    /// In pulses of the motor's encoder, more than 0.
    Pulses(f64),
    /// In millimetres.
    Mm {
        /// The way, more than 0.
        length: f64,
        /// How far one turn of the motor moves it, more than 0.
        per_turn: f64,
    },
}

impl Travel {
    /// The length in its own unit, pulses or mm.
    pub fn length(self) -> f64 {
        match self {
            Self::Pulses(length) | Self::Mm { length, .. } => length,
        }
    }
}

/// An ultrasonic sensor that looks at a slide. Between start and end, its distance changes evenly.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "{ input = \"I4\", start_cm = 5, end_cm = 25 }")]
pub struct SeenBy {
    /// Where the sensor is plugged in.
    pub input: Input,
    /// The distance when the slide is at its start, in cm, at least 0.
    pub start_cm: f64,
    /// The distance when the slide is at its end, in cm, at least 0.
    pub end_cm: f64,
}
