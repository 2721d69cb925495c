//! Lesson 6: the car drives 500 pulses straight ahead and back.

use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Direction, Motor};
use ft_transfer_area::{Error, TransferAreaComHandler};

/// One way takes about four seconds.
const LIMIT: Duration = Duration::from_secs(10);

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let handler = TransferAreaComHandler::builder(address).build()?;
    handler.begin_transfer()?;
    drive(&handler, Direction::Cw)?;
    drive(&handler, Direction::Ccw)?;
    handler.end_transfer()
}

/// Drives 500 pulses and waits until both wheels have arrived. The controller keeps M2 beside M1.
fn drive(handler: &TransferAreaComHandler, direction: Direction) -> Result<(), Error> {
    let slaves = [(Motor::M2, direction)];
    handler.areas().lock()[LOCAL_IO].start_motor_ex_cmd(
        Motor::M1,
        DUTY_MAX,
        direction,
        &slaves,
        500,
    )?;
    handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, LIMIT)?;
    handler.areas().wait_motor_ex(LOCAL_IO, Motor::M2, LIMIT)?;
    Ok(())
}
