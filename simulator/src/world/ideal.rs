//! What is plugged in without a world: an ideal motor on each motor output.

use ft_transfer_area::tx::Motor;

use super::board::{Board, BoardState};
use super::motor_model::MotorModel;
use super::shaft::TICK_MICROS;
use super::state::LONGEST_STEP;
use crate::machine::controller::Controller;

/// Pulses per second at duty 512.
const FULL_SPEED: f64 = 200.0;

/// So a motor at full speed makes two turns per second.
const PULSES_PER_TURN: f64 = 100.0;

/// The motors of a machine without a world. They have no inertia, and stop exactly at the end of a distance.
#[derive(Clone, Debug)]
pub(crate) struct IdealMotors {
    boards: Vec<BoardState>,
    /// Machine time since the last tick in µs.
    rest: u64,
}

impl IdealMotors {
    /// Four for each of so many controllers.
    pub(crate) fn new(controllers: usize) -> Self {
        let motor = MotorModel::default()
            .top_speed(FULL_SPEED / PULSES_PER_TURN)
            .time_constant(0.0)
            .pulses_per_turn(PULSES_PER_TURN)
            .run_out(0.0);
        let plug = |board: Board, output| board.motor(output, motor.clone());
        let board = Motor::ALL.into_iter().fold(Board::default(), plug);
        Self { boards: vec![BoardState::new(&board); controllers], rest: 0 }
    }

    /// Lets this many µs pass, for these controllers.
    pub(crate) fn move_on(&mut self, micros: u64, controllers: &mut [Controller]) {
        let passed = self.rest.saturating_add(micros);
        self.rest = passed % TICK_MICROS;
        for (board, controller) in self.boards.iter_mut().zip(controllers) {
            turn(board, controller, passed / TICK_MICROS);
        }
    }
}

/// Turns the motors of a controller for so many ticks.
fn turn(board: &mut BoardState, controller: &mut Controller, ticks: u64) {
    for done in 0..ticks.min(LONGEST_STEP / TICK_MICROS) {
        if controller.tasks().next().is_none() {
            // No motor changes its speed before the next command.
            return board.turn(controller, ticks - done);
        }
        let was_at_rest = board.is_at_rest();
        board.turn(controller, 1);
        if was_at_rest && board.is_at_rest() {
            // Nothing changes before the next command.
            return;
        }
    }
}
