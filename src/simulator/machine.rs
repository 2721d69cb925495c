//! The simulated machine: the master and its extensions.

mod online;

use std::collections::VecDeque;
use std::time::Duration;

use super::camera::Camera;
use super::controller::Controller;
use super::i2c::{I2cBus, I2C_REGISTERS};
use super::oddity::{Encoder, Oddities, Oddity};
use super::world::{World, WorldState};
use crate::error::Error;
use crate::transfer_area::{Config, MAX_EXTENSIONS};
use crate::wire::{CommandId, ExchangeData, ExchangeDataResponse, StartCameraOnline};

/// The simulated machine: the master and its extensions, and what has happened to them.
///
/// It moves on by one step per exchange, never by the clock, so that a program which is slow or
/// waits in a debugger sees the same machine. Only the camera goes by the clock.
///
/// A test may also have a machine of its own, without any connection, and
/// [step](Self::step) it.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The master first, then the extensions; as many as were asked for when it was built.
    pub controllers: Vec<Controller>,
    /// Which extensions can be reached; the first is at 0. At the start these are all that there
    /// are. Beyond them the value means nothing.
    ///
    /// An extension that is cut off takes part in no exchange, its outputs are 0 and its motors
    /// stand still.
    pub alive: [bool; MAX_EXTENSIONS],
    exchanges: u64,
    connections: u64,
    refused: u64,
    connected: bool,
    online: bool,
    commands: VecDeque<CommandId>,
    oddities: Oddities,
    camera: Camera,
    world: Option<WorldState>,
    i2c: I2cBus,
}

impl Machine {
    /// A master with this many extensions, all of them alive, and with nothing plugged in but simple
    /// motors. More than 8 extensions count as 8.
    pub fn new(extensions: usize) -> Self {
        let extensions = extensions.min(MAX_EXTENSIONS);
        let mut alive = [false; MAX_EXTENSIONS];
        alive.iter_mut().take(extensions).for_each(|alive| *alive = true);
        Self {
            controllers: vec![Controller::default(); 1 + extensions],
            alive,
            exchanges: 0,
            connections: 0,
            refused: 0,
            connected: false,
            online: false,
            commands: VecDeque::new(),
            oddities: Oddities::default(),
            camera: Camera::default(),
            world: None,
            i2c: I2cBus::default(),
        }
    }

    /// The same with a world plugged in.
    ///
    /// # Errors
    ///
    /// [`Error::World`] when the world has a value out of its range, or its parts don't fit.
    pub fn with_world(extensions: usize, world: World) -> Result<Self, Error> {
        world.check()?;
        let mut machine = Self::new(extensions);
        machine.world = Some(WorldState::new(&world, &mut machine.controllers));
        Ok(machine)
    }

    /// Where everything in the world is; `None` for a machine without one.
    pub fn world(&self) -> Option<&WorldState> {
        self.world.as_ref()
    }

    /// The same, to press buttons and change sensors.
    pub fn world_mut(&mut self) -> Option<&mut WorldState> {
        self.world.as_mut()
    }

    /// Gives outputs to the controller with this index (0 the master), as an exchange does.
    ///
    /// A command begins when its id is not the one before. Nothing happens to a controller that
    /// does not exist or is cut off.
    pub fn set_outputs(&mut self, controller: usize, outputs: ExchangeData) {
        if self.reaches(controller) {
            self.controllers[controller].take_over(outputs);
            self.note_uncounted(controller);
        }
    }

    /// Looks for motors of the world that are to be counted, but can't be.
    fn note_uncounted(&mut self, controller: usize) {
        let Some(world) = &self.world else { return };
        for (motor, task) in self.controllers[controller].tasks() {
            let encoder = world.encoder(controller, motor);
            if encoder != Encoder::Present {
                self.oddities.note(&Oddity::Uncounted { controller, motor, encoder, task });
            }
        }
    }

    /// Gives a configuration to the controller with this index (0 the master), whichever its id.
    /// Nothing happens to a controller that does not exist.
    pub fn set_config(&mut self, controller: usize, config: Config) {
        if let Some(controller) = self.controllers.get_mut(controller) {
            controller.config = config;
        }
    }

    /// Lets so much time pass in the machine, at once, as between two exchanges.
    ///
    /// In a world an hour is the longest step; it takes a few seconds to compute.
    pub fn step(&mut self, duration: Duration) {
        self.move_on(u64::try_from(duration.as_micros()).unwrap_or(u64::MAX));
    }

    /// What the controller with this index (0 the master) reports in an exchange; `None` when
    /// there is none or it is cut off.
    pub fn report(&self, controller: usize) -> Option<ExchangeDataResponse> {
        self.reaches(controller).then(|| self.controllers[controller].report())
    }

    /// How many exchanges have been answered since the start. In a script this is the number of
    /// those before the present one.
    pub fn exchanges(&self) -> u64 {
        self.exchanges
    }

    /// How many main connections have been accepted since the start, without those refused.
    pub fn connections(&self) -> u64 {
        self.connections
    }

