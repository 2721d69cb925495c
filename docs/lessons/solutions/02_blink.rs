//! Lesson 2: the lamp at O8 blinks, half a second on and half a second off.

use std::thread::sleep;
use std::time::Duration;

use ft_transfer_area::prelude::*;

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    areas.lock()[LOCAL_IO].set_ft_motor_config(M4, false);
    handler.begin_transfer()?;
    loop {
        for duty in [DUTY_MAX, 0] {
            // The guard ends with this line, so the lamp changes before the program sleeps.
            areas.wait_cycle()?[LOCAL_IO].set_out_pwm_values(O8, duty)?;
            sleep(Duration::from_millis(500));
        }
    }
}
