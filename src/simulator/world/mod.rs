//! What is plugged into a simulated TXT: sensors, motors, lamps, buttons, remotes.
//!
//! A [`World`] says what there is at the start. It is built in code from plain structs, or read
//! from a file (`docs/simulator.md` in the repository has every key), and
//! [given](super::SimulatedTxtBuilder::world) to a simulated TXT or to a
//! [machine](super::Machine::with_world) that a test steps. From then on the
//! [`WorldState`] tells where everything is.
//!
//! ```
//! use std::time::Duration;
//!
//! use ft_transfer_area::simulator::world::World;
//! use ft_transfer_area::simulator::Machine;
//! use ft_transfer_area::tx::Motor;
//! use ft_transfer_area::wire::ExchangeData;
//!
//! # fn main() -> Result<(), ft_transfer_area::Error> {
//! let mut machine = Machine::with_world(0, World::default())?;
//! machine.set_outputs(0, ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..Default::default() });
//! machine.step(Duration::from_secs(10)); // of machine time, at once
//! assert_eq!(machine.controllers[0].uni[1], 1, "the slide presses its end switch");
//! let slide = machine.world().and_then(|world| world.slide(0, Motor::M1));
//! assert_eq!(slide, Some(1000.0));
//! # Ok(())
//! # }
//! ```
//!
//! # How it moves
//!
//! Time is machine time and goes in ticks of one millisecond, so the same outputs give the same
//! world however long it takes, and whether a step is long or short. The control of the motors looks
//! at its counters in every tick:
//!
//! * Towards the end of a distance it lets the motor turn ever slower, and brakes when the distance
//!   is counted. The count ends there or later, never before, and the id is reported as done from
//!   then on. Up to 1000 pulses per second and a [time constant](MotorModel::time_constant) of
//!   0.1 s it ends up to 3 pulses later, if the motor stood still before or had 0.2 s to slow down
//!   in.
//! * Of two synchronised motors it slows down the one that is ahead or will be in 0.02 s, by a
//!   quarter of its duty for each pulse. A leader waits for the slowest of its followers. One that
//!   is switched off, or that has done its distance, is not waited for. Those that begin together
//!   and give up to 200 pulses per second stay within 6 pulses under any load, with time constants
//!   of up to 0.05 s, and within 11 with up to 0.1 s.
//! * An injected error is added to the difference between the two. While the leader stays the same
//!   errors add up, and what is not made up for yet is not lost.
//! * A motor that has done its distance is held until its next command.
//! * A motor without an encoder counts nothing, so its distances never end, and a motor that is
//!   synchronised with it comes to stand after a few. The machine's
//!   [oddities](super::Machine::oddities) tell of a command that needs its count.
//!
//! How the real controller brakes and how strongly it intervenes is not described anywhere; the
//! figures are assumed.

mod board;
mod check;
mod file;
mod motor_model;
mod remote;
mod sensor;
mod shaft;
mod shape;
mod state;

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

use crate::terminals::{Input, Motor, Output};

pub use motor_model::{MotorModel, SeenBy, Slide, Travel};
pub use remote::Remote;
pub use sensor::{Contact, Sensor};
pub use state::WorldState;

/// What is plugged in where, at the start.
///
/// The default is a slide on M1 with end switches on I1 and I2, a button on I3, an ultrasonic
/// sensor on I4 that looks at the slide, and a lamp on O7; `docs/simulator.md` has a drawing. An
/// empty one is `World::from_toml("")`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// What is plugged into the master.
    #[serde(default)]
    pub master: Board,
    /// What is plugged into the extensions, the first one's first. At most 8; those that the
    /// machine has not are left out.
    #[serde(default)]
    pub extensions: Vec<Board>,
    /// Who presses which button when.
    #[serde(default)]
    pub script: Script,
    /// Up to four infrared remotes with different switch settings.
    #[serde(default)]
    pub remotes: Vec<Remote>,
}

/// What is plugged into one controller.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Board {
    /// The sensors. On the other inputs there is nothing.
    pub inputs: BTreeMap<Input, Sensor>,
    /// The motors.
    pub motors: BTreeMap<Motor, MotorModel>,
    /// The lamps, on terminals that no motor uses.
    pub lamps: BTreeSet<Output>,
}

/// Who presses which button when.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Script {
    /// After so many seconds it begins again, at least 0.001; `None` when it is played once.
    pub period: Option<f64>,
    /// What happens, in any order.
    pub events: Vec<ScriptEvent>,
}

/// A button is pressed or let go.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "an event, as in { at = 1, input = \"I3\", pressed = true }"
)]
pub struct ScriptEvent {
    /// When, in seconds of machine time since the start or since the script began again; at least
    /// 0, and less than the period. To the millisecond.
    pub at: f64,
    /// The controller: 0 the master, 1..=8 an extension.
    #[serde(default)]
    pub controller: usize,
    /// Where the button or switch is plugged in.
    pub input: Input,
    /// Whether it is pressed from then on, or let go.
    pub pressed: bool,
}

impl Default for World {
    fn default() -> Self {
        let slide = Slide {
            travel: Travel::Pulses(1000.0),
            position: 500.0,
            start_switch: Some(Input::I1),
            end_switch: Some(Input::I2),
            seen_by: Some(SeenBy { input: Input::I4, start_cm: 5.0, end_cm: 25.0 }),
        };
        let motor = MotorModel { load: 0.1, slide: Some(slide), ..MotorModel::with_encoder() };
        let master = Board {
            inputs: BTreeMap::from([
                (Input::I1, Sensor::SWITCH),
                (Input::I2, Sensor::SWITCH),
                (Input::I3, Sensor::BUTTON),
                (Input::I4, Sensor::Ultrasonic { cm: 15.0 }),
            ]),
            motors: BTreeMap::from([(Motor::M1, motor)]),
            lamps: BTreeSet::from([Output::O7]),
        };
        Self { master, extensions: Vec::new(), script: Script::default(), remotes: Vec::new() }
    }
}

impl World {
    /// What is plugged into the controller with this index (0 the master).
    fn board(&self, controller: usize) -> Option<&Board> {
        match controller.checked_sub(1) {
            None => Some(&self.master),
            Some(extension) => self.extensions.get(extension),
        }
    }
}
