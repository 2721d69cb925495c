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
//! use ft_transfer_area::tx::Motor;
//! use ft_transfer_area::wire::ExchangeData;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut machine = Machine::with_world(0, World::shipped("slide")?)?;
//! machine.set_outputs(0, ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..Default::default() });
//! machine.step(Duration::from_secs(10)); // of machine time, without waiting
//! assert_eq!(machine.controllers[0].uni[1], 1, "the slide presses its end switch");
//! let slide = machine.world().and_then(|world| world.slide(0, Motor::M1));
//! assert_eq!(slide, Some(1000.0));
//! # Ok(())
//! # }
//! ```
//!
//! # How it moves
//!
//! Time is machine time in ticks of one millisecond. So the same outputs at the same times give the same
//! world, in steps of any length. The control of the motors checks its counters
//! in every tick:
//!
//! * Near the end of a distance it lets the motor turn more and more slowly, and it brakes when the
//!   distance is counted. The count ends there or later, never earlier; from then on the id is
//!   reported as done. With up to 1000 pulses per second and a [time
//!   constant](MotorModel::time_constant) of up to 0.1 s the count ends up to 3 pulses later, if the
//!   motor stood still before or had 0.2 s to slow down.
//! * Of two synchronised motors it slows down the one that is ahead, or will be in 0.02 s, by a
//!   quarter of its duty for each pulse. A leader waits for its slowest follower, but not for one
//!   that is switched off or has finished its distance. Motors that start together and give up to
//!   200 pulses per second stay within 6 pulses under any load, with time constants of up to 0.05 s,
//!   and within 11 with up to 0.1 s.
//! * An injected error is added to the difference between the two. While the leader stays the same,
//!   errors add up, and the part that is not made up for yet is kept.
//! * A motor that has finished its distance is held until its next command.
//! * A motor without an encoder counts nothing, so its distances never end, and a motor that is
//!   synchronised with it stops after a few pulses. The machine's
//!   [oddities](super::Machine::oddities) report a command that needs its count.
//!
//! How the real controller brakes, and how strongly it slows a motor down, is not described anywhere;
//! the figures are assumed.

mod board;
mod file;
mod i2c_device;
mod input;
mod mistake;
mod motor_model;
mod read;
mod remote;
mod script;
mod sensor;
mod shaft;
mod shipped;
mod state;

pub use board::Board;
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
pub use i2c_device::I2cDevice;
use mistake::{at, each, expect, Checked};
pub use motor_model::{MotorModel, SeenBy, Slide, Travel};
use read::{list, Keys, Read};
pub use remote::Remote;
pub use script::{Script, ScriptAction, ScriptEvent};
pub use sensor::{Contact, Sensor, SensorValue};
pub use state::WorldState;
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
}

impl Default for World {
    /// [`World::shipped`] with the name `default`.
    fn default() -> Self {
        // A test reads each shipped world.
        Self::shipped("default").expect("the shipped worlds are right")
    }
}

const EXTENSIONS: &str = "expected double brackets, as in [[extensions]]";
const REMOTES: &str = "expected double brackets, as in [[remotes]]";
const I2C: &str = "expected double brackets, as in [[i2c]]";

impl World {
    /// An empty world: a master with nothing plugged in.
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::{Board, MotorModel, Sensor, World};
    /// use ft_transfer_area_simulator::Machine;
    /// use ft_transfer_area::tx::{Input, Motor};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let master = Board::default()
    ///     .with_input(Input::I1, Sensor::BUTTON)
    ///     .with_motor(Motor::M1, MotorModel::encoder_motor().with_load(0.2));
    /// let machine = Machine::with_world(0, World::new().with_master(master))?;
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
        }
    }

    /// Plugs this into the master.
    pub fn with_master(mut self, board: Board) -> Self {
        self.master = board;
        self
    }

    /// Adds an extension with this plugged in.
    pub fn with_extension(mut self, board: Board) -> Self {
        self.extensions.push(board);
        self
    }

    /// Sets the script.
    pub fn with_script(mut self, script: Script) -> Self {
        self.script = script;
        self
    }

    /// Adds an infrared remote.
    pub fn with_remote(mut self, remote: Remote) -> Self {
        self.remotes.push(remote);
        self
    }

    /// Adds an I2C device.
    pub fn with_i2c(mut self, device: I2cDevice) -> Self {
        self.i2c.push(device);
        self
    }

    /// What is plugged into the controller with this index (0 the master).
    fn board(&self, controller: usize) -> Option<&Board> {
        match controller.checked_sub(1) {
            None => Some(&self.master),
            Some(extension) => self.extensions.get(extension),
        }
    }

    fn read(table: &DeTable<'_>) -> Read<Self> {
        let keys = Keys::of_table(table, &["master", "extensions", "script", "remotes", "i2c"])?;
        Ok(Self {
            master: keys.or("master", Board::default(), Board::read)?,
            extensions: keys.or("extensions", Vec::new(), list(EXTENSIONS, Board::read))?,
            script: keys.or("script", Script::default(), Script::read)?,
            remotes: keys.or("remotes", Vec::new(), list(REMOTES, Remote::read))?,
            i2c: keys.or("i2c", Vec::new(), list(I2C, I2cDevice::read))?,
        })
    }

    /// Checks the ranges, and that the parts fit together.
    fn find_mistake(&self) -> Checked {
        at("master", self.master.check())?;
        let count = self.extensions.len();
        let reason = || format!("expected at most {MAX_EXTENSIONS} extensions, not {count}");
        let too_many = at(MAX_EXTENSIONS, expect(count <= MAX_EXTENSIONS, reason));
        at("extensions", too_many)?;
        each("extensions", &self.extensions, Board::check)?;
        at("script", self.script.check(self))?;
        each("remotes", &self.remotes, Remote::check)?;
        at("remotes", remote::check_settings(&self.remotes))?;
        each("i2c", &self.i2c, I2cDevice::check)?;
        at("i2c", i2c_device::check_addresses(&self.i2c))
    }
}
