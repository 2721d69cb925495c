//! The present state of a world.

use std::time::Duration;

use ft_transfer_area::transfer_area::IZ_MOTOR;
use ft_transfer_area::tx::{Input, Motor, Output};

use super::board::BoardState;
use super::floor::{LockedFloor, OwnFloor};
use super::remote::{self, Remote};
use super::script::{ScriptAction, ScriptState};
use super::sensor::Sensor;
use super::shaft::{Shaft, TICK_MICROS};
use super::World;
use crate::i2c::I2cBus;
use crate::machine::controller::Controller;
use crate::machine::oddity::Encoder;

/// The longest step in µs: an hour. Longer steps are cut to it.
pub(super) const LONGEST_STEP: u64 = 3_600_000_000;

/// The present state of a [`World`], and what a program may change in it.
///
/// Controllers are given by index: 0 the master, 1..=8 the extensions.
#[derive(Clone, Debug)]
pub struct WorldState {
    boards: Vec<BoardState>,
    remotes: Vec<Remote>,
    script: ScriptState,
    /// Ticks since the start.
    ticks: u64,
    /// Machine time since the last tick in µs.
    rest: u64,
    /// Where workpieces are, and what moves them; `None` for a world without places.
    pub(super) floor: Option<OwnFloor>,
}

impl WorldState {
    /// A checked world for these controllers. They get their first inputs.
    pub(crate) fn new(
        world: &World,
        floor: Option<OwnFloor>,
        controllers: &mut [Controller],
    ) -> Self {
        let board = |index| world.board(index).map(BoardState::new).unwrap_or_default();
        let mut state = Self {
            boards: (0..controllers.len()).map(board).collect(),
            remotes: world.remotes.clone(),
            script: ScriptState::new(&world.script),
            ticks: 0,
            rest: 0,
            floor,
        };
        state.show(controllers);
        // Counter inputs that see light from the start have not changed.
        controllers.iter_mut().for_each(|controller| controller.counter = Default::default());
        state
    }

    /// Lets this many µs pass, for these controllers.
    pub(crate) fn move_on(
        &mut self,
        micros: u64,
        controllers: &mut [Controller],
        i2c: &mut I2cBus,
    ) {
        let Self { boards, remotes, script, ticks, rest, floor } = self;
        let mut floor = floor.as_mut().map(OwnFloor::lock);
        *rest += micros.min(LONGEST_STEP);
        while *rest >= TICK_MICROS {
            *rest -= TICK_MICROS;
            for action in script.due(*ticks) {
                carry_out(action, boards, remotes, i2c, floor.as_mut());
            }
            *ticks += 1;
            for (board, controller) in boards.iter_mut().zip(&mut *controllers) {
                board.turn(controller, 1);
            }
            if let Some(floor) = &mut floor {
                floor.tick(boards, controllers);
            }
        }
        drop(floor);
        self.show(controllers);
    }

    fn show(&mut self, controllers: &mut [Controller]) {
        press_along_travels(&mut self.boards);
        if let Some(floor) = &mut self.floor {
            floor.lock().show(&mut self.boards, controllers);
        }
        let seen = remote::seen(&self.remotes);
        for (board, controller) in self.boards.iter_mut().zip(controllers) {
            board.show(controller);
            controller.ir = seen;
        }
    }

    /// Updates the inputs of a controller for its present configuration.
    pub(crate) fn show_to(&mut self, index: usize, controller: &mut Controller) {
        if let Some(board) = self.boards.get_mut(index) {
            board.show(controller);
        }
    }

    /// Stops all motors and switches all lamps off.
    pub(crate) fn halt(&mut self) {
        self.boards.iter_mut().for_each(BoardState::halt);
    }

    /// The machine time since the start, in whole milliseconds.
    pub fn time(&self) -> Duration {
        Duration::from_micros(self.ticks * TICK_MICROS)
    }

    /// The position of this motor's slide, in the unit of its travel; `None` without a slide.
    pub fn slide(&self, controller: usize, motor: Motor) -> Option<f64> {
        let shaft = self.shaft(controller, motor)?;
        shaft.slide().map(|_| shaft.position())
    }

    /// The speed of this motor in turns per second, negative for backwards; `None` without a motor.
    pub fn motor_speed(&self, controller: usize, motor: Motor) -> Option<f64> {
        self.shaft(controller, motor).map(Shaft::speed)
    }

    /// The brightness of this lamp, 0.0 to 1.0, proportional to the duty; `None` without a lamp.
    pub fn lamp(&self, controller: usize, output: Output) -> Option<f64> {
        self.boards.get(controller)?.lamps.get(&output).copied()
    }

    /// The sensor that is plugged in here at present, if any.
    pub fn sensor(&self, controller: usize, input: Input) -> Option<&Sensor> {
        self.boards.get(controller)?.inputs.get(&input)
    }

