//! The calls of the TX library and of FtTxtLib, as methods on one area.
//!
//! A C program names the controller in each call; here the call is a method of its
//! [`FishX1Transfer`](crate::FishX1Transfer): `SetOutMotorValues(LOCAL_IO, …)` becomes
//! `areas[LOCAL_IO].set_out_motor_values(…)`. Names and meaning are those of the C calls. No call
//! blocks or talks to the controller: each reads or writes the area under the lock that the
//! program holds, and what is written goes out with the next exchange.
//!
//! Terminals, directions, modes and sounds have types, so a wrong number can't be given to a call;
//! it is refused where it becomes one of them, by `try_from`. A call that errs has changed nothing.
//!
//! ```
//! use ft_transfer_area::tx::{Direction, Motor, Output, Sound};
//! use ft_transfer_area::{Error, FishX1Transfer};
//!
//! # fn main() -> Result<(), Error> {
//! let mut area = FishX1Transfer::default(); // as it is in a handler: areas[LOCAL_IO]
//! area.set_ft_motor_config(Motor::M4, false); // O7 and O8
//! area.set_out_pwm_values(Output::O7, 300)?;
//! area.set_out_motor_values(Motor::M1, 512, Direction::Ccw)?;
//! area.start_motor_ex_cmd(Motor::M2, 400, Direction::Cw, &[(Motor::M3, Direction::Cw)], 1000)?;
//! assert!(!area.is_motor_ex_ready(Motor::M2));
//! area.set_sound(Sound::Bell, 1)?;
//! assert!(matches!(Motor::try_from(4), Err(Error::OutOfRange { .. })));
//! # Ok(())
//! # }
//! ```
//!
//! # The extended motor mode
//!
//! [`start_motor_ex_cmd`](crate::FishX1Transfer::start_motor_ex_cmd) lets the controller count: it
//! resets the counters, turns the motors together and stops them after a number of pulses. From then
//! on it holds them, and [`set_out_motor_values`](crate::FishX1Transfer::set_out_motor_values)
//! does not turn them until
//! [`stop_motor_ex_cmd`](crate::FishX1Transfer::stop_motor_ex_cmd) has left the mode, for each of
//! them.

mod config;
mod counter;
mod input;
mod joystick;
mod motor_ex;
mod number;
mod output;
mod sound;

pub use crate::terminals::{Counter, Input, Motor, Output};
pub use input::IoValue;
pub use joystick::{IrDevice, JoystickAxis, JoystickPart, JoystickSwitch};
pub use output::Direction;
pub use sound::{Sound, SILENCE};

/// The id of a new command: neither the last one's nor the one that has come back, so that it can't
/// be taken for done.
fn next_id(commanded: u16, finished: u16) -> u16 {
    let next = commanded.wrapping_add(1);
    if next == finished {
        next.wrapping_add(1)
    } else {
        next
    }
}
