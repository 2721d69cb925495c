//! Places where workpieces can be, and the sensors that look at them, as plain data.

use ft_transfer_area::tx::{Counter, Input, Motor};
use toml::de::DeValue;

use super::drawn::{point, Point};
use super::mistake::Mistake;
use super::piece::Piece;
use super::plug::{named, plug, Plug};
use super::read::{number, text, Keys, Read};

pub(super) const PLACE: &str = "expected a place, as in { name = \"storage\" }";

/// A place for one workpiece: somewhere on the table, on a belt, or where the seat of a slide stops.
///
/// Belts, ejectors and grippers carry workpieces from place to place.
///
/// ```
/// use ft_transfer_area_simulator::world::{Piece, Place};
/// use ft_transfer_area::tx::{Input, Motor};
///
/// let entry = Place::new("entry").position(Motor::M1, 15.0).barrier(Input::I1);
/// let storage = Place::new("storage").piece(Piece::White);
/// assert_eq!((entry.at, storage.on), (15.0, None));
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Place {
    /// Its name. Each place of a world has a different one.
    pub name: String,
    /// The motor whose belt it is on, or whose slide has its seat here; `None` for a place that does
    /// not move.
    pub on: Option<Plug<Motor>>,
    /// Where it is on the belt, in mm from its start, or which position of the slide it is, in the unit of
    /// its travel.
    pub at: f64,
    /// How far from there the middle of a workpiece on the belt, or the slide, may be, in the same unit,
    /// more than 0; `None` for 13.5 mm on a belt, and for a fiftieth of the travel of a slide.
    pub reach: Option<f64>,
    /// The light barrier that a piece here interrupts.
    pub barrier: Option<Barrier>,
    /// The colour sensor that looks at it. A colour sensor has to be plugged in there.
    pub colour: Option<Plug<Input>>,
    /// What is here at the start.
    pub piece: Option<Piece>,
    /// The workpiece in the container that is here at the start.
    pub content: Option<Piece>,
    /// Where pages draw it, if it does not move; `None` for where a gripper reaches it that is drawn, or only in their
    /// lists.
    pub drawn: Option<Point>,
}

/// Where the photo transistor of a light barrier is plugged in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Barrier {
    /// An input that has a photo transistor.
    Input(Plug<Input>),
    /// A counter input that no encoder uses. Its level is 1 with light.
    Counter(Plug<Counter>),
}

impl Place {
    /// A place that does not move, with nothing there.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            on: None,
            at: 0.0,
            reach: None,
            barrier: None,
            colour: None,
            piece: None,
            content: None,
            drawn: None,
        }
    }

    /// Sets the motor whose belt or slide it is on, and where.
    pub fn position(mut self, motor: impl Into<Plug<Motor>>, at: f64) -> Self {
        (self.on, self.at) = (Some(motor.into()), at);
        self
    }

    /// Sets how far from there the middle of a workpiece, or the slide, may be.
    pub fn reach(mut self, reach: f64) -> Self {
        self.reach = Some(reach);
        self
    }

    /// Adds a light barrier on an input. A photo transistor has to be plugged in there.
    pub fn barrier(mut self, input: impl Into<Plug<Input>>) -> Self {
        self.barrier = Some(Barrier::Input(input.into()));
        self
    }

    /// Adds a light barrier on a counter input that no encoder uses.
    pub fn counter_barrier(mut self, counter: impl Into<Plug<Counter>>) -> Self {
        self.barrier = Some(Barrier::Counter(counter.into()));
        self
    }

    /// Adds a colour sensor. One has to be plugged in there.
    pub fn colour(mut self, input: impl Into<Plug<Input>>) -> Self {
        self.colour = Some(input.into());
        self
    }

    /// Sets what is here at the start.
    pub fn piece(mut self, piece: Piece) -> Self {
        self.piece = Some(piece);
        self
    }

    /// Puts a workpiece into the container that is here at the start.
    pub fn content(mut self, piece: Piece) -> Self {
        self.content = Some(piece);
        self
    }

    /// Sets where pages draw it: mm to the right and downwards.
    pub fn drawn(mut self, drawn: Point) -> Self {
        self.drawn = Some(drawn);
        self
    }

    /// The inputs of its sensors, each with its key and the kind of sensor that has to be there.
    pub(super) fn inputs(&self) -> impl Iterator<Item = (&'static str, Plug<Input>, &'static str)> {
        let barrier = match self.barrier {
            Some(Barrier::Input(input)) => Some(("barrier", input, "photo_transistor")),
            Some(Barrier::Counter(_)) | None => None,
        };
        let colour = self.colour.map(|input| ("colour", input, "colour"));
        [barrier, colour].into_iter().flatten()
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let known = ["name", "on", "at", "reach", "barrier", "colour", "piece", "content", "drawn"];
        let keys = Keys::of(value, PLACE, &known)?;
        let on = keys.optional("on", plug(&Motor::ALL))?;
        Ok(Self {
            name: keys.required("name", text)?,
            at: if on.is_some() {
                keys.required("at", number)?
            } else {
                keys.or("at", 0.0, number)?
            },
            on,
            reach: keys.optional("reach", number)?,
            barrier: keys.optional("barrier", Barrier::read)?,
            colour: keys.optional("colour", plug(&Input::ALL))?,
            piece: keys.optional("piece", Piece::read)?,
            content: keys.optional("content", Piece::read)?,
            drawn: keys.optional("drawn", point)?,
        })
    }
}

impl Barrier {
    fn read(value: &DeValue<'_>) -> Read<Self> {
        let Some(name) = value.as_str() else {
            return Err(Mistake::new("expected a name, as in \"I1\", \"E1.I1\" or \"C4\""));
        };
        let terminal = name.rsplit('.').next().unwrap_or(name);
        if terminal.starts_with('C') {
            return named(&Counter::ALL, name).map(Self::Counter);
        }
        named(&Input::ALL, name).map(Self::Input)
    }
}
