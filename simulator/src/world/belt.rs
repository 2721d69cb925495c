//! Belts and ejectors, as plain data.

use ft_transfer_area::tx::Output;
use toml::de::DeValue;

use super::mistake::{positive, Checked};
use super::plug::{plug, Plug};
use super::read::{number, text, Keys, Read};

const BELT: &str = "expected a belt, as in belt = { length = 300, per_turn = 20 }";
pub(super) const EJECTOR: &str =
    "expected an ejector, as in { valve = \"O5\", from = \"exit\", to = \"storage\" }";

/// A belt that a motor drives. Forward is towards its end.
///
/// Workpieces on it keep their distance. At an end without a place they stop, and the belt slips under
/// them. Where it is on and off, see [`Place`](super::Place).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Belt {
    /// Its length in mm, more than 0.
    pub length: f64,
    /// How far one turn of the motor moves it in mm, more than 0.
    pub per_turn: f64,
    /// The place that gets what runs off at its start.
    pub start: Option<String>,
    /// The place that gets what runs off at its end.
    pub end: Option<String>,
}

impl Belt {
    /// A belt of this length in mm, which one turn of its motor moves by this many mm.
    pub fn new(length: f64, per_turn: f64) -> Self {
        Self { length, per_turn, start: None, end: None }
    }

    /// Sets the place that gets what runs off at its start.
    pub fn start(mut self, place: &str) -> Self {
        self.start = Some(place.to_owned());
        self
    }

    /// Sets the place that gets what runs off at its end.
    pub fn end(mut self, place: &str) -> Self {
        self.end = Some(place.to_owned());
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, BELT, &["length", "per_turn", "start", "end"])?;
        Ok(Self {
            length: keys.required("length", number)?,
            per_turn: keys.required("per_turn", number)?,
            start: keys.optional("start", text)?,
            end: keys.optional("end", text)?,
        })
    }

    pub(super) fn check(&self) -> Checked {
        positive("length", self.length, f64::MAX)?;
        positive("per_turn", self.per_turn, f64::MAX)
    }
}

/// A cylinder that pushes what is at one place to another one while its valve is open.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Ejector {
    /// The output of its valve.
    pub valve: Plug<Output>,
    /// The output of the compressor that it needs; `None` if there is always pressure.
    pub compressor: Option<Plug<Output>>,
    /// The place that it empties.
    pub from: String,
    /// The place that gets the piece.
    pub to: String,
}

impl Ejector {
    /// An ejector on this output, from one place to another, with pressure all the time.
    pub fn new(valve: impl Into<Plug<Output>>, from: &str, to: &str) -> Self {
        let (from, to) = (from.to_owned(), to.to_owned());
        Self { valve: valve.into(), compressor: None, from, to }
    }

    /// Sets the output of the compressor that it needs.
    pub fn with_compressor(mut self, output: impl Into<Plug<Output>>) -> Self {
        self.compressor = Some(output.into());
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, EJECTOR, &["valve", "compressor", "from", "to"])?;
        Ok(Self {
            valve: keys.required("valve", plug(&Output::ALL))?,
            compressor: keys.optional("compressor", plug(&Output::ALL))?,
            from: keys.required("from", text)?,
            to: keys.required("to", text)?,
        })
    }
}
