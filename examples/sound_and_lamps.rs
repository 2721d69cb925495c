//! Sound and lamps: one of four lamps after the other is lit, while sounds are played one after
//! another, until a button is pressed.
//!
//! Wiring: lamps between O5, O6, O7, O8 and ⊥, a push button on I1 (contacts 1 and 3). The
//! loudspeaker is in the TXT.
//!
//! ```text
//! cargo run --example sound_and_lamps                  # a simulated TXT; somebody presses I1
//! cargo run --example sound_and_lamps -- 192.168.7.2   # a TXT on USB
//! cargo run --example sound_and_lamps -- --seconds 30 127.0.0.1:65000
//! ```
//!
//! It ends when I1 is pressed, when its time is up, or on Ctrl-C; lamps off and silence.

mod common;

use std::process::ExitCode;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{InputMode, DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Input, Motor, Output, Sound, SILENCE};

const USAGE: &str = "usage: sound_and_lamps [--seconds N] [HOST[:PORT]]";

const LAMPS: [Output; 4] = [Output::O5, Output::O6, Output::O7, Output::O8];

const SOUNDS: [Sound; 4] =
    [Sound::Bell, Sound::CarHornShort, Sound::PropellerAirplane, Sound::ShipsHorn];

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let example = Example::start(USAGE, simulated)?;
    // The lamps go out when the loop below hangs for a second.
    let handler = example.handler().watchdog(Duration::from_secs(1)).build()?;
    {
        let area = &mut handler.lock()[LOCAL_IO];
        area.set_ft_uni_config(Input::I1, InputMode::Resistance, true);
        // The terminals of M3 and M4 are four single outputs.
        area.set_ft_motor_config(Motor::M3, false);
        area.set_ft_motor_config(Motor::M4, false);
    }
    handler.begin_transfer()?;

    println!("Press I1 to end it.");
    let mut played = 0;
    let mut lit = LAMPS.len();
    while example.goes_on() {
        let mut areas = handler.wait_cycle()?;
        let area = &mut areas[LOCAL_IO];
        if area.get_in_io_value_binary(Input::I1)? {
            println!("I1 is pressed.");
            break;
        }

        // The next sound begins when the one before has been played.
        if area.is_sound_ready() {
            area.set_sound(SOUNDS[played % SOUNDS.len()], 1)?;
            played += 1;
        }

        // Each lamp is lit for a quarter of a second.
        let next = usize::from(area.timer.timer_10ms / 25) % LAMPS.len();
        if next == lit {
            continue;
        }
        lit = next;
        for (index, lamp) in LAMPS.into_iter().enumerate() {
            area.set_out_pwm_values(lamp, if index == lit { DUTY_MAX } else { 0 })?;
        }
        // The console is slow, and the outputs leave when the areas are dropped.
        drop(areas);
        print_state(lit, SOUNDS[(played - 1) % SOUNDS.len()]);
    }

    // The end of the transfer switches the lamps off. A sound would play on.
    handler.lock()[LOCAL_IO].set_sound(SILENCE, 1)?;
    handler.end_transfer()?;
    Ok(())
}

fn print_state(lit: usize, sound: Sound) {
    let lamps: String =
        (0..LAMPS.len()).map(|lamp| if lamp == lit { " *" } else { " ." }).collect();
    println!("O5{lamps} O8   {}", sound.name());
}

fn simulated() -> common::Result<SimulatedTxtBuilder> {
    let world = World::from_toml(include_str!("worlds/lamps.toml"))?;
    Ok(SimulatedTxt::builder().world(world))
}
