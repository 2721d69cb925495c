//! Lesson 5: each press of I1 lowers the load by 100 pulses.

use std::time::Duration;

use ft_transfer_area::prelude::*;

/// The load needs less than two seconds.
const LIMIT: Duration = Duration::from_secs(5);

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;
    let pressed = |now: &[FishX1Transfer]| now[LOCAL_IO].input.uni[I1] != 0;
    let released = |now: &[FishX1Transfer]| !pressed(now);
    let arrived = |now: &[FishX1Transfer]| now[LOCAL_IO].get_in_cnt_count(C1) >= 100;
    loop {
        areas.wait_until(pressed, Duration::MAX)?;
        areas.lock()[LOCAL_IO].start_counter_reset(C1);
        areas.wait_counter_reset(LOCAL_IO, C1, LIMIT)?;
        turn(areas, Direction::Cw)?;
        areas.wait_until(arrived, LIMIT)?;
        turn(areas, Direction::Halt)?;
        areas.wait_until(released, Duration::MAX)?;
    }
}

fn turn(areas: &TransferAreas, direction: Direction) -> Result<(), Error> {
    areas.lock()[LOCAL_IO].set_out_motor_values(M1, DUTY_MAX, direction)?;
    Ok(())
}
