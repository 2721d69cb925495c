//! Lesson 3: M1 turns clockwise while I1 is pressed and counter-clockwise while I2 is.

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
        let mut areas = handler.areas().wait_cycle()?;
        let area = &mut areas[LOCAL_IO];
        let i1 = area.get_in_io_value_binary(Input::I1)?;
        let i2 = area.get_in_io_value_binary(Input::I2)?;
        let direction = match (i1, i2) {
            (true, false) => Direction::Cw,
            (false, true) => Direction::Ccw,
            (false, false) | (true, true) => Direction::Halt,
        };
        area.set_out_motor_values(Motor::M1, DUTY_MAX, direction)?;
    }
}
