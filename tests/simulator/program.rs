//! A program that drives a machine in steps of 10 ms, in the manner of programs for a real one.

use std::time::Duration;

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig};
use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::world::{Piece, Plug, Whereabouts, World, WorldState};
use ft_transfer_area_simulator::Machine;

const STEP: Duration = Duration::from_millis(10);

/// What an axis or a wait may take, in steps.
const LIMIT: u32 = 2000;

/// A machine and the outputs of its controllers.
pub(crate) struct Program {
    pub(crate) machine: Machine,
    outputs: Vec<ExchangeData>,
}

impl Program {
    /// A program for this shipped world.
    pub(crate) fn shipped(name: &str) -> Self {
        let world = World::shipped(name).unwrap();
        Self::new(Machine::with_world(world.extensions.len(), world).unwrap())
    }

    pub(crate) fn new(machine: Machine) -> Self {
        let outputs = vec![ExchangeData::default(); machine.controllers.len()];
        Self { machine, outputs }
    }

    /// Configures an input for a voltage.
    pub(crate) fn measure_voltage(&mut self, input: Input) {
        let mut config = Config::default();
        config.uni[input.index()] = UniConfig::analog(InputMode::Voltage);
        self.machine.set_config(0, config);
    }

    pub(crate) fn world(&self) -> &WorldState {
        self.machine.world().unwrap()
    }

    pub(crate) fn put(&mut self, piece: Piece, place: &str) -> bool {
        self.machine.world_mut().unwrap().put(piece, place)
    }

    /// What is at this place.
    pub(crate) fn at(&self, place: &str) -> Option<Piece> {
        let places = self.world().places();
        let found = places.into_iter().find(|(name, _)| name == place);
        found.unwrap_or_else(|| panic!("there is no {place}")).1
    }

    /// Where the first of these pieces is.
    pub(crate) fn whereabouts(&self, piece: Piece) -> Whereabouts {
        let pieces = self.world().pieces();
        pieces.into_iter().find(|(other, _)| *other == piece).unwrap().1
    }

    pub(crate) fn input(&self, input: impl Into<Plug<Input>>) -> i16 {
        let Plug { controller, terminal } = input.into();
        self.machine.controllers[controller].uni[terminal.index()]
    }

    pub(crate) fn set(&mut self, output: impl Into<Plug<Output>>, is_on: bool) {
        let Plug { controller, terminal } = output.into();
        self.outputs[controller].duty[terminal.index()] = if is_on { 512 } else { 0 };
    }

    /// Turns a motor left (its first output), right, or not at all.
    pub(crate) fn turn(&mut self, motor: impl Into<Plug<Motor>>, direction: Turn) {
        let Plug { controller, terminal } = motor.into();
        let [left, right] = terminal.outputs().map(|output| Plug { controller, terminal: output });
        self.set(left, direction == Turn::Left);
        self.set(right, direction == Turn::Right);
    }

    /// Lets this many ms pass.
    pub(crate) fn wait(&mut self, ms: u32) {
        (0..ms / 10).for_each(|_| self.step());
    }

    fn step(&mut self) {
        for (index, outputs) in self.outputs.iter().enumerate() {
            self.machine.set_outputs(index, *outputs);
        }
        self.machine.step(STEP);
    }

    /// Waits until this holds.
    pub(crate) fn wait_until(&mut self, what: &str, mut holds: impl FnMut(&Self) -> bool) {
        for _ in 0..LIMIT {
            if holds(self) {
                return;
            }
            self.step();
        }
        panic!("{what}: never; {:?} {:?}", self.world().pieces(), self.world().mishaps());
    }

    /// Turns a motor until a switch is pressed.
    pub(crate) fn drive(
        &mut self,
        motor: impl Into<Plug<Motor>>,
        direction: Turn,
        switch: impl Into<Plug<Input>>,
    ) {
        let (motor, switch) = (motor.into(), switch.into());
        self.turn(motor, direction);
        self.wait_until(&format!("{switch} is pressed"), |program| program.input(switch) == 1);
        self.turn(motor, Turn::Off);
        self.step();
    }
}

/// What has gone wrong with workpieces, in words.
pub(crate) fn sentences(world: &WorldState) -> Vec<String> {
    world.mishaps().iter().map(ToString::to_string).collect()
}

/// Axes with encoders, and the positions that a program counts.
pub(crate) struct Axes<const N: usize> {
    motors: [Motor; N],
    position: [i32; N],
}

impl<const N: usize> Axes<N> {
    /// Turns these motors left until their switches are pressed, one after the other.
    pub(crate) fn reference_run(program: &mut Program, axes: [(Motor, Input); N]) -> Self {
        for (motor, switch) in axes {
            program.drive(motor, Turn::Left, switch);
        }
        program.wait(200);
        Self { motors: axes.map(|(motor, _)| motor), position: [0; N] }
    }

    /// Turns all motors until they have come to this position.
    pub(crate) fn go(&mut self, program: &mut Program, position: [i32; N]) {
        let ways: [i32; N] = std::array::from_fn(|axis| position[axis] - self.position[axis]);
        let outputs = &mut program.outputs[0];
        for (motor, way) in self.motors.iter().zip(ways).filter(|(_, way)| *way != 0) {
            outputs.distance[motor.index()] = way.unsigned_abs() as u16;
            outputs.motor_command_id[motor.index()] += 1;
        }
        let ids = outputs.motor_command_id;
        for (motor, way) in self.motors.iter().zip(ways) {
            let turn = [Turn::Left, Turn::Off, Turn::Right][(way.signum() + 1) as usize];
            program.turn(*motor, turn);
        }
        program.wait_until("the axes are there", |program| {
            program.machine.report(0).unwrap().motor_command_id == ids
        });
        self.motors.iter().for_each(|motor| program.turn(*motor, Turn::Off));
        program.wait(200);
        let counter = program.machine.report(0).unwrap().counter;
        for ((position, motor), way) in self.position.iter_mut().zip(self.motors).zip(ways) {
            *position += way.signum() * i32::from(counter[motor.index()]);
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    Left,
    Right,
    Off,
}
