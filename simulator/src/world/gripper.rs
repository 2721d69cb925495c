//! Vacuum grippers and forks, as plain data.

use ft_transfer_area::tx::{Motor, Output};
use toml::de::DeValue;

use super::mistake::{at, not_negative, positive, Checked, Mistake};
use super::plug::{plug, Plug};
use super::read::{list, number, text, Keys, Read};

pub(super) const GRIPPER: &str =
    "expected a gripper, as in { name = \"robot\", axes = [\"M1\"], vacuum = { valve = \"O8\" } }";
const AXES: &str = "expected a list of motors, as in axes = [\"M1\", \"M2\"]";
const POSITIONS: &str = "expected a list, as in positions = [{ place = \"storage\", at = [100] }]";
const POSITION: &str = "expected a position, as in { place = \"storage\", at = [100] }";
const AT: &str = "expected a number for each axis, as in at = [100, 250]";
const VACUUM: &str = "expected a table, as in vacuum = { valve = \"O8\" }";
const FORK: &str = "expected a table, as in fork = { motor = \"M3\" }";

/// How near to a position the axes have to be, unless it is set.
const TOLERANCE: f64 = 20.0;

/// How far a fork lifts or lowers what it takes or puts down, unless it is set.
const LIFT: f64 = 20.0;

/// A gripper that slides carry to places, where it takes and puts down workpieces or containers.
///
/// ```
/// use ft_transfer_area_simulator::world::{Grip, Gripper};
/// use ft_transfer_area::tx::{Motor, Output};
///
/// let grip = Grip::Vacuum {
///     valve: Output::O8.into(),
///     compressor: Some(Output::O7.into()),
///     lower: None,
/// };
/// let robot = Gripper::new("robot", &[Motor::M1.into(), Motor::M2.into()], grip)
///     .position("delivery", &[20.0, 750.0])
///     .position("storage", &[400.0, 800.0]);
/// assert_eq!(robot.positions.len(), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Gripper {
    /// Its name. Each gripper of a world has a different one.
    pub name: String,
    /// The motors whose slides carry it, at least one. The second one of a fork lifts it: towards the
    /// start of its slide is up.
    pub axes: Vec<Plug<Motor>>,
    /// Where it reaches which place. A place may have several positions.
    pub positions: Vec<GripperPosition>,
    /// How far each axis may be from a position, in the unit of its travel, at least 0. The default
    /// is 20.
    pub tolerance: f64,
    /// How it grips.
    pub grip: Grip,
}

/// Where a gripper reaches a place. It needs no other fields, so it is closed on purpose.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperPosition {
    /// The place.
    pub place: String,
    /// The position of each axis, in the unit of its travel.
    pub at: Vec<f64>,
}

/// How a gripper grips.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Grip {
    /// By vacuum: it takes a workpiece while its valve is on, also out of a container, and puts it down, or
    /// lets it fall, when the valve goes off.
    Vacuum {
        /// The output of its valve.
        valve: Plug<Output>,
        /// The output of the compressor that it needs to take something; `None` if there is always
        /// pressure.
        compressor: Option<Plug<Output>>,
        /// The output of the valve that lowers it; `None` if it needs none. It reaches places only
        /// while it is lowered.
        lower: Option<Plug<Output>>,
    },
    /// A fork that takes containers with what is in them: while it is out it takes one when it is lifted,
    /// and puts it down when it is lowered.
    Fork {
        /// The motor whose slide moves it out. It is out in the second half of the travel.
        motor: Plug<Motor>,
        /// How far it has to be lifted or lowered, from where it went out, in the unit of the second
        /// axis, more than 0.
        lift: f64,
    },
}

impl Gripper {
    /// A gripper with these axes, and no position yet.
    pub fn new(name: &str, axes: &[Plug<Motor>], grip: Grip) -> Self {
        Self {
            name: name.to_owned(),
            axes: axes.to_vec(),
            positions: Vec::new(),
            tolerance: TOLERANCE,
            grip,
        }
    }

    /// Adds a position in which it reaches this place: one number for each axis.
    pub fn position(mut self, place: &str, at: &[f64]) -> Self {
        self.positions.push(GripperPosition { place: place.to_owned(), at: at.to_vec() });
        self
    }

    /// Sets how far each axis may be from a position, in the unit of its travel, at least 0.
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let known = ["name", "axes", "positions", "tolerance", "vacuum", "fork"];
        let keys = Keys::of(value, GRIPPER, &known)?;
        let vacuum = keys.optional("vacuum", Grip::read_vacuum)?;
        let fork = keys.optional("fork", Grip::read_fork)?;
        let (Some(grip), None) = (vacuum.or(fork), vacuum.and(fork)) else {
            return Err(Mistake::new("expected either the key vacuum or the key fork"));
        };
        Ok(Self {
            name: keys.required("name", text)?,
            axes: keys.required("axes", list(AXES, plug(&Motor::ALL)))?,
            positions: keys.or("positions", Vec::new(), list(POSITIONS, GripperPosition::read))?,
            tolerance: keys.or("tolerance", TOLERANCE, number)?,
            grip,
        })
    }

    pub(super) fn check(&self) -> Checked {
        not_negative("tolerance", self.tolerance)?;
        match self.grip {
            Grip::Vacuum { .. } => Ok(()),
            Grip::Fork { lift, .. } => at("fork", positive("lift", lift, f64::MAX)),
        }
    }
}

impl GripperPosition {
    fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, POSITION, &["place", "at"])?;
        Ok(Self {
            place: keys.required("place", text)?,
            at: keys.required("at", list(AT, number))?,
        })
    }
}

impl Grip {
    fn read_vacuum(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, VACUUM, &["valve", "compressor", "lower"])?;
        Ok(Self::Vacuum {
            valve: keys.required("valve", plug(&Output::ALL))?,
            compressor: keys.optional("compressor", plug(&Output::ALL))?,
            lower: keys.optional("lower", plug(&Output::ALL))?,
        })
    }

    fn read_fork(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, FORK, &["motor", "lift"])?;
        Ok(Self::Fork {
            motor: keys.required("motor", plug(&Motor::ALL))?,
            lift: keys.or("lift", LIFT, number)?,
        })
    }
}
