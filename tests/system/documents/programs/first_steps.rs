//! M1 turns while I1 is pressed.

use std::time::Duration;

use ft_transfer_area::prelude::*;

fn main() -> Result<(), Error> {
    // The address comes from the command line. 127.0.0.1 is the simulated TXT on this computer.
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    // If the loop hangs for two seconds, the motors stop.
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;
    loop {
        let mut now = areas.wait_cycle()?;
        let area = &mut now[LOCAL_IO];
        let pressed = area.get_in_io_value_binary(I1)?;
        let direction = if pressed { Direction::Cw } else { Direction::Halt };
        area.set_out_motor_values(M1, DUTY_MAX, direction)?;
    }
}
