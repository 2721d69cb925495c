//! What is plugged into a simulated TXT: sensors, motors, lamps, buttons, remotes.
//!
//! A [`World`] describes the start. It [comes with the library](World::shipped), is [built in
//! code](World::new), or is read from a file ([`docs/simulator.md`](https://docs.rs/ft-transfer-area/latest/ft_transfer_area/guide/simulator/) has every key).
//! It is [given](super::SimulatedTxtBuilder::world) to a simulated TXT or to a
//! [machine](super::Machine::with_world) that a test steps. From then on the [`WorldState`] has the
//! present state.
//!
//! ```
//! use std::time::Duration;
//!
//! use ft_transfer_area_simulator::world::World;
//! use ft_transfer_area_simulator::Machine;
//! use ft_transfer_area::prelude::*;
//! use ft_transfer_area::wire::ExchangeData;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut machine = Machine::with_world(0, World::shipped("slide")?)?;
//! machine.set_outputs(0, ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..Default::default() });
//! machine.step(Duration::from_secs(10)); // of machine time, without waiting
//! assert_eq!(machine.controllers[0].uni[1], 1, "the slide presses its end switch");
//! let slide = machine.world().and_then(|world| world.slide(0, M1));
//! assert_eq!(slide, Some(1000.0));
//! # Ok(())
//! # }
//! ```
//!
//! # How it moves
//!
//! Time is machine time in ticks of one millisecond. So the same outputs at the same times give the same
//! world, in steps of any length. The control of the motors checks its counters
//! in every tick. It is the same without a world, where each motor output has an ideal motor:
//!
//! * Near the end of a distance it lets the motor turn more and more slowly, and it brakes when the
//!   distance is counted. The count ends there or later, never earlier; from then on the id is
//!   reported as done. With up to 1000 pulses per second and a [time
//!   constant](MotorModel::time_constant) of up to 0.1 s the count ends up to 3 pulses later, if the
//!   motor stood still before or had 0.2 s to slow down.
//! * A motor with a [`run_out`](MotorModel::run_out) is not slowed down before the end, and turns on behind it: with 5
//!   pulses, 63 pulses end at 67 or 68 at full speed, and at 64 or 65 at five eighths of it. So users report it of real
//!   motors. The id is reported as done when the distance is counted, before the motor stands. With 0 it stops exactly.
//! * Of two synchronised motors it slows down the one that is ahead, or will be in 0.02 s, by a
//!   quarter of its duty for each pulse. A leader waits for its slowest follower, also for one that is
//!   blocked or switched off, but not for one that has finished its distance. Motors that start together and give up to
//!   200 pulses per second stay within 6 pulses under any load, with time constants of up to 0.05 s,
//!   and within 11 with up to 0.1 s.
//! * A positive injected error slows the follower down until its leader is so many pulses ahead, a negative one slows the
//!   leader down. With more than 16 pulses left, that motor stands; with 8 left, it turns at half the speed of the other
//!   one. While the leader stays the same, errors add up. Such a command is never done.
//! * Motors that follow each other in a circle stay together and go on.
//! * A motor that has finished its distance is held until its next command. A counter reset during a distance moves its
//!   end on.
//! * A motor without an encoder counts nothing, so its distances never end, and a motor that is
//!   synchronised with it stops after a few pulses. The machine's
//!   [oddities](super::Machine::oddities) report a command that needs its count.
//!
//! # Workpieces
//!
//! A world may have [places](Place), and [belts](Belt), [ejectors](Ejector) and [grippers](Gripper) that
//! carry [workpieces](Piece) between them. Light barriers and colour sensors see them. A [`Factory`] has
//! several controllers that share the workpieces.
//! [`docs/worlds.md`](https://docs.rs/ft-transfer-area/latest/ft_transfer_area/guide/worlds/) describes these parts.
//!
//! # What is assumed
//!
//! How the real controller brakes, and how strongly it slows a motor down, is not described anywhere;
//! the figures are assumed.

mod belt;
mod board;
mod check;
mod drawn;
mod factory;
mod file;
pub(crate) mod floor;
mod gripper;
mod i2c_device;
mod ideal;
mod input;
mod lamp;
mod mishap;
mod mistake;
mod motor_model;
mod piece;
mod place;
mod plug;
mod read;
mod remote;
mod script;
mod sensor;
mod shaft;
mod shipped;
mod slide;
mod state;
mod supply;

pub use belt::{Belt, Ejector};
pub use board::Board;
pub use drawn::{Drawn, Point};
pub use factory::Factory;
pub use floor::Whereabouts;
use ft_transfer_area::tx::{Input, Motor};
pub use gripper::{Grip, Gripper, GripperPosition};
pub use i2c_device::I2cDevice;
pub(crate) use ideal::IdealMotors;
pub use lamp::LampColour;
pub use mishap::Mishap;
use mistake::Mistake;
pub use motor_model::MotorModel;
pub use piece::Piece;
pub use place::{Barrier, Place};
pub use plug::Plug;
use read::{list, Keys, Read};
pub use remote::Remote;
pub use script::{Script, ScriptAction, ScriptEvent};
pub use sensor::{Contact, Sensor, SensorValue};
pub use slide::{AxisSwitch, SeenBy, Slide, Travel};
pub use state::WorldState;
pub use supply::Supply;
use toml::de::DeTable;

