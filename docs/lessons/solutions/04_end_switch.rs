//! Lesson 4: each press of I3 moves the slide to its other end.

use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Direction, Input, Motor};
use ft_transfer_area::{Error, TransferAreaComHandler};

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    handler.begin_transfer()?;
    loop {
        // The slide is at I1.
        wait_for(&handler, Input::I3)?;
        go(&handler, Direction::Cw, Input::I2)?;
        wait_for(&handler, Input::I3)?;
        go(&handler, Direction::Ccw, Input::I1)?;
    }
}

/// Waits until this button or switch is pressed.
fn wait_for(handler: &TransferAreaComHandler, input: Input) -> Result<(), Error> {
    loop {
        if handler.areas().wait_cycle()?[LOCAL_IO].get_in_io_value_binary(input)? {
            return Ok(());
        }
    }
}

/// Moves the slide until this switch is pressed.
fn go(handler: &TransferAreaComHandler, direction: Direction, until: Input) -> Result<(), Error> {
    handler.areas().lock()[LOCAL_IO].set_out_motor_values(Motor::M1, DUTY_MAX, direction)?;
    wait_for(handler, until)?;
    handler.areas().lock()[LOCAL_IO].set_out_motor_values(Motor::M1, 0, Direction::Halt)?;
    Ok(())
}
