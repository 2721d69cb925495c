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

    /// Turns motors by these numbers of pulses from where they are.
    pub(crate) fn travel(&mut self, ways: &[(Motor, i32)]) {
        for (motor, pulses) in ways.iter().filter(|(_, pulses)| *pulses != 0) {
            let direction = if *pulses < 0 { Turn::Left } else { Turn::Right };
            self.turn(*motor, direction);
            self.outputs[0].distance[motor.index()] = pulses.unsigned_abs() as u16;
            self.outputs[0].motor_command_id[motor.index()] += 1;
        }
        let ids = self.outputs[0].motor_command_id;
        let is_done = |program: &Self| program.machine.report(0).unwrap().motor_command_id == ids;
        self.wait_until("the axes are there", is_done);
        ways.iter().for_each(|(motor, _)| self.turn(*motor, Turn::Off));
        self.wait(200);
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    Left,
    Right,
    Off,
}
