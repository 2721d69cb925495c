//! The simulated machine: the master and its extensions.

mod areas;
mod clock;
pub(crate) mod controller;
pub(crate) mod journal;
pub(crate) mod motor;
pub(crate) mod oddity;
mod online;
mod positions;
mod sound;
pub(crate) mod words;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use clock::Clock;
use controller::Controller;
use ft_transfer_area::transfer_area::{Config, MAX_EXTENSIONS};
use ft_transfer_area::wire::{CommandId, ExchangeData, ExchangeDataResponse, StartCameraOnline};
use journal::notice;
use oddity::{Encoder, Oddities, Oddity};

use crate::camera::Camera;
use crate::error::Error;
use crate::fault::FaultKind;
use crate::i2c::{I2cBus, I2C_REGISTERS};
use crate::server::command::Misbehaviour;
use crate::world::floor::OwnFloor;
use crate::world::{IdealMotors, World, WorldState};

/// The simulated machine: the master and its extensions, and what has happened to them.
///
/// In a [`SimulatedTxt`](super::SimulatedTxt) with a [pace](super::SimulatedTxtBuilder::pace) its time
/// follows the clock while a client is online, like that of a real controller. In
/// [lock-step](super::SimulatedTxtBuilder::lock_step), and without a pace, it moves by one step per
/// exchange, so a slow program, or one in a debugger, sees the same machine.
///
/// A test may also have its own machine, without any connection, and [step](Self::step) it.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The master first, then as many extensions as the machine was built with.
    pub controllers: Vec<Controller>,
    /// Which extensions can be reached; the first one has index 0. At the start all can. Values after
    /// the last extension mean nothing.
    ///
    /// An extension that is cut off takes part in no exchange, its outputs are 0 and its motors
    /// stand still.
    pub alive: [bool; MAX_EXTENSIONS],
    exchanges: u64,
    connections: u64,
    sessions: u64,
    absent: bool,
    /// Whether it does what ends the firmware's program, and what the firmware refuses.
    strict: bool,
    /// The extensions that StartOnline has found, if it is strict.
    found: Option<u16>,
    /// What ends the program after the present answer.
    end: Option<Misbehaviour>,
    /// What happens to the next response.
    disturbances: Vec<FaultKind>,
    connected: bool,
    online: bool,
    commands: VecDeque<CommandId>,
    oddities: Oddities,
    camera: Camera,
    world: Option<WorldState>,
    /// What turns without a world.
    motors: IdealMotors,
    i2c: I2cBus,
    /// Machine time since the start in µs.
    micros: u64,
    watchdog: Watchdog,
    clock: Clock,
}

/// What clears the outputs when no exchange comes, in µs of machine time.
#[derive(Clone, Copy, Debug, Default)]
struct Watchdog {
    /// How long after an exchange; `None` without a watchdog.
    limit: Option<u64>,
    /// Since the last exchange.
    passed: u64,
}

impl Watchdog {
    /// How long it is until the outputs are cleared.
    fn left(&self) -> Option<u64> {
        Some(self.limit?.saturating_sub(self.passed)).filter(|left| *left > 0)
    }
}

impl Machine {
    /// A master with this many extensions, all of them alive. Only ideal motors are plugged in. More
    /// than 8 extensions count as 8.
    pub fn new(extensions: usize) -> Self {
        let extensions = extensions.min(MAX_EXTENSIONS);
        let mut alive = [false; MAX_EXTENSIONS];
        alive.iter_mut().take(extensions).for_each(|alive| *alive = true);
        Self {
            controllers: vec![Controller::default(); 1 + extensions],
            alive,
            exchanges: 0,
            connections: 0,
            sessions: 0,
            absent: false,
            strict: false,
            found: None,
            end: None,
            disturbances: Vec::new(),
            connected: false,
            online: false,
            commands: VecDeque::new(),
            oddities: Oddities::default(),
            camera: Camera::default(),
            world: None,
            motors: IdealMotors::new(1 + extensions),
            i2c: I2cBus::default(),
            micros: 0,
            watchdog: Watchdog::default(),
            clock: Clock::new(),
        }
    }

