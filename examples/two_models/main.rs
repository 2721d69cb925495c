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
//! cargo add ctrlc@3 --features termination
//! ```

use std::env;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::TransferAreaGuard;

const TURNS: u32 = 3;

/// What a light barrier reports. It is dark where the disc is.
const DARK: i16 = 0;
const LIGHT: i16 = 1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let address = env::args().nth(1).ok_or("expected the address of a controller")?;
    // The motor stops when this program hangs for a second.
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

    match carry_discs(areas) {
        Err(Error::NotStarted) => println!("Stopped by Ctrl-C."),
        result => result?,
    }
    handler.end_transfer()?;
    Ok(())
}

fn carry_discs(areas: &TransferAreas) -> Result<(), Error> {
    for turn in 1..=TURNS {
        // The other model has brought the disc.
        wait_for(areas, I1, DARK)?[LOCAL_IO].output.duty[O1] = DUTY_MAX;
        // It comes to the end, and leaves the belt.
        wait_for(areas, I2, DARK)?;
        wait_for(areas, I2, LIGHT)?[LOCAL_IO].output.duty[O1] = 0;
        println!("back: turn {turn}");
    }
    Ok(())
}

/// Waits until an input has this value, as long as it takes.
fn wait_for(
    areas: &TransferAreas,
    input: Input,
    wanted: i16,
) -> Result<TransferAreaGuard<'_>, Error> {
    areas.wait_until(|now| now[LOCAL_IO].input.uni[input] == wanted, Duration::MAX)
}
