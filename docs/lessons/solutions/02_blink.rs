//! Lesson 2: the lamp at O8 blinks, half a second on and half a second off.

use std::thread::sleep;
use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Motor, Output};
use ft_transfer_area::{Error, TransferAreaComHandler};

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    handler.areas().lock()[LOCAL_IO].set_ft_motor_config(Motor::M4, false);
    handler.begin_transfer()?;
    loop {
        for duty in [DUTY_MAX, 0] {
            // The guard ends with this line, so the lamp changes before the program sleeps.
            handler.areas().wait_cycle()?[LOCAL_IO].set_out_pwm_values(Output::O8, duty)?;
            sleep(Duration::from_millis(500));
        }
    }
}