    /// How many main connections have been refused since the start, because another client was
    /// online.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Whether a client is connected at present.
    pub fn connected(&self) -> bool {
        self.connected
    }

    /// Whether the controller is in online mode.
    pub fn online(&self) -> bool {
        self.online
    }

    /// The newest 1000 commands since the start, the oldest first, without the exchanges.
    pub fn commands(&self) -> impl DoubleEndedIterator<Item = CommandId> + '_ {
        self.commands.iter().copied()
    }

    /// What clients did that a correct client does not do, a sentence each, though the simulated
    /// TXT went on: the newest 100 since the start, the oldest first. Each is logged as a warning.
    ///
    /// Each kind is told once from one StartOnline to the next:
    ///
    /// * an exchange before the first UpdateConfig for the master, or for an extension in it,
    /// * an exchange with an extension that the compressed response before did not have,
    /// * a duty outside 0..=512,
    /// * both duties of a pair of outputs that is configured as a motor, other than 0,
    /// * whole bytes of compressed data behind the last word,
    /// * a command that was there before the response to the previous one left. The farewell on a
    ///   broken connection, StopOnline right behind a last exchange or alone, is not odd.
    /// * a distance of, or synchronisation with, a motor of the world that has no encoder, or that
    ///   is not there, once for each motor: the command is never done.
    pub fn oddities(&self) -> impl DoubleEndedIterator<Item = &str> {
        self.oddities.sentences()
    }

    /// What the camera was started with, as it was asked for; `None` while it is not started. It
    /// is started from StartCameraOnline on, before its server serves.
    pub fn camera(&self) -> Option<StartCameraOnline> {
        self.camera.run().map(|run| run.settings)
    }

    /// How many camera frames have been sent since the start. One that is on its way counts.
    pub fn camera_frames(&self) -> u64 {
        self.camera.frames
    }

    /// How many acknowledges of camera frames have come in since the start.
    pub fn camera_acknowledges(&self) -> u64 {
        self.camera.acknowledges
    }

    /// How many I2C connections have been served since the start, the present one included.
    pub fn i2c_connections(&self) -> u64 {
        self.i2c.connections
    }

    /// Whether a client of the I2C port is connected at present.
    pub fn i2c_connected(&self) -> bool {
        self.i2c.connected
    }

    /// The registers of the I2C device with this address, of which the lowest 7 bits count. One
    /// that is not there is plugged in, with all registers 0.
    pub fn i2c_device(&mut self, address: u8) -> &mut [u8; I2C_REGISTERS] {
        self.i2c.device(address)
    }

    /// Unplugs the I2C device with this address; whether there was one.
    pub fn remove_i2c_device(&mut self, address: u8) -> bool {
        self.i2c.remove(address)
    }

    /// The addresses of the I2C devices that are plugged in, in ascending order.
    pub fn i2c_addresses(&self) -> impl Iterator<Item = u8> + '_ {
        self.i2c.addresses()
    }

    /// Lets this many µs pass in the machine.
    pub(super) fn move_on(&mut self, micros: u64) {
        for index in 0..self.controllers.len() {
            let reached = self.reaches(index);
            let controller = &mut self.controllers[index];
            match (reached, &self.world) {
                (false, _) => controller.stop(),
                (true, None) => controller.move_on(micros),
                (true, Some(_)) => controller.pass_time(micros),
            }
        }
        if let Some(world) = &mut self.world {
            world.move_on(micros, &mut self.controllers);
        }
    }

    /// The extensions that can be reached, a bit each.
    pub(super) fn alive_mask(&self) -> u16 {
        (0..MAX_EXTENSIONS)
            .filter(|extension| self.reaches(extension + 1))
            .fold(0, |mask, extension| mask | 1 << extension)
    }

    /// The controllers that take part in an exchange, the master first.
    pub(super) fn reachable(&self) -> impl Iterator<Item = &Controller> {
        let indexed = self.controllers.iter().enumerate();
        indexed.filter(|(index, _)| self.reaches(*index)).map(|(_, controller)| controller)
    }

    fn reaches(&self, index: usize) -> bool {
        let alive = index.checked_sub(1).map_or(Some(&true), |extension| self.alive.get(extension));
        index < self.controllers.len() && alive == Some(&true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: u64 = 10_000;

    #[test]
    fn an_extension_that_is_cut_off_stands_still() {
        let mut machine = Machine::new(2);
        let outputs = ExchangeData { duty: [512; 8], ..Default::default() };
        machine.take_over(2, outputs);
        machine.alive[1] = false;
        machine.move_on(STEP);
        assert_eq!(machine.controllers[2].outputs, ExchangeData::default());
        machine.take_over(2, outputs);
        assert_eq!(machine.controllers[2].outputs, ExchangeData::default());
        assert_eq!((machine.alive_mask(), machine.reachable().count()), (0b01, 2));
        machine.alive = [true; 8];
        assert_eq!((machine.alive_mask(), machine.reachable().count()), (0b11, 3));
    }
}
