//! Lesson 5: each press of I1 lowers the load by 100 pulses.

use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor};
use ft_transfer_area::{Error, FishX1Transfer, TransferAreaComHandler};

/// The load needs less than two seconds.
const LIMIT: Duration = Duration::from_secs(5);

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    handler.begin_transfer()?;
    let pressed = |areas: &[FishX1Transfer]| areas[LOCAL_IO].input.uni[Input::I1.index()] != 0;
    let released = |areas: &[FishX1Transfer]| !pressed(areas);
    let arrived = |areas: &[FishX1Transfer]| areas[LOCAL_IO].get_in_cnt_count(Counter::C1) >= 100;
    loop {
        handler.areas().wait_until(pressed, Duration::MAX)?;
        handler.areas().lock()[LOCAL_IO].start_counter_reset(Counter::C1);
        handler.areas().wait_counter_reset(LOCAL_IO, Counter::C1, LIMIT)?;
        turn(&handler, Direction::Cw)?;
        handler.areas().wait_until(arrived, LIMIT)?;
        turn(&handler, Direction::Halt)?;
        handler.areas().wait_until(released, Duration::MAX)?;
    }
}

fn turn(handler: &TransferAreaComHandler, direction: Direction) -> Result<(), Error> {
    handler.areas().lock()[LOCAL_IO].set_out_motor_values(Motor::M1, DUTY_MAX, direction)?;
    Ok(())
}
