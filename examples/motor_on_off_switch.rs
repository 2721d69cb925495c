//! Motor on/off switch: M1 runs while I1 is pressed, on the master and on the first extension.
//! A port of the kit's sample MotorOnOffSwitch.
//!
//! Wiring, the same on both controllers: a push button on I1 (contacts 1 and 3), an ultrasonic
//! sensor on I2, a motor on M1. What is missing on the table reads as not connected.
//!
//! ```text
//! cargo run --example motor_on_off_switch                  # a simulated TXT with one extension
//! cargo run --example motor_on_off_switch -- 192.168.7.2   # a TXT on USB
//! cargo run --example motor_on_off_switch -- --seconds 60 192.168.8.2
//! cargo run --example motor_on_off_switch -- 127.0.0.1:65000   # the program simulated_txt
//! ```
//!
//! Every third exchange the inputs, counters and outputs of both controllers are printed. Ctrl-C
//! stops the motors and goes offline before the program exits.

mod common;

use std::process::ExitCode;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{InputMode, UniConfig, DUTY_MAX, LOCAL_IO, REMOTE_IO_1};

const USAGE: &str = "usage: motor_on_off_switch [--seconds N] [HOST[:PORT]]";

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let example = Example::start(USAGE, simulated)?;

    // Create the communication handler with its transfer areas: the master and one extension. Its
    // watchdog stops all motors when the loop below hangs for a second.
    let handler = example.handler().areas(2).watchdog(Duration::from_secs(1)).build()?;

    // Configure I2 of master and extension to ultrasonic.
    for area in handler.lock().iter_mut() {
        area.config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
        area.raise_config_id();
    }

    handler.begin_transfer()?;
    println!(
        "{} with firmware {} at {}:{}",
        handler.device_name().unwrap_or_default(),
        handler.version().map(|version| version.to_string()).unwrap_or_default(),
        example.host,
        example.port,
    );

    // Loop for the given time, or until Ctrl-C.
    let mut transfers = 0_u64;
    while example.goes_on() {
        // Wait for the inputs of the next exchange. It comes in every 10 ms.
        let mut areas = handler.wait_cycle()?;

        // Set M1 depending on I1. For the other direction, set duty[1] instead of duty[0].
        for index in [LOCAL_IO, REMOTE_IO_1] {
            let pressed = areas[index].input.uni[0] != 0;
            areas[index].output.duty[0] = if pressed { DUTY_MAX } else { 0 };
        }

        // Print after the guard is dropped: the console is slow, and the outputs leave then.
        let lines =
            (transfers % 3 == 0).then(|| format!("{}\n{}", areas[LOCAL_IO], areas[REMOTE_IO_1]));
        drop(areas);
        if let Some(lines) = lines {
            println!("{lines}");
        }
        transfers += 1;
    }

    // Stop the motors and go offline.
    let statistics = handler.statistics();
    handler.end_transfer()?;

    // This should be around 100 for each second.
    println!("{transfers} transfers done");
    println!(
        "{} cycles of {:.1} to {:.1} ms, {} late reactions, {} configurations sent",
        statistics.cycles,
        statistics.shortest_cycle.as_secs_f64() * 1e3,
        statistics.longest_cycle.as_secs_f64() * 1e3,
        statistics.late_reactions,
        statistics.config_updates,
    );
    Ok(())
}

/// The kit's wiring, and somebody who presses the buttons.
fn simulated() -> common::Result<SimulatedTxtBuilder> {
    let world = World::from_toml(include_str!("worlds/kit.toml"))?;
    Ok(SimulatedTxt::builder().world(world))
}
