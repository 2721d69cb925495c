//! Motors, as plain data.

use toml::de::DeValue;

use super::belt::Belt;
use super::drawn::Drawn;
use super::mistake::{at, expect, in_range, positive, Checked};
use super::read::{number, truth, Keys, Read};
use super::slide::{Slide, Travel};

const MOTOR: &str = "expected a motor, as in M1 = { pulses_per_turn = 63.3 }";

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
    /// The pulses by which it turns on when it is braked at its top speed, 0..=100; at half that speed a quarter, and so
    /// on. A distance then ends so many pulses later, because the controller does not slow the motor down before. `None`
    /// for a motor that is slowed down before the end, and brakes with its time constant. It needs an encoder.
    pub run_out: Option<f64>,
    /// Whether its two wires are swapped, so that it turns the other way.
    pub reversed: bool,
    /// The slide that it moves, if any.
    pub slide: Option<Slide>,
    /// The belt that it drives, if any. A motor has a slide or a belt, not both.
    pub belt: Option<Belt>,
    /// Where pages draw it, its slide or its belt; `None` for a motor that is only in their lists.
    pub drawn: Option<Drawn>,
}

impl Default for MotorModel {
    /// A motor without an encoder, 3 turns per second, 0.05 s of inertia, no load, no run-out, no slide, no belt, not drawn.
    fn default() -> Self {
        Self {
            top_speed: 3.0,
            time_constant: 0.05,
            load: 0.0,
            pulses_per_turn: None,
            run_out: None,
            reversed: false,
            slide: None,
            belt: None,
            drawn: None,
        }
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
    pub fn top_speed(mut self, top_speed: f64) -> Self {
        self.top_speed = top_speed;
        self
    }

    /// Sets the inertia in seconds, 0..=1.
    pub fn time_constant(mut self, seconds: f64) -> Self {
        self.time_constant = seconds;
        self
    }

    /// Sets the load, as a part of the starting torque, 0..=1.
    pub fn load(mut self, load: f64) -> Self {
        self.load = load;
        self
    }

    /// Adds an encoder that gives this many pulses per turn: more than 0, at most 1000.
    pub fn pulses_per_turn(mut self, pulses: f64) -> Self {
        self.pulses_per_turn = Some(pulses);
        self
    }

    /// Lets it turn on by this many pulses when it is braked at its top speed, 0..=100, and not slow down before.
    pub fn run_out(mut self, pulses: f64) -> Self {
        self.run_out = Some(pulses);
        self
    }

    /// Swaps its two wires, so that it turns the other way.
    pub fn wires_swapped(mut self) -> Self {
        self.reversed = !self.reversed;
        self
    }

    /// Adds a slide that it moves.
    pub fn slide(mut self, slide: Slide) -> Self {
        self.slide = Some(slide);
        self
    }

    /// Adds a belt that it drives.
    pub fn belt(mut self, belt: Belt) -> Self {
        self.belt = Some(belt);
        self
    }

    /// Sets where pages draw it, its slide or its belt.
    pub fn drawn(mut self, drawn: Drawn) -> Self {
        self.drawn = Some(drawn);
        self
    }

    const KEYS: [&'static str; 9] = [
        "top_speed",
        "time_constant",
        "load",
        "pulses_per_turn",
        "run_out",
        "reversed",
        "slide",
        "belt",
        "drawn",
    ];

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, MOTOR, &Self::KEYS)?;
        let default = Self::default();
        Ok(Self {
            top_speed: keys.or("top_speed", default.top_speed, number)?,
            time_constant: keys.or("time_constant", default.time_constant, number)?,
            load: keys.or("load", default.load, number)?,
            pulses_per_turn: keys.optional("pulses_per_turn", number)?,
            run_out: keys.optional("run_out", number)?,
            reversed: keys.or("reversed", default.reversed, truth)?,
            slide: keys.optional("slide", Slide::read)?,
            belt: keys.optional("belt", Belt::read)?,
            drawn: keys.optional("drawn", Drawn::read)?,
        })
    }

    pub(super) fn check(&self) -> Checked {
        positive("top_speed", self.top_speed, 100.0)?;
        in_range("time_constant", self.time_constant, 0.0..=1.0)?;
        in_range("load", self.load, 0.0..=1.0)?;
        if let Some(pulses) = self.pulses_per_turn {
            positive("pulses_per_turn", pulses, 1000.0)?;
        }
        if let Some(pulses) = self.run_out {
            in_range("run_out", pulses, 0.0..=100.0)?;
            let reason = || String::from("it needs pulses_per_turn of the motor");
            at("run_out", expect(self.pulses_per_turn.is_some(), reason))?;
        }
        if let Some(belt) = &self.belt {
            let reason = || String::from("expected a belt or a slide of the motor, not both");
            at("belt", expect(self.slide.is_none(), reason).and_then(|()| belt.check()))?;
        }
        if let Some(drawn) = &self.drawn {
            at("drawn", drawn.check(self.belt.is_some(), self.slide.is_some()))?;
        }
        let Some(slide) = &self.slide else { return Ok(()) };
        let in_pulses = matches!(slide.travel, Travel::Pulses(_));
        let countable = !in_pulses || self.pulses_per_turn.is_some();
        let reason = || String::from("a travel in pulses needs pulses_per_turn of the motor");
        at("slide", at("travel", expect(countable, reason)).and_then(|()| slide.check()))
    }
}
