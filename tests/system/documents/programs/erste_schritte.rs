//! M1 dreht sich, solange I1 gedrückt ist.

use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Direction, Input, Motor};
use ft_transfer_area::{Error, TransferAreaComHandler};

fn main() -> Result<(), Error> {
    // Die Adresse kommt von der Kommandozeile. 127.0.0.1 ist der simulierte TXT auf diesem Computer.
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    // Hängt die Schleife zwei Sekunden lang, halten die Motoren an.
    let handler = builder.watchdog(Duration::from_secs(2)).build()?;
    handler.begin_transfer()?;
    loop {
        let mut areas = handler.areas().wait_cycle()?;
        let area = &mut areas[LOCAL_IO];
        let pressed = area.get_in_io_value_binary(Input::I1)?;
        let direction = if pressed { Direction::Cw } else { Direction::Halt };
        area.set_out_motor_values(Motor::M1, DUTY_MAX, direction)?;
    }
}
