//! The calls of the TX library and of FtTxtLib, as methods on one area.
//!
//! A C program names the controller in each call; here the call is a method of its
//! [`FishX1Transfer`](crate::FishX1Transfer): `SetOutMotorValues(LOCAL_IO, …)` becomes
//! `areas[LOCAL_IO].set_out_motor_values(…)`. Names and meaning are those of the C calls. No call
//! blocks or talks to the controller: it reads or writes the area under the guard that the program
//! holds, and what it writes goes out with the next exchange.
//!
//! Terminals, directions, modes and sounds have types, so no call can get a wrong number: `try_from`,
//! which makes them from numbers, refuses it. A call that returns an [`InvalidCall`] changes nothing.
//!
//! ```
//! use ft_transfer_area::tx::{Direction, InvalidCall, Motor, Output, Sound};
//! use ft_transfer_area::FishX1Transfer;
//!
//! # fn main() -> Result<(), InvalidCall> {
//! let mut area = FishX1Transfer::default(); // in a handler: areas[LOCAL_IO]
//! area.set_ft_motor_config(Motor::M4, false); // O7 and O8
//! area.set_out_pwm_values(Output::O7, 300)?;
//! area.set_out_motor_values(Motor::M1, 512, Direction::Ccw)?;
//! area.start_motor_ex_cmd(Motor::M2, 400, Direction::Cw, &[(Motor::M3, Direction::Cw)], 1000)?;
//! assert!(!area.is_motor_ex_ready(Motor::M2));
//! area.set_sound(Sound::Bell, 1)?;
//! assert!(matches!(Motor::try_from(4), Err(InvalidCall::OutOfRange { .. })));
//! # Ok(())
//! # }
//! ```
//!
//! The terminals and directions are those of the controller, the remotes and their parts those of the
//! infrared set. There can't be more, so these enums are closed on purpose: a `match` on them needs no
//! other arm. A new firmware may add sounds and input modes.
//!
//! # The extended motor mode
//!
//! With [`start_motor_ex_cmd`](crate::FishX1Transfer::start_motor_ex_cmd) the controller itself counts:
//! it resets the counters, turns the motors together and stops them after a number of pulses. Then it
//! holds them, and [`set_out_motor_values`](crate::FishX1Transfer::set_out_motor_values) does not turn
//! a motor until [`stop_motor_ex_cmd`](crate::FishX1Transfer::stop_motor_ex_cmd) has ended the mode
//! for it.

mod config;
mod counter;
mod input;
mod invalid_call;
mod joystick;
mod motor_ex;
mod number;
mod output;
mod sound;

pub use crate::terminals::{Counter, Input, Motor, Output};
pub use input::IoValue;
pub use invalid_call::InvalidCall;
pub use joystick::{IrDevice, JoystickAxis, JoystickPart, JoystickSwitch};
pub use output::{check_duty, check_power, Direction};
pub use sound::{Sound, SILENCE};

/// The id of a new command: neither the last command's id nor the one last reported as done, so that
/// the new command can't look done.
fn next_id(commanded: u16, finished: u16) -> u16 {
    let next = commanded.wrapping_add(1);
    if next == finished {
        next.wrapping_add(1)
    } else {
        next
    }
}