    /// A machine with this many extensions, as in [`new`](Self::new), and with a world plugged in.
    ///
    /// # Errors
    ///
    /// [`Error::World`] when the world has a value out of its range, or its parts don't fit.
    pub fn with_world(extensions: usize, world: World) -> Result<Self, Error> {
        world.check()?;
        Ok(Self::on_floor(extensions, &world, OwnFloor::alone(&world)))
    }

    /// A machine with a checked world, and the floor that it may share with others.
    pub(crate) fn on_floor(extensions: usize, world: &World, floor: Option<OwnFloor>) -> Self {
        let mut machine = Self::new(extensions);
        machine.plug_in(world, floor);
        machine
    }

    /// Where everything in the world is; `None` for a machine without one.
    pub fn world(&self) -> Option<&WorldState> {
        self.world.as_ref()
    }

    /// The world, to press buttons and change sensors; `None` for a machine without one.
    pub fn world_mut(&mut self) -> Option<&mut WorldState> {
        self.world.as_mut()
    }

    /// Unplugs the world and plugs in this one, as it is at its start. What the controllers remember stays: counters,
    /// configurations, and the ids of commands.
    ///
    /// # Errors
    ///
    /// [`Error::World`] when the world has a value out of its range, or its parts don't fit.
    pub fn set_world(&mut self, world: &World) -> Result<(), Error> {
        world.check()?;
        self.plug_in(world, OwnFloor::alone(world));
        Ok(())
    }

    fn plug_in(&mut self, world: &World, floor: Option<OwnFloor>) {
        self.world = Some(WorldState::new(world, floor, &mut self.controllers));
        self.i2c = I2cBus::default();
        for device in &world.i2c {
            let registers = self.i2c.device(device.address);
            for (register, value) in &device.registers {
                registers[usize::from(*register)] = *value;
            }
        }
    }

    /// Gives outputs to the controller with this index (0 the master), as an exchange does.
    ///
    /// A command begins when its id differs from the one before. If the controller does not exist or
    /// is cut off, nothing happens.
    pub fn set_outputs(&mut self, controller: usize, outputs: ExchangeData) {
        if self.reaches(controller) {
            self.controllers[controller].take_over(outputs);
            self.note_uncounted(controller);
        }
    }

    /// Notes commands that need the count of a motor of the world that can't be counted.
    fn note_uncounted(&mut self, controller: usize) {
        let Some(world) = &self.world else { return };
        for (motor, task) in self.controllers[controller].tasks() {
            let encoder = world.encoder(controller, motor);
            if encoder != Encoder::Present {
                self.oddities.note(&Oddity::Uncounted { controller, motor, encoder, task });
            }
        }
    }

    /// Gives a configuration to the controller with this index (0 the master), with any id. In a world
    /// its inputs immediately report what they measure in their new modes. If the controller does not
    /// exist, nothing happens.
    pub fn set_config(&mut self, index: usize, config: Config) {
        let Some(controller) = self.controllers.get_mut(index) else { return };
        controller.config = config;
        if let Some(world) = &mut self.world {
            world.show_to(index, controller);
        }
    }

    /// Lets this much time pass in the machine, as between two exchanges. It does not wait.
    ///
    /// In a world an hour is the longest step; it takes a few seconds to compute. So it is without a world while motors
    /// have a distance or are synchronised.
    pub fn step(&mut self, duration: Duration) {
        self.finish_resets();
        self.move_on(u64::try_from(duration.as_micros()).unwrap_or(u64::MAX));
    }

    /// What the controller with this index (0 the master) reports in an exchange; `None` when it
    /// does not exist or is cut off.
    pub fn report(&self, controller: usize) -> Option<ExchangeDataResponse> {
        self.reaches(controller).then(|| self.controllers[controller].report())
    }

    /// How many exchanges have been answered since the start. In a script the present exchange does
    /// not count yet.
    pub fn exchanges(&self) -> u64 {
        self.exchanges
    }

    /// How many main connections have been accepted since the start.
    pub fn connections(&self) -> u64 {
        self.connections
    }

