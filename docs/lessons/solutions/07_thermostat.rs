//! Lesson 7: the fan at M1 runs from 30 °C on, until it is colder than 25 °C.

use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Direction, Input, Motor};
use ft_transfer_area::{Error, TransferAreaComHandler};

/// What the NTC has at 30 °C and at 25 °C, in Ω. It has less when it is warmer.
const WARM: i16 = 1210;
const COLD: i16 = 1500;

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I1, InputMode::Resistance, false);
    handler.begin_transfer()?;
    loop {
        let mut areas = handler.areas().wait_cycle()?;
        let area = &mut areas[LOCAL_IO];
        let ohms = area.get_in_io_value_analogue(Input::I1)?;
        if ohms < WARM {
            area.set_out_motor_values(Motor::M1, DUTY_MAX, Direction::Cw)?;
        } else if ohms > COLD {
            area.set_out_motor_values(Motor::M1, 0, Direction::Halt)?;
        }
        // Between the two, the fan stays as it is.
    }
}