/// What is plugged in where, at the start.
///
/// The default has something for each sample of this crate: encoder motors on M1 and M2, a slide on
/// M3, buttons on I1 and I3 that a script presses, an ultrasonic sensor on I2, the slide's end
/// switches on I4 and I5, lamps on O7 and O8, and an extension with a button, a sensor and a motor.
/// [`docs/simulator.md`](https://docs.rs/ft-transfer-area/latest/ft_transfer_area/guide/simulator/) has a drawing. An empty one is [`World::new`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct World {
    /// What is plugged into the master.
    pub master: Board,
    /// What is plugged into the extensions, in order. At most 8. Those that the machine does not
    /// have are left out.
    pub extensions: Vec<Board>,
    /// What happens at which time, such as a pressed button.
    pub script: Script,
    /// Up to four infrared remotes with different switch settings.
    pub remotes: Vec<Remote>,
    /// I2C devices with different addresses.
    pub i2c: Vec<I2cDevice>,
    /// Places for workpieces, with different names.
    pub places: Vec<Place>,
    /// What pushes workpieces from place to place.
    pub ejectors: Vec<Ejector>,
    /// What carries workpieces from place to place, with different names.
    pub grippers: Vec<Gripper>,
    /// What the master measures of itself.
    pub supply: Supply,
}

impl Default for World {
    /// [`World::shipped`] with the name `default`.
    fn default() -> Self {
        // A test reads each shipped world.
        Self::shipped("default").expect("the shipped worlds are right")
    }
}

/// What takes worlds with several controllers.
const FACTORY_ONLY: &str = "only the command txt simulate and a Factory take them";

const EXTENSIONS: &str = "expected double brackets, as in [[extensions]]";
const REMOTES: &str = "expected double brackets, as in [[remotes]]";
const I2C: &str = "expected double brackets, as in [[i2c]]";
const PLACES: &str = "expected double brackets, as in [[places]]";
const EJECTORS: &str = "expected double brackets, as in [[ejectors]]";
const GRIPPERS: &str = "expected double brackets, as in [[grippers]]";

impl World {
    /// An empty world: a master with nothing plugged in.
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::{Board, MotorModel, Sensor, World};
    /// use ft_transfer_area_simulator::Machine;
    /// use ft_transfer_area::prelude::*;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let master = Board::default()
    ///     .input(I1, Sensor::BUTTON)
    ///     .motor(M1, MotorModel::encoder_motor().load(0.2));
    /// let machine = Machine::with_world(0, World::new().master(master))?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn new() -> Self {
        Self {
            master: Board::default(),
            extensions: Vec::new(),
            script: Script::default(),
            remotes: Vec::new(),
            i2c: Vec::new(),
            places: Vec::new(),
            ejectors: Vec::new(),
            grippers: Vec::new(),
            supply: Supply::default(),
        }
    }

    /// Plugs this into the master.
    pub fn master(mut self, board: Board) -> Self {
        self.master = board;
        self
    }

    /// Adds an extension with this plugged in.
    pub fn extension(mut self, board: Board) -> Self {
        self.extensions.push(board);
        self
    }

    /// Sets the script.
    pub fn script(mut self, script: Script) -> Self {
        self.script = script;
        self
    }

    /// Adds an infrared remote.
    pub fn remote(mut self, remote: Remote) -> Self {
        self.remotes.push(remote);
        self
    }

    /// Adds an I2C device.
    pub fn i2c(mut self, device: I2cDevice) -> Self {
        self.i2c.push(device);
        self
    }

    /// Adds a place for workpieces.
    pub fn place(mut self, place: Place) -> Self {
        self.places.push(place);
        self
    }

    /// Adds an ejector.
    pub fn ejector(mut self, ejector: Ejector) -> Self {
        self.ejectors.push(ejector);
        self
    }

    /// Adds a gripper.
    pub fn gripper(mut self, gripper: Gripper) -> Self {
        self.grippers.push(gripper);
        self
    }

    /// Sets what the master measures of itself.
    pub fn supply(mut self, supply: Supply) -> Self {
        self.supply = supply;
        self
    }

    /// What is plugged into the controller with this index (0 the master).
    fn board(&self, controller: usize) -> Option<&Board> {
        match controller.checked_sub(1) {
            None => Some(&self.master),
            Some(extension) => self.extensions.get(extension),
        }
    }

    /// The motor that is plugged in here.
    fn motor(&self, motor: Plug<Motor>) -> Option<&MotorModel> {
        self.board(motor.controller)?.motors.get(&motor.terminal)
    }

    /// The sensor that is plugged in here.
    fn sensor(&self, input: Plug<Input>) -> Option<&Sensor> {
        self.board(input.controller)?.inputs.get(&input.terminal)
    }

    fn read(table: &DeTable<'_>) -> Read<Self> {
        if table.contains_key("controllers") {
            let reason = format!("there are several controllers, and {FACTORY_ONLY}");
            return Err(Mistake::new(reason).within("controllers"));
        }
        Self::read_keys(&Keys::of_table(table, &Self::KEYS)?)
    }

    /// The keys of a world.
    const KEYS: [&'static str; 9] = [
        "master",
        "extensions",
        "script",
        "remotes",
        "i2c",
        "places",
        "ejectors",
        "grippers",
        "supply",
    ];

    fn read_keys(keys: &Keys<'_, '_>) -> Read<Self> {
        Ok(Self {
            master: keys.or("master", Board::default(), Board::read)?,
            extensions: keys.or("extensions", Vec::new(), list(EXTENSIONS, Board::read))?,
            script: keys.or("script", Script::default(), Script::read)?,
            remotes: keys.or("remotes", Vec::new(), list(REMOTES, Remote::read))?,
            i2c: keys.or("i2c", Vec::new(), list(I2C, I2cDevice::read))?,
            places: keys.or("places", Vec::new(), list(PLACES, Place::read))?,
            ejectors: keys.or("ejectors", Vec::new(), list(EJECTORS, Ejector::read))?,
            grippers: keys.or("grippers", Vec::new(), list(GRIPPERS, Gripper::read))?,
            supply: keys.or("supply", Supply::default(), Supply::read)?,
        })
    }
}