    /// How many times online mode has begun since the start. A client may begin it again on one connection.
    pub fn sessions(&self) -> u64 {
        self.sessions
    }

    /// Whether the controller is away: new main connections are closed immediately, as after
    /// [`set_absent`](Self::set_absent).
    pub fn absent(&self) -> bool {
        self.absent
    }

    /// Lets the controller be away, or come back. A client that is connected stays connected until it leaves, or
    /// until its connection is [closed](FaultKind::Close).
    pub fn set_absent(&mut self, absent: bool) {
        self.absent = absent;
    }

    /// Disturbs the response to the present exchange, if a script calls this, or otherwise the next response.
    /// Several disturb it together, in their order.
    ///
    /// ```
    /// use ft_transfer_area_simulator::{FaultKind, SimulatedTxt};
    /// use ft_transfer_area::prelude::*;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let builder = SimulatedTxt::builder().on_exchange(|machine| {
    ///     if machine.controllers[0].outputs.duty[0] == 512 {
    ///         machine.disturb(FaultKind::WrongCrc);
    ///     }
    /// });
    /// let txt = builder.start()?;
    /// let handler = TransferAreaComHandler::builder(txt.address().to_string()).build()?;
    /// let areas = handler.areas();
    /// handler.begin_transfer()?;
    /// areas.wait_cycle()?[0].output.duty[O1] = 512;
    /// while areas.wait_cycle().is_ok() {}
    /// assert!(handler.end_transfer().is_err());
    /// # Ok(())
    /// # }
    /// ```
    pub fn disturb(&mut self, kind: FaultKind) {
        self.disturbances.push(kind);
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

    /// What clients did that a correct client does not do, but that the simulated TXT accepted, one
    /// sentence each: the newest 100 since the start, the oldest first. Each is logged as a warning.
    ///
    /// Each kind is reported once from one StartOnline to the next:
    ///
    /// * an exchange before the first UpdateConfig for the master, or for an extension in it,
    /// * an exchange with an extension that the compressed response before did not have,
    /// * a duty outside 0..=512,
    /// * a pair of outputs that is configured as a motor, both with a duty other than 0,
    /// * whole bytes of compressed data after the last word,
    /// * a command that arrived before the response to the previous one was sent. StopOnline is not odd, alone
    ///   or right after a last exchange: so a client ends a broken connection,
    /// * a command that came in pieces, or one of online mode outside it,
    /// * an I2C client that is not the first one in the 5 s after StartOnline,
    /// * what ends the program of a real TXT: a StartOnline while the I2C server of the session before waits for a
    ///   client or has one, in the 5 s after the StartOnline before; fewer words in an exchange than it says;
    ///   StartCameraOnline twice, or after the camera was stopped while its client was connected,
    /// * a distance of, or synchronisation with, a motor of the world that has no encoder or does not
    ///   exist, once for each motor: the command is never done.
    pub fn oddities(&self) -> impl DoubleEndedIterator<Item = &str> {
        self.oddities.sentences()
    }

    /// The requested settings of the camera; `None` while it is not started. It counts as started
    /// from StartCameraOnline on, before it serves.
    pub fn camera(&self) -> Option<StartCameraOnline> {
        self.camera.run().map(|run| run.settings)
    }

    /// From now on the camera sends this picture, a JPEG file; `None` for its test card, which it sends at
    /// first. The picture should have the size that the client asks for.
    pub fn set_camera_picture(&mut self, jpeg: Option<Vec<u8>>) {
        self.camera.picture = jpeg.map(Arc::from);
    }

    pub(super) fn camera_picture(&self) -> Option<Arc<[u8]>> {
        self.camera.picture.clone()
    }

    /// How many camera frames have been sent since the start, with the one that is being sent.
    pub fn camera_frames(&self) -> u64 {
        self.camera.frames
    }

    /// How many acknowledgements of camera frames have arrived since the start.
    pub fn camera_acknowledges(&self) -> u64 {
        self.camera.acknowledgements
    }

    /// How many I2C connections have been served since the start, the present one included.
    pub fn i2c_connections(&self) -> u64 {
        self.i2c.connections
    }

    /// Whether a client of the I2C port is connected at present.
    pub fn i2c_connected(&self) -> bool {
        self.i2c.connected
    }

    /// The registers of the I2C device with this address, of which the lowest 7 bits count. A
    /// missing device is plugged in, with all registers 0.
    pub fn i2c_device(&mut self, address: u8) -> &mut [u8; I2C_REGISTERS] {
        self.i2c.device(address)
    }

    /// Unplugs the I2C device with this address. Returns whether there was one.
    pub fn remove_i2c_device(&mut self, address: u8) -> bool {
        self.i2c.remove(address)
    }

    /// The addresses of the I2C devices that are plugged in, in ascending order.
    pub fn i2c_addresses(&self) -> impl Iterator<Item = u8> + '_ {
        self.i2c.addresses()
    }

