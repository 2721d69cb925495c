//! Lesson 4: each press of I3 moves the slide to its other end.

use std::time::Duration;

use ft_transfer_area::prelude::*;

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;
    loop {
        // The slide is at I1.
        wait_for(areas, I3)?;
        go(areas, Direction::Cw, I2)?;
        wait_for(areas, I3)?;
        go(areas, Direction::Ccw, I1)?;
    }
}

/// Waits until this button or switch is pressed.
fn wait_for(areas: &TransferAreas, input: Input) -> Result<(), Error> {
    loop {
        if areas.wait_cycle()?[LOCAL_IO].get_in_io_value_binary(input)? {
            return Ok(());
        }
    }
}

/// Moves the slide until this switch is pressed.
fn go(areas: &TransferAreas, direction: Direction, until: Input) -> Result<(), Error> {
    areas.lock()[LOCAL_IO].set_out_motor_values(M1, DUTY_MAX, direction)?;
    wait_for(areas, until)?;
    areas.lock()[LOCAL_IO].set_out_motor_values(M1, 0, Direction::Halt)?;
    Ok(())
}
