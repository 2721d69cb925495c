//! One of two models that wait for each other: a belt that carries a disc back. The other one carries it there, and
//! has a program in C, `there.c`. `docs/two_models.md` explains both.
//!
//! Wiring: a light barrier on I1 at the start of the belt, where the other model brings the disc, another one on I2
//! at its end, the motor of the belt on M1.
//!
//! ```text
//! cargo run --example two_models -- 127.0.0.1:65003   # a simulated TXT of txt simulate
//! cargo run --example two_models -- 192.168.7.2       # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ctrlc@3
//! ```

use std::env;
use std::time::Duration;

use ft_transfer_area::prelude::*;

const TURNS: u32 = 3;

/// What a light barrier reports. It is dark where the disc is.
const DARK: i16 = 0;
const LIGHT: i16 = 1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let address = env::args().nth(1).ok_or("expected the address of a controller")?;
    // The motor stops when the loop below hangs for a second.
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    for input in [I1, I2] {
        areas.lock()[LOCAL_IO].set_ft_uni_config(input, InputMode::Resistance, true);
    }
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motor.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    for turn in 1..=TURNS {
        // The other model has brought the disc.
        wait_until(areas, I1, DARK)?;
        areas.lock()[LOCAL_IO].output.duty[O1] = DUTY_MAX;
        // It comes to the end, and leaves the belt.
        wait_until(areas, I2, DARK)?;
        wait_until(areas, I2, LIGHT)?;
        areas.lock()[LOCAL_IO].output.duty[O1] = 0;
        println!("back: turn {turn}");
    }
    handler.end_transfer()?;
    Ok(())
}

/// Looks at each exchange. Fails when there are no more.
fn wait_until(areas: &TransferAreas, input: Input, wanted: i16) -> Result<(), Error> {
    while areas.wait_cycle()?[LOCAL_IO].input.uni[input] != wanted {}
    Ok(())
}
