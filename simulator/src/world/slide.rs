//! Slides and what they press, as plain data.

use ft_transfer_area::tx::Input;
use toml::de::DeValue;

use super::mistake::{at, each, in_range, not_negative, positive, Checked, Mistake};
use super::plug::CONTROLLERS;
use super::read::{list, number, only, terminal_value, whole, Keys, Read};

const SLIDE: &str = "expected a slide, as in slide = { travel = { pulses = 1000 } }";
const TRAVEL: &str = "expected one length, as in travel = { pulses = 1000 }";
const MM: &str = "expected a table, as in travel = { mm = { length = 120, per_turn = 4.5 } }";
const SEEN_BY_TABLE: &str = "expected a table, as in { input = \"I4\", start_cm = 5, end_cm = 25 }";
const SWITCH_LIST: &str = "expected a list, as in switches = [{ input = \"I2\", at = 500 }]";
const SWITCH: &str = "expected a switch, as in { input = \"I2\", at = 500 }";

const START_SWITCH: &str = "start_switch";
const END_SWITCH: &str = "end_switch";
pub(super) const SEEN_BY: &str = "seen_by";
pub(super) const SWITCHES: &str = "switches";

/// A switch along the travel is pressed in this part of it, unless its width is set.
const SWITCH_WIDTH: f64 = 0.02;

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
    /// More switches that it presses, anywhere along its travel.
    pub switches: Vec<AxisSwitch>,
}

impl Slide {
    /// A slide at position 0, without switches and without a sensor that looks at it.
    pub fn new(travel: Travel) -> Self {
        Self {
            travel,
            position: 0.0,
            start_switch: None,
            end_switch: None,
            seen_by: None,
            switches: Vec::new(),
        }
    }

    /// Sets the position at the start, in the unit of its travel, from 0 to its length.
    pub fn position(mut self, position: f64) -> Self {
        self.position = position;
        self
    }

    /// Sets the input of the switch at its start. A switch has to be plugged in there.
    pub fn start_switch(mut self, input: Input) -> Self {
        self.start_switch = Some(input);
        self
    }

    /// Sets the input of the switch at its end. A switch has to be plugged in there.
    pub fn end_switch(mut self, input: Input) -> Self {
        self.end_switch = Some(input);
        self
    }

    /// Sets the ultrasonic sensor that looks at it.
    pub fn seen_by(mut self, seen_by: SeenBy) -> Self {
        self.seen_by = Some(seen_by);
        self
    }

    /// Adds a switch that it presses somewhere along its travel. A switch has to be plugged in there.
    pub fn switch(mut self, switch: AxisSwitch) -> Self {
        self.switches.push(switch);
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let known = ["travel", "position", START_SWITCH, END_SWITCH, SEEN_BY, SWITCHES];
        let keys = Keys::of(value, SLIDE, &known)?;
        Ok(Self {
            travel: keys.required("travel", Travel::read)?,
            position: keys.or("position", 0.0, number)?,
            start_switch: keys.optional(START_SWITCH, terminal_value(&Input::ALL))?,
            end_switch: keys.optional(END_SWITCH, terminal_value(&Input::ALL))?,
            seen_by: keys.optional(SEEN_BY, SeenBy::read)?,
            switches: keys.or(SWITCHES, Vec::new(), list(SWITCH_LIST, AxisSwitch::read))?,
        })
    }

    /// The inputs of its own controller that it moves, each with its key.
    pub(super) fn moved_inputs(&self) -> impl Iterator<Item = (&'static str, Input)> {
        let inputs = [
            (START_SWITCH, self.start_switch),
            (END_SWITCH, self.end_switch),
            (SEEN_BY, self.seen_by.map(|seen_by| seen_by.input)),
        ];
        inputs.into_iter().filter_map(|(key, input)| Some((key, input?)))
    }

    pub(super) fn check(&self) -> Checked {
        at("travel", self.travel.check())?;
        let length = self.travel.length();
        in_range("position", self.position, 0.0..=length)?;
        each(SWITCHES, &self.switches, |switch| switch.check(length))?;
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

/// A switch somewhere along the travel of a slide.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct AxisSwitch {
    /// Where the switch is plugged in.
    pub input: Input,
    /// The controller that it is plugged into: 0 the master, 1..=8 an extension; `None` for the one
    /// that its motor is plugged into.
    pub controller: Option<usize>,
    /// Where it is, in the unit of the slide's travel, from 0 to its length.
    pub at: f64,
    /// How wide the part of the travel is in which it is pressed, in the unit of the travel, more
    /// than 0; `None` for a fiftieth of the travel.
    pub width: Option<f64>,
}

impl AxisSwitch {
    /// A switch on this input of the motor's own controller, at this place of the travel.
    pub fn new(input: Input, at: f64) -> Self {
        Self { input, controller: None, at, width: None }
    }

    /// Sets the controller that it is plugged into: 0 the master, 1..=8 an extension.
    pub fn controller(mut self, controller: usize) -> Self {
        self.controller = Some(controller);
        self
    }

    /// Sets the width of the part of the travel in which it is pressed, more than 0.
    pub fn width(mut self, width: f64) -> Self {
        self.width = Some(width);
        self
    }

    fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, SWITCH, &["input", "controller", "at", "width"])?;
        Ok(Self {
            input: keys.required("input", terminal_value(&Input::ALL))?,
            controller: keys.optional("controller", whole(0..=CONTROLLERS))?,
            at: keys.required("at", number)?,
            width: keys.optional("width", number)?,
        })
    }

    fn check(&self, length: f64) -> Checked {
        in_range("at", self.at, 0.0..=length)?;
        self.width.map_or(Ok(()), |width| positive("width", width, f64::MAX))
    }

    /// Whether it is pressed by a slide at this position of a travel of this length.
    pub(super) fn is_pressed(&self, position: f64, length: f64) -> bool {
        let width = self.width.unwrap_or(SWITCH_WIDTH * length);
        (position - self.at).abs() <= width / 2.0
    }
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
