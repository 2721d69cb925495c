//! Lesson 7: the fan at M1 runs from 30 °C on, until it is colder than 25 °C.

use std::time::Duration;

use ft_transfer_area::prelude::*;

/// What the NTC has at 30 °C and at 25 °C, in Ω. It has less when it is warmer.
const WARM: i16 = 1210;
const COLD: i16 = 1500;

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    areas.lock()[LOCAL_IO].set_ft_uni_config(I1, InputMode::Resistance, false);
    handler.begin_transfer()?;
    loop {
        let mut now = areas.wait_cycle()?;
        let area = &mut now[LOCAL_IO];
        let ohms = area.get_in_io_value_analogue(I1)?;
        if ohms < WARM {
            area.set_out_motor_values(M1, DUTY_MAX, Direction::Cw)?;
        } else if ohms > COLD {
            area.set_out_motor_values(M1, 0, Direction::Halt)?;
        }
        // Between the two, the fan stays as it is.
    }
}
