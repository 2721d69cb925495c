//! Sound and lamps: two lamps light in turn while sounds are played one after another, until a
//! button is pressed.
//!
//! Wiring: lamps between O7, O8 and ⊥, a push button on I3 (contacts 1 and 3). The loudspeaker is in
//! the TXT.
//!
//! ```text
//! cargo run --example sound_and_lamps                  # a simulated TXT
//! cargo run --example sound_and_lamps -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! When I3 is pressed, or on Ctrl-C, the lamps go out and the sound ends. Next: `c_program` has a lamp,
//! a sound and a motor.

use std::env;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::tx::Sound;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

const SOUNDS: [Sound; 4] =
    [Sound::Bell, Sound::CarHornShort, Sound::PropellerAirplane, Sound::ShipsHorn];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without an address, a simulated TXT runs as long as the second value lives.
    let (address, _simulated) = controller()?;
    // The lamps go out when the loop below hangs for a second.
    let handler =
        TransferAreaComHandler::builder(address).watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    {
        let area = &mut areas.lock()[LOCAL_IO];
        area.set_ft_uni_config(I3, InputMode::Resistance, true);
        // The terminals of M4 are two single outputs.
        area.set_ft_motor_config(M4, false);
    }
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, and so lamps and sound.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    println!("Press I3 to end it.");
    let mut sounds = SOUNDS.into_iter().cycle();
    let mut sound = "";
    let mut shown = None;
    let mut is_pressed = false;
    loop {
        let mut now = match areas.wait_cycle() {
            Err(Error::NotStarted) => break, // Ctrl-C
            cycle => cycle?,
        };
        let area = &mut now[LOCAL_IO];
        if area.get_in_io_value_binary(I3)? {
            is_pressed = true;
            break;
        }

        // The next sound begins when the one before has been played.
        if area.is_sound_ready() {
            if let Some(next) = sounds.next() {
                area.set_sound(next, 1)?;
                sound = next.name();
            }
        }

        // Each lamp is lit for half a second.
        let first = area.timer.timer_10ms / 50 % 2 == 0;
        area.set_out_pwm_values(O7, if first { DUTY_MAX } else { 0 })?;
        area.set_out_pwm_values(O8, if first { 0 } else { DUTY_MAX })?;

        // Printing is slow, and the outputs are sent after the guard is dropped.
        drop(now);
        let state = Some((first, sound));
        if state != shown {
            shown = state;
            println!(
                "O7 {}  O8 {}  {sound}",
                if first { "(*)" } else { "( )" },
                if first { "( )" } else { "(*)" }
            );
        }
    }

    // Switches the lamps off and ends the sound.
    handler.end_transfer()?;
    if is_pressed {
        println!("I3 is pressed.");
    }
    Ok(())
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), ft_transfer_area_simulator::Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!(
        "No address is given, so this is a simulated TXT. Its buttons are pressed by a script."
    );
    let txt = SimulatedTxt::builder().world(World::default()).start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
