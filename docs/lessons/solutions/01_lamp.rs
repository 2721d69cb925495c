//! Lesson 1: the lamp at O8 is lit while I1 is pressed.

use std::time::Duration;

use ft_transfer_area::prelude::*;

fn main() -> Result<(), Error> {
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    // O7 and O8 are two single outputs, no motor M4.
    areas.lock()[LOCAL_IO].set_ft_motor_config(M4, false);
    handler.begin_transfer()?;
    loop {
        let mut now = areas.wait_cycle()?;
        let area = &mut now[LOCAL_IO];
        let pressed = area.get_in_io_value_binary(I1)?;
        area.set_out_pwm_values(O8, if pressed { DUTY_MAX } else { 0 })?;
    }
}
