//! Lesson 6: the car drives 500 pulses straight ahead and back.

use std::time::Duration;

use ft_transfer_area::prelude::*;

/// One way takes about four seconds.
const LIMIT: Duration = Duration::from_secs(10);

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let handler = TransferAreaComHandler::builder(address).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;
    drive(areas, Direction::Cw)?;
    drive(areas, Direction::Ccw)?;
    handler.end_transfer()
}

/// Drives 500 pulses and waits until both wheels have arrived. The controller keeps M2 beside M1.
fn drive(areas: &TransferAreas, direction: Direction) -> Result<(), Error> {
    let slaves = [(M2, direction)];
    areas.lock()[LOCAL_IO].start_motor_ex_cmd(M1, DUTY_MAX, direction, &slaves, 500)?;
    areas.wait_motor_ex(LOCAL_IO, M1, LIMIT)?;
    areas.wait_motor_ex(LOCAL_IO, M2, LIMIT)?;
    Ok(())
}
