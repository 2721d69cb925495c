//! Lesson 1: the lamp at O8 is lit while I1 is pressed.

use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area::{Error, TransferAreaComHandler};

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    // O7 and O8 are two single outputs, no motor M4.
    handler.areas().lock()[LOCAL_IO].set_ft_motor_config(Motor::M4, false);
    handler.begin_transfer()?;
    loop {
        let mut areas = handler.areas().wait_cycle()?;
        let area = &mut areas[LOCAL_IO];
        let pressed = area.get_in_io_value_binary(Input::I1)?;
        area.set_out_pwm_values(Output::O8, if pressed { DUTY_MAX } else { 0 })?;
    }
}