    /// The machine time since the start. By the clock, the time for which clients were online, without what was
    /// left out of [long pauses](super::SimulatedTxtBuilder::pace).
    pub fn time(&self) -> Duration {
        Duration::from_micros(self.micros)
    }

    /// Reports the counter resets that were done before this exchange.
    fn finish_resets(&mut self) {
        self.controllers.iter_mut().for_each(Controller::finish_resets);
    }

    /// Lets this many µs pass in the machine. It does not matter how a time is divided.
    pub(super) fn move_on(&mut self, micros: u64) {
        match self.watchdog.left() {
            Some(left) if left <= micros => {
                self.move_undisturbed(left);
                notice!(Info, "the board's watchdog clears the outputs");
                self.controllers.iter_mut().for_each(Controller::stop_outputs);
                self.move_undisturbed(micros - left);
            }
            _ => self.move_undisturbed(micros),
        }
    }

    fn move_undisturbed(&mut self, micros: u64) {
        self.micros = self.micros.saturating_add(micros);
        self.watchdog.passed = self.watchdog.passed.saturating_add(micros);
        for index in 0..self.controllers.len() {
            let reached = self.reaches(index);
            let controller = &mut self.controllers[index];
            if reached {
                controller.pass_time(micros);
            } else {
                controller.stop();
            }
        }
        match &mut self.world {
            Some(world) => world.move_on(micros, &mut self.controllers, &mut self.i2c),
            None => self.motors.move_on(micros, &mut self.controllers),
        }
    }

    /// The extensions in a response, one bit each: those that can be reached, or, if it is strict, could be reached at
    /// StartOnline.
    pub(super) fn alive_mask(&self) -> u16 {
        self.found.unwrap_or_else(|| self.reached_mask())
    }

    /// The extensions that can be reached, one bit each.
    pub(super) fn reached_mask(&self) -> u16 {
        (0..MAX_EXTENSIONS)
            .filter(|extension| self.reaches(extension + 1))
            .fold(0, |mask, extension| mask | 1 << extension)
    }

    /// The controllers that take part in an exchange, the master first.
    pub(super) fn reachable(&self) -> impl Iterator<Item = &Controller> {
        let mask = 1 | self.alive_mask() << 1;
        let indexed = self.controllers.iter().enumerate();
        indexed.filter(move |(index, _)| mask >> index & 1 != 0).map(|(_, controller)| controller)
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
    fn pulses_and_finished_commands_do_not_depend_on_how_time_is_divided() {
        let outputs = ExchangeData {
            duty: [300, 0, 0, 512, 170, 0, 512, 0],
            master: [0, 1, 5, 0],
            distance: [55, 40, 9, 0],
            motor_command_id: [1, 2, 3, 4],
            sound_command_id: 5,
            sound_index: 2,
            sound_repeat: 1,
            ..Default::default()
        };
        let mut machines = [(); 2].map(|()| Machine::new(0));
        machines.iter_mut().for_each(|machine| machine.set_outputs(0, outputs));
        let [steps, pieces] = &mut machines;
        for step in 0..150 {
            steps.move_on(STEP);
            [1, 0, 3333, 17, 6649].into_iter().for_each(|micros| pieces.move_on(micros));
            assert_eq!(pieces.report(0), steps.report(0), "step {step}");
        }
        assert_eq!(steps.report(0).unwrap().sound_command_id, 5);
    }

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
