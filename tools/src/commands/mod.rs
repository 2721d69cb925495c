//! The commands for one area, from a page or from the master of a broker.

pub(crate) mod names;
mod reconfigured;
mod sentence;
#[cfg(test)]
mod tests;

use ft_transfer_area::transfer_area::{CounterMode, InputMode};
use ft_transfer_area::tx::{
    check_duty, check_power, Counter, Direction, Input, InvalidCall, Motor, Output, SILENCE,
};
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;

pub(crate) use self::reconfigured::Reconfigured;
pub(crate) use self::sentence::sentence;

/// A command for one area. Its numbers are checked when it is applied.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    InputMode {
        input: Input,
        mode: InputMode,
        digital: bool,
    },
    CounterMode {
        counter: Counter,
        mode: CounterMode,
    },
    Pair {
        motor: Motor,
        kind: Pair,
    },
    ResetCounter(Counter),
    /// Plain speed control, which ends a distance of this motor.
    Motor {
        motor: Motor,
        duty: i64,
        /// Whether the motors that follow this one are stopped. Otherwise they go on.
        stops_followers: bool,
    },
    /// A distance; without pulses, motors that turn together without end.
    Move {
        motor: Motor,
        duty: i64,
        pulses: Option<u32>,
        with: Vec<Follower>,
    },
    StopMotor(Motor),
    Output {
        output: Output,
        duty: i64,
    },
    Sound {
        index: i64,
        repeat: u16,
    },
}

/// A motor that moves together with another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Follower {
    pub(crate) motor: Motor,
    /// Whether it turns the other way.
    pub(crate) opposite: bool,
}

/// What a pair of outputs is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Pair {
    Motor,
    Outputs,
}

impl Pair {
    /// Its name in messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Outputs => "outputs",
        }
    }

    pub(crate) fn of(area: &FishX1Transfer, motor: Motor) -> Self {
        match area.config.motor[motor.index()] {
            0 => Self::Outputs,
            _ => Self::Motor,
        }
    }
}

impl Command {
    /// Changes the area as the command says. An error leaves it as it is.
    pub(crate) fn apply(&self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        let mut changed = *area;
        self.change(&mut changed)?;
        *area = changed;
        Ok(())
    }

    /// An error if the command is wrong for every area: a number is out of range, or a motor is named twice.
    pub(crate) fn check(&self) -> Result<(), InvalidCall> {
        let mut area = FishX1Transfer::default();
        if let Self::Output { output, .. } = self {
            area.set_ft_motor_config(output.motor(), false);
        }
        self.change(&mut area)
    }

    fn change(&self, area: &mut FishX1Transfer) -> Result<(), InvalidCall> {
        match *self {
            Self::InputMode { input, mode, digital } => {
                let config = area.config.uni[input.index()];
                // The same again would only take the value away.
                if (config.input_mode(), config.is_digital()) != (Some(mode), digital) {
                    area.set_ft_uni_config(input, mode, digital);
                }
            }
            Self::CounterMode { counter, mode } => area.set_ft_cnt_config(counter, mode),
            Self::Pair { motor, kind } => area.set_ft_motor_config(motor, kind == Pair::Motor),
            Self::ResetCounter(counter) => area.start_counter_reset(counter),
            Self::Motor { motor, duty, stops_followers } => {
                turn(area, motor, duty, stops_followers)?;
            }
            Self::Move { motor, duty, pulses, ref with } => go(area, motor, duty, pulses, with)?,
            Self::StopMotor(motor) => area.stop_motor_ex_cmd(motor)?,
            Self::Output { output, duty } => area.set_out_pwm_values(output, check_duty(duty)?)?,
            Self::Sound { index, repeat } => area.set_sound(index, repeat)?,
        }
        Ok(())
    }
}

fn turn(
    area: &mut FishX1Transfer,
    motor: Motor,
    duty: i64,
    stops_followers: bool,
) -> Result<(), InvalidCall> {
    if stops_followers {
        for other in Motor::ALL {
            if usize::from(area.output.master[other.index()]) == motor.index() + 1 {
                area.stop_motor_ex_cmd(other)?;
            }
        }
    }
    let index = motor.index();
    if area.output.distance[index] != 0 || area.output.master[index] != 0 {
        area.stop_motor_ex_cmd(motor)?;
    }
    area.set_out_motor_power(motor, check_power(duty)?)
}

fn go(
    area: &mut FishX1Transfer,
    motor: Motor,
    duty: i64,
    pulses: Option<u32>,
    with: &[Follower],
) -> Result<(), InvalidCall> {
    let duty = check_power(duty)?;
    let (ahead, back) = match duty {
        ..0 => (Direction::Ccw, Direction::Cw),
        0.. => (Direction::Cw, Direction::Ccw),
    };
    let slave =
        |follower: &Follower| (follower.motor, if follower.opposite { back } else { ahead });
    let slaves: Vec<_> = with.iter().map(slave).collect();
    match pulses {
        Some(pulses) => area.start_motor_ex_cmd(motor, duty.abs(), ahead, &slaves, pulses),
        None => area.start_synchronised(motor, duty.abs(), ahead, &slaves),
    }
}

/// Whether an extension took part in the response that the areas show. The master always does.
pub(crate) fn is_connected(areas: &[FishX1Transfer], index: usize) -> bool {
    let Some(extension) = index.checked_sub(1) else { return true };
    let alive = areas.first().and_then(|master| master.state.io_slave_alive.get(extension));
    alive.is_some_and(|alive| *alive != 0)
}

/// Why a command for an extension that is not connected does nothing.
pub(crate) fn absent(extension: usize) -> String {
    format!("extension {extension} is not connected")
}

/// Stops what an extension that is not connected was told before: it would turn when the extension comes back.
pub(crate) fn stop_absent(areas: &mut [FishX1Transfer]) {
    for index in 1..areas.len() {
        if !is_connected(areas, index) && is_on(&areas[index]) {
            stop_all(&mut areas[index..=index]);
        }
    }
}

/// Whether there is something to stop.
fn is_on(area: &FishX1Transfer) -> bool {
    let output = &area.output;
    output.duty != [0; 8] || output.distance != [0; 4] || output.master != [0; 4] || sounds(area)
}

fn sounds(area: &FishX1Transfer) -> bool {
    !area.is_sound_ready() && area.txt_outputs.sound_index != SILENCE
}

/// Switches off all motors, outputs and sounds.
pub(crate) fn stop_all(areas: &mut [FishX1Transfer]) {
    for area in areas {
        area.output.stop_motors();
        if sounds(area) {
            area.txt_outputs.sound_index = SILENCE;
            area.raise_sound_cmd_id();
        }
    }
}
