//! Motors and slides, as plain data.

use ft_transfer_area::tx::Input;
use toml::de::DeValue;

use super::mistake::{at, expect, in_range, not_negative, positive, Checked, Mistake};
use super::read::{number, only, terminal_value, Keys, Read};

const MOTOR: &str = "expected a motor, as in M1 = { pulses_per_turn = 63.3 }";
const SLIDE: &str = "expected a slide, as in slide = { travel = { pulses = 1000 } }";
const TRAVEL: &str = "expected one length, as in travel = { pulses = 1000 }";
const MM: &str = "expected a table, as in travel = { mm = { length = 120, per_turn = 4.5 } }";
const SEEN_BY_TABLE: &str = "expected a table, as in { input = \"I4\", start_cm = 5, end_cm = 25 }";

const START_SWITCH: &str = "start_switch";
const END_SWITCH: &str = "end_switch";
pub(super) const SEEN_BY: &str = "seen_by";

/// A motor on a motor output.
///
/// Its speed approaches `top_speed × (duty ÷ 512 − load)`, or 0 if that is negative. After one [time
/// constant](Self::time_constant), 37 % of the difference is left.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MotorModel {
    /// The speed at duty 512 without a load, in turns per second: more than 0, at most 100.
    pub top_speed: f64,
    /// The inertia, in seconds, 0..=1. With more than 0.1 s distances end [more than 3
    /// pulses](super#how-it-moves) too late, and synchronised motors get more than 11 pulses apart.
    pub time_constant: f64,
    /// The torque that it works against, as a part of its starting torque, 0..=1. It is the same in
    /// both directions.
    pub load: f64,
    /// The pulses of its encoder per turn: more than 0, at most 1000. `None` for a motor without an
    /// encoder: its counter never counts, its distances never end, and no motor can be synchronised
    /// with it.
    pub pulses_per_turn: Option<f64>,
    /// The slide that it moves, if any.
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
    pub fn encoder_motor() -> Self {
        Self { pulses_per_turn: Some(Self::ENCODER), ..Self::default() }
    }

    /// Sets the speed at duty 512, in turns per second: more than 0, at most 100.
    pub fn with_top_speed(mut self, top_speed: f64) -> Self {
        self.top_speed = top_speed;
        self
    }

    /// Sets the inertia in seconds, 0..=1.
    pub fn with_time_constant(mut self, seconds: f64) -> Self {
        self.time_constant = seconds;
        self
    }

    /// Sets the load, as a part of the starting torque, 0..=1.
    pub fn with_load(mut self, load: f64) -> Self {
        self.load = load;
        self
    }

    /// Adds an encoder that gives this many pulses per turn: more than 0, at most 1000.
    pub fn with_pulses_per_turn(mut self, pulses: f64) -> Self {
        self.pulses_per_turn = Some(pulses);
        self
    }

    /// Adds a slide that it moves.
    pub fn with_slide(mut self, slide: Slide) -> Self {
        self.slide = Some(slide);
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let known = ["top_speed", "time_constant", "load", "pulses_per_turn", "slide"];
        let keys = Keys::of(value, MOTOR, &known)?;
        let default = Self::default();
        Ok(Self {
            top_speed: keys.or("top_speed", default.top_speed, number)?,
            time_constant: keys.or("time_constant", default.time_constant, number)?,
            load: keys.or("load", default.load, number)?,
            pulses_per_turn: keys.optional("pulses_per_turn", number)?,
            slide: keys.optional("slide", Slide::read)?,
        })
    }

    pub(super) fn check(&self) -> Checked {
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

/// A slide that a motor moves between two stops. Forward is towards its end.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Slide {
    /// The way between the stops.
    pub travel: Travel,
    /// Its position at the start, in the unit of [`travel`](Self::travel), from 0 to its length.
    pub position: f64,
    /// The switch that it presses at its start, in the first hundredth of its travel.
    pub start_switch: Option<Input>,
    /// The switch that it presses at its end, in the last hundredth of its travel.
    pub end_switch: Option<Input>,
    /// The ultrasonic sensor that looks at it.
    pub seen_by: Option<SeenBy>,
}

impl Slide {
    /// A slide at position 0, without switches and without a sensor that looks at it.
    pub fn new(travel: Travel) -> Self {
        Self { travel, position: 0.0, start_switch: None, end_switch: None, seen_by: None }
    }

    /// Sets the position at the start, in the unit of its travel, from 0 to its length.
    pub fn with_position(mut self, position: f64) -> Self {
        self.position = position;
        self
    }

    /// Sets the input of the switch at its start. A switch has to be plugged in there.
    pub fn with_start_switch(mut self, input: Input) -> Self {
        self.start_switch = Some(input);
        self
    }

    /// Sets the input of the switch at its end. A switch has to be plugged in there.
    pub fn with_end_switch(mut self, input: Input) -> Self {
        self.end_switch = Some(input);
        self
    }

    /// Sets the ultrasonic sensor that looks at it.
    pub fn with_seen_by(mut self, seen_by: SeenBy) -> Self {
        self.seen_by = Some(seen_by);
        self
    }

    fn read(value: &DeValue<'_>) -> Read<Self> {
        let known = ["travel", "position", START_SWITCH, END_SWITCH, SEEN_BY];
        let keys = Keys::of(value, SLIDE, &known)?;
        Ok(Self {
            travel: keys.required("travel", Travel::read)?,
            position: keys.or("position", 0.0, number)?,
            start_switch: keys.optional(START_SWITCH, terminal_value(&Input::ALL))?,
            end_switch: keys.optional(END_SWITCH, terminal_value(&Input::ALL))?,
            seen_by: keys.optional(SEEN_BY, SeenBy::read)?,
        })
    }

    /// The inputs that it moves, each with its key.
    pub(super) fn moved_inputs(&self) -> impl Iterator<Item = (&'static str, Input)> {
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

/// The length of a slide's travel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Travel {
    /// In pulses of the motor's encoder, more than 0.
    Pulses(f64),
    /// In millimetres.
    Mm {
        /// The length, more than 0.
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

    fn read(value: &DeValue<'_>) -> Read<Self> {
        match only(value, TRAVEL)? {
            ("pulses", value) => at("pulses", number(value).map(Self::Pulses)),
            ("mm", value) => at("mm", Self::read_mm(value)),
            (name, _) => at(name, Err(Mistake::new("there is no such unit; there are pulses, mm"))),
        }
    }

    fn read_mm(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, MM, &["length", "per_turn"])?;
        Ok(Self::Mm {
            length: keys.required("length", number)?,
            per_turn: keys.required("per_turn", number)?,
        })
    }

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

/// An ultrasonic sensor that looks at a slide. Its distance changes evenly between start and end. It needs
/// no other fields, so it is closed on purpose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenBy {
    /// Where the sensor is plugged in.
    pub input: Input,
    /// The distance when the slide is at its start, in cm, at least 0.
    pub start_cm: f64,
    /// The distance when the slide is at its end, in cm, at least 0.
    pub end_cm: f64,
}

impl SeenBy {
    fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, SEEN_BY_TABLE, &["input", "start_cm", "end_cm"])?;
        Ok(Self {
            input: keys.required("input", terminal_value(&Input::ALL))?,
            start_cm: keys.required("start_cm", number)?,
            end_cm: keys.required("end_cm", number)?,
        })
    }
}
