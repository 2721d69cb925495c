//! A world as it moves.

use std::time::Duration;

use super::board::BoardState;
use super::remote::{self, Remote};
use super::sensor::Sensor;
use super::shaft::{Shaft, TICK_MICROS};
use super::{Script, World};
use crate::simulator::controller::Controller;
use crate::simulator::oddity::Encoder;
use crate::terminals::{Input, Motor, Output};

/// Longer steps are as long as this, in µs: an hour.
const LONGEST_STEP: u64 = 3_600_000_000;

/// Where everything in a [`World`] is at present, and what a program may change in it.
///
/// Controllers are told by index: 0 the master, 1..=8 the extensions.
#[derive(Clone, Debug)]
pub struct WorldState {
    boards: Vec<BoardState>,
    remotes: Vec<Remote>,
    script: ScriptState,
    /// Ticks since the start.
    ticks: u64,
    /// Machine time since the last tick in µs.
    rest: u64,
}

impl WorldState {
    /// A checked world for so many controllers, and what they see of it at first.
    pub(in crate::simulator) fn new(world: &World, controllers: &mut [Controller]) -> Self {
        let board = |index| world.board(index).map(BoardState::new).unwrap_or_default();
        let mut state = Self {
            boards: (0..controllers.len()).map(board).collect(),
            remotes: world.remotes.clone(),
            script: ScriptState::new(&world.script),
            ticks: 0,
            rest: 0,
        };
        state.show(controllers);
        state
    }

    /// Lets so many µs pass, for these controllers, which take part in it.
    pub(in crate::simulator) fn move_on(&mut self, micros: u64, controllers: &mut [Controller]) {
        self.rest += micros.min(LONGEST_STEP);
        while self.rest >= TICK_MICROS {
            self.rest -= TICK_MICROS;
            self.tick(controllers);
        }
        self.show(controllers);
    }

    fn tick(&mut self, controllers: &mut [Controller]) {
        for (controller, input, pressed) in self.script.due(self.ticks) {
            press(&mut self.boards, controller, input, pressed);
        }
        self.ticks += 1;
        for (board, controller) in self.boards.iter_mut().zip(controllers) {
            board.tick(controller);
        }
    }

    fn show(&mut self, controllers: &mut [Controller]) {
        let seen = remote::seen(&self.remotes);
        for (board, controller) in self.boards.iter_mut().zip(controllers) {
            board.show(controller);
            controller.ir = seen;
        }
    }

    /// Everything comes to rest, as nobody tells the motors to turn.
    pub(in crate::simulator) fn halt(&mut self) {
        self.boards.iter_mut().for_each(BoardState::halt);
    }

    /// The machine time since the start, in whole milliseconds.
    pub fn time(&self) -> Duration {
        Duration::from_micros(self.ticks * TICK_MICROS)
    }

    /// Where the slide of this motor is, in the unit of its travel; `None` without one.
    pub fn slide(&self, controller: usize, motor: Motor) -> Option<f64> {
        let shaft = self.shaft(controller, motor)?;
        shaft.slide().map(|_| shaft.position())
    }

    /// How fast this motor turns, in turns per second, negative backwards; `None` without one.
    pub fn motor_speed(&self, controller: usize, motor: Motor) -> Option<f64> {
        self.shaft(controller, motor).map(Shaft::speed)
    }

    /// How bright this lamp is, from 0.0 to 1.0 in proportion to the duty; `None` without one.
    pub fn lamp(&self, controller: usize, output: Output) -> Option<f64> {
        self.boards.get(controller)?.lamps.get(&output).copied()
    }

    /// What is plugged in here at present; `None` when nothing is.
    pub fn sensor(&self, controller: usize, input: Input) -> Option<&Sensor> {
        self.boards.get(controller)?.inputs.get(&input)
    }