    /// The motor whose slide presses the switch that is plugged in here, or is seen by the sensor. A
    /// switch along a travel may be pressed by a motor of another controller of the same TXT. The next
    /// step replaces what a program sets there.
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::World;
    /// use ft_transfer_area_simulator::Machine;
    /// use ft_transfer_area::tx::{Input, Motor};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let machine = Machine::with_world(0, World::shipped("slide")?)?;
    /// let moved_by = |input| machine.world().and_then(|world| world.moved_by(0, input));
    /// assert_eq!(moved_by(Input::I2), Some(Motor::M1), "the end switch");
    /// assert_eq!(moved_by(Input::I3), None, "the button");
    /// # Ok(())
    /// # }
    /// ```
    pub fn moved_by(&self, controller: usize, input: Input) -> Option<Motor> {
        let board = self.boards.get(controller)?;
        board.moved_by(input).or_else(|| {
            board.inputs.get(&input).filter(|sensor| sensor.is_pressable())?;
            self.presses(controller, input)
        })
    }

    /// Plugs in another sensor, or removes it. A value out of its range becomes the nearest one in
    /// it. A slide goes on to set its switch or ultrasonic sensor, if the new sensor is one too.
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

    /// Presses or releases a button or switch, until the script or a slide changes it.
    ///
    /// Returns whether there is a button or switch. The input reports it from the next step on.
    pub fn press(&mut self, controller: usize, input: Input, pressed: bool) -> bool {
        press(&mut self.boards, controller, input, pressed)
    }

    /// The infrared remotes.
    pub fn remotes(&self) -> &[Remote] {
        &self.remotes
    }

    /// Changes the remote with the same switch setting, or adds it. A joystick value outside −15..=15
    /// becomes the nearest one in it. The controllers receive it from the next step on.
    pub fn set_remote(&mut self, remote: Remote) {
        set_remote(&mut self.remotes, remote);
    }

    /// Whether the motor with this index can be counted.
    pub(crate) fn encoder(&self, controller: usize, motor: usize) -> Encoder {
        let shafts = self.boards.get(controller).map(|board| &board.shafts);
        match shafts.and_then(|shafts| shafts.get(motor)?.as_ref()) {
            Some(shaft) if shaft.has_encoder() => Encoder::Present,
            Some(_) => Encoder::Missing,
            None => Encoder::NoMotor,
        }
    }

    /// The motor whose slide presses the switch that is plugged in here along its travel.
    fn presses(&self, controller: usize, input: Input) -> Option<Motor> {
        let numbered = self.boards.iter().enumerate();
        let mut shafts = numbered.flat_map(|(index, board)| {
            Motor::ALL
                .into_iter()
                .zip(&board.shafts)
                .map(move |(motor, shaft)| (index, motor, shaft))
        });
        let found = shafts.find(|(index, _, shaft)| {
            let mut switches = shaft.iter().flat_map(Shaft::switches);
            switches.any(|(switch, _)| {
                (switch.controller.unwrap_or(*index), switch.input) == (controller, input)
            })
        });
        found.map(|(_, motor, _)| motor)
    }

    fn shaft(&self, controller: usize, motor: Motor) -> Option<&Shaft> {
        self.boards.get(controller)?.shafts[motor.index()].as_ref()
    }
}

/// Carries out what the script says.
fn carry_out(
    action: &ScriptAction,
    boards: &mut [BoardState],
    remotes: &mut Vec<Remote>,
    i2c: &mut I2cBus,
    floor: Option<&mut LockedFloor<'_>>,
) {
    match action {
        ScriptAction::Press { controller, input, pressed } => {
            press(boards, *controller, *input, *pressed);
        }
        ScriptAction::Sensor { controller, input, sensor } => {
            set_sensor(boards, *controller, *input, sensor);
        }
        ScriptAction::Put { piece, place } => {
            if let Some(floor) = floor {
                floor.add_or_tell(*piece, place);
            }
        }
        ScriptAction::Remote(remote) => set_remote(remotes, *remote),
        ScriptAction::I2c { address, register, values } => i2c.set(*address, *register, values),
    }
}

fn set_remote(remotes: &mut Vec<Remote>, remote: Remote) {
    match remotes.iter_mut().find(|known| known.is_set_like(&remote)) {
        Some(known) => *known = remote,
        None => remotes.push(remote),
    }
}

fn press(boards: &mut [BoardState], controller: usize, input: Input, pressed: bool) -> bool {
    let sensor = boards.get_mut(controller).and_then(|board| board.inputs.get_mut(&input));
    let button = sensor.and_then(Sensor::pressed_mut);
    button.map(|button| *button = pressed).is_some()
}

/// Sets a sensor to what another one of its kind measures, if it is still plugged in.
fn set_sensor(boards: &mut [BoardState], controller: usize, input: Input, sensor: &Sensor) {
    let plugged = boards.get_mut(controller).and_then(|board| board.inputs.get_mut(&input));
    if let Some(plugged) = plugged.filter(|plugged| plugged.kind() == sensor.kind()) {
        plugged.clone_from(sensor);
    }
}

/// Sets the switches along the travels of slides, which may be on another controller.
fn press_along_travels(boards: &mut [BoardState]) {
    for index in 0..boards.len() {
        for motor in 0..IZ_MOTOR {
            // One after the other, because each may be on any board.
            for number in 0.. {
                let shaft = boards[index].shafts[motor].as_ref();
                let switch = shaft.and_then(|shaft| shaft.switches().nth(number));
                let Some((switch, pressed)) = switch else { break };
                let (controller, input) = (switch.controller.unwrap_or(index), switch.input);
                press(boards, controller, input, pressed);
            }
        }
    }
}
