//! Lesson 3: M1 turns clockwise while I1 is pressed and counter-clockwise while I2 is.

use std::time::Duration;

use ft_transfer_area::prelude::*;

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;
    loop {
        let mut now = areas.wait_cycle()?;
        let area = &mut now[LOCAL_IO];
        let i1 = area.get_in_io_value_binary(I1)?;
        let i2 = area.get_in_io_value_binary(I2)?;
        let direction = match (i1, i2) {
            (true, false) => Direction::Cw,
            (false, true) => Direction::Ccw,
            (false, false) | (true, true) => Direction::Halt,
        };
        area.set_out_motor_values(M1, DUTY_MAX, direction)?;
    }
}
