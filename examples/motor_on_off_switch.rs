//! Motor on/off switch: M1 runs while I1 is pressed, on the master and on the first extension.
//! A port of the kit's sample MotorOnOffSwitch.
//!
//! ```text
//! cargo run --example motor_on_off_switch                  # a simulated TXT, for ten seconds
//! cargo run --example motor_on_off_switch -- 192.168.7.2   # a TXT on USB, until Ctrl-C
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! It prints its wiring, and says what is not plugged in. Ctrl-C stops the motors and ends the
//! transfer. Next: `slide_on_events` for a program that reacts, `extended_motor_control` for one
//! that counts.

use std::env;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area::transfer_area::{NO_ULTRASONIC, ULTRASONIC_MAX};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Error, SimulatedTxt};

const HEAD: &str = "
M1 runs while I1 is pressed. The wiring, the same on the master and on extension 1:

  I1  push button (contacts 1 and 3)
  I2  ultrasonic sensor
  M1  encoder motor, its encoder on C1

          master                         │ extension 1
   time   I1       I2      M1         C1 │ I1       I2      M1         C1";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (address, simulated) = controller()?;

    // Transfer areas for the master and one extension. The watchdog stops all motors when the loop
    // below hangs for a second.
    let builder = TransferAreaComHandler::builder(address).areas(2);
    let handler = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    for area in areas.lock().iter_mut() {
        area.set_ft_uni_config(I2, InputMode::Ultrasonic, false);
    }
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    println!("Connected to {}.\n{HEAD}", handler.device_name().unwrap_or_default());
    let start = Instant::now();
    let mut shown = [FishX1Transfer::default(); 2];
    let cycles = if simulated.is_some() { 1000 } else { u64::MAX };
    for cycle in 0..cycles {
        // The inputs of the next exchange, one every 10 ms. Ctrl-C or an error ends the loop.
        let Ok(mut now) = areas.wait_cycle() else { break };

        // For the other direction, set duty[O2] instead of duty[O1].
        for area in now.iter_mut() {
            let pressed = area.input.uni[I1] != 0;
            area.output.duty[O1] = if pressed { DUTY_MAX } else { 0 }; // M1
        }

        // Printing is slow, and the outputs are sent after the guard is dropped. So a copy is printed.
        let copy = [now[LOCAL_IO], now[REMOTE_IO_1]];
        drop(now);

        // Each change of I1 is shown, and a running motor four times a second.
        let changed = (0..2).any(|i| copy[i].output.duty != shown[i].output.duty);
        let runs = copy.iter().any(|area| area.output.duty[O1] != 0);
        if cycle == 0 || changed || runs && cycle % 25 == 0 {
            // All inputs, counters and outputs, as the kit prints them: println!("{}", copy[0]);
            let seconds = start.elapsed().as_secs_f64();
            let extension = if copy[LOCAL_IO].slaves_alive() > 0 {
                columns(&copy[REMOTE_IO_1], &shown[REMOTE_IO_1])
            } else {
                "not plugged in".to_owned()
            };
            println!(
                "{seconds:6.2} s  {} │ {extension}",
                columns(&copy[LOCAL_IO], &shown[LOCAL_IO])
            );
            shown = copy;
        }
    }

    // This returns the error, if one has ended the transfer.
    handler.end_transfer()?;
    let statistics = areas.statistics();
    println!(
        "The motors are stopped. {} exchanges of {:.1} to {:.1} ms were done; {} were answered too late for the \
         next one.",
        statistics.cycles,
        statistics.shortest_cycle.as_secs_f64() * 1e3,
        statistics.longest_cycle.as_secs_f64() * 1e3,
        statistics.late_reactions,
    );
    Ok(())
}

/// I1, I2, M1 and C1 of a controller, whose values `before` were shown last.
fn columns(area: &FishX1Transfer, before: &FishX1Transfer) -> String {
    let button = if area.input.uni[I1] != 0 { "pressed" } else { "open" };
    let distance = match area.input.uni[I2] {
        cm @ ..=ULTRASONIC_MAX => format!("{cm} cm"),
        NO_ULTRASONIC => "none".to_owned(),
        _ => "far".to_owned(),
    };
    let (count, counted) =
        (area.input.counter[C1], area.input.counter[C1] != before.input.counter[C1]);
    let motor = match (area.output.duty[O1], before.output.duty[O1]) {
        (0, _) => "off",
        // A motor without an encoder, no motor, or a wheel that is blocked.
        (_, on) if on != 0 && !counted => "no count",
        _ => "runs",
    };
    format!("{button:7}  {distance:6}  {motor:8} {count:4}")
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!(
        "No address is given, so this is a simulated TXT. Its buttons are pressed by a script."
    );
    let txt = SimulatedTxt::builder().world(World::default()).start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
