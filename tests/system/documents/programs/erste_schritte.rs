//! M1 dreht sich, solange I1 gedrückt ist.

use std::time::Duration;

use ft_transfer_area::prelude::*;

fn main() -> Result<(), Error> {
    // Die Adresse kommt von der Kommandozeile. 127.0.0.1 ist der simulierte TXT auf diesem Computer.
    let address = std::env::args().nth(1).unwrap_or(String::from("127.0.0.1"));
    let builder = TransferAreaComHandler::builder(address);
    // Hängt die Schleife zwei Sekunden lang, halten die Motoren an.
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
