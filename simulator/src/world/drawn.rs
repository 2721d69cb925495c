//! Where pages draw the parts of a world, as plain data. It changes nothing in what they do.

use toml::de::DeValue;

use super::mistake::{at, expect, in_range, Checked, Mistake};
use super::read::{list, number, Keys, Read};

const DRAWN: &str = "expected a table, as in drawn = { from = [20, 60], to = [310, 60] }";
const POINT: &str = "expected two numbers, as in [20, 60]";

/// The most mm to the right or downwards. A drawing is as wide as a page, whatever its size.
const FARTHEST: f64 = 2000.0;

/// A point of a drawing: so many mm to the right and downwards, 0 to 2000 each.
pub type Point = [f64; 2];

/// Where the belt, the slide or the wheel of a motor is drawn.
///
/// ```
/// use ft_transfer_area_simulator::world::Drawn;
///
/// let turntable = Drawn::new([100.0, 100.0], [100.0, 40.0]).turn(180.0);
/// assert_eq!(turntable.turn, 180.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Drawn {
    /// Where it is at the start of the belt, or of the travel of the slide; around what it turns.
    pub from: Point,
    /// Where it is at the end; if it turns, at the start of its travel. The same for a motor without a belt or a
    /// slide.
    pub to: Point,
    /// How many degrees a slide turns clockwise over its travel, -360 to 360; 0 for one that moves along a line.
    pub turn: f64,
}

impl Drawn {
    /// A line from one point to another.
    pub fn new(from: Point, to: Point) -> Self {
        Self { from, to, turn: 0.0 }
    }

    /// Lets a slide turn around the first point, by this many degrees clockwise over its travel.
    pub fn turn(mut self, degrees: f64) -> Self {
        self.turn = degrees;
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, DRAWN, &["from", "to", "turn"])?;
        let from = keys.required("from", point)?;
        Ok(Self { from, to: keys.or("to", from, point)?, turn: keys.or("turn", 0.0, number)? })
    }

    /// Checks it for a motor with a belt or a slide, or with neither.
    pub(super) fn check(&self, has_belt: bool, has_slide: bool) -> Checked {
        check_point("from", &self.from)?;
        check_point("to", &self.to)?;
        in_range("turn", self.turn, -360.0..=360.0)?;
        let is_line = self.from != self.to || !(has_belt || has_slide);
        at("to", expect(is_line, || String::from("expected another point than from")))?;
        let reason = || String::from("it needs a slide of the motor");
        at("turn", expect(self.turn == 0.0 || has_slide, reason))
    }
}

pub(super) fn point(value: &DeValue<'_>) -> Read<Point> {
    let numbers = list(POINT, number)(value)?;
    numbers.try_into().map_err(|_| Mistake::new(POINT))
}

pub(super) fn check_point(name: &str, point: &Point) -> Checked {
    let numbers = ["0", "1"].into_iter().zip(point);
    let checked = numbers.map(|(index, mm)| in_range(index, *mm, 0.0..=FARTHEST));
    at(name, checked.collect())
}