    /// The motor whose slide presses the switch that is plugged in here, or is seen by the sensor.
    /// What a program sets there is gone with the next step.
    ///
    /// ```
    /// use ft_transfer_area::simulator::world::World;
    /// use ft_transfer_area::simulator::Machine;
    /// use ft_transfer_area::tx::{Input, Motor};
    ///
    /// # fn main() -> Result<(), ft_transfer_area::Error> {
    /// let machine = Machine::with_world(0, World::default())?;
    /// let moved_by = |input| machine.world().and_then(|world| world.moved_by(0, input));
    /// assert_eq!(moved_by(Input::I2), Some(Motor::M1), "the end switch");
    /// assert_eq!(moved_by(Input::I3), None, "the button");
    /// # Ok(())
    /// # }
    /// ```
    pub fn moved_by(&self, controller: usize, input: Input) -> Option<Motor> {
        self.boards.get(controller)?.moved_by(input)
    }

    /// Plugs in another sensor, or takes it out. Values out of their range count as the nearest
    /// in it. An end switch or sensor of a slide goes on to be moved by it, if it still is one.
    ///
    /// Returns whether there is such a controller. The input reports it from the next step on.
    pub fn set_sensor(&mut self, controller: usize, input: Input, sensor: Option<Sensor>) -> bool {
        let Some(board) = self.boards.get_mut(controller) else { return false };
        match sensor {
            Some(sensor) => board.inputs.insert(input, sensor),
            None => board.inputs.remove(&input),
        };
        true
    }

    /// Presses a button or switch, or lets it go, until the script or a slide does otherwise.
    ///
    /// Returns whether there is one. The input reports it from the next step on.
    pub fn press(&mut self, controller: usize, input: Input, pressed: bool) -> bool {
        press(&mut self.boards, controller, input, pressed)
    }

    /// The infrared remotes.
    pub fn remotes(&self) -> &[Remote] {
        &self.remotes
    }

    /// Changes the remote with the same switch setting, or adds it. Joysticks beyond −15..=15 count
    /// as the nearest in it. The controllers see it from the next step on.
    pub fn set_remote(&mut self, remote: Remote) {
        match self.remotes.iter_mut().find(|known| known.is_set_like(&remote)) {
            Some(known) => *known = remote,
            None => self.remotes.push(remote),
        }
    }

    /// Whether the motor with this index can be counted.
    pub(in crate::simulator) fn encoder(&self, controller: usize, motor: usize) -> Encoder {
        let shafts = self.boards.get(controller).map(|board| &board.shafts);
        match shafts.and_then(|shafts| shafts.get(motor)?.as_ref()) {
            Some(shaft) if shaft.has_encoder() => Encoder::Present,
            Some(_) => Encoder::Missing,
            None => Encoder::NoMotor,
        }
    }

    fn shaft(&self, controller: usize, motor: Motor) -> Option<&Shaft> {
        self.boards.get(controller)?.shafts[motor.index()].as_ref()
    }
}

fn press(boards: &mut [BoardState], controller: usize, input: Input, pressed: bool) -> bool {
    let sensor = boards.get_mut(controller).and_then(|board| board.inputs.get_mut(&input));
    let button = sensor.and_then(Sensor::pressed_mut);
    button.map(|button| *button = pressed).is_some()
}

/// A script in ticks.
#[derive(Clone, Debug)]
struct ScriptState {
    period: Option<u64>,
    /// Tick, controller, input and whether it is pressed, in order.
    events: Vec<(u64, usize, Input, bool)>,
}

impl ScriptState {
    fn new(script: &Script) -> Self {
        // What is beyond the range is never due.
        let ticks = |seconds: f64| (seconds * 1e6 / TICK_MICROS as f64).round() as u64;
        let events = script.events.iter();
        let mut events: Vec<_> = events
            .map(|event| (ticks(event.at), event.controller, event.input, event.pressed))
            .collect();
        // Those at the same time keep their order.
        events.sort_by_key(|event| event.0);
        Self { period: script.period.map(|period| ticks(period).max(1)), events }
    }

    /// What happens at the beginning of a tick.
    fn due(&self, tick: u64) -> impl Iterator<Item = (usize, Input, bool)> + '_ {
        let now = self.period.map_or(tick, |period| tick % period);
        let due = self.events.iter().filter(move |event| event.0 == now);
        due.map(|&(_, controller, input, pressed)| (controller, input, pressed))
    }
}
