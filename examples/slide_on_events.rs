//! A slide that goes to and fro between its end switches. Events turn it round.
//!
//! Wiring: the slide's encoder motor on M1 and C1, a switch at its start on I1, one at its end on
//! I2, a push button on I3 (all on contacts 1 and 3). M1 clockwise moves it towards I2.
//!
//! ```text
//! cargo run --example slide_on_events                  # a simulated TXT; somebody presses I3
//! cargo run --example slide_on_events -- 192.168.7.2   # a TXT on USB
//! cargo run --example slide_on_events -- --seconds 60 127.0.0.1:65000
//! ```
//!
//! It ends when I3 is pressed, when its time is up, or on Ctrl-C, with the motor stopped.

mod common;

use std::process::ExitCode;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::world::{ScriptEvent, Travel, World};
use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor};
use ft_transfer_area::{Event, EventKind, TransferAreaComHandler};

const USAGE: &str = "usage: slide_on_events [--seconds N] [HOST[:PORT]]";

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let example = Example::start(USAGE, simulated)?;
    // The motor stops when the loop below hangs for a second.
    let handler = example.handler().watchdog(Duration::from_secs(1)).build()?;
    let events = handler.events(&[EventKind::InputChanged], 100)?;
    handler.begin_transfer()?;

    // Only changes are told, so the slide may stand at its end already.
    let is_at_end = handler.wait_cycle()?[LOCAL_IO].get_in_io_value_binary(Input::I2)?;
    drive(&handler, if is_at_end { Direction::Ccw } else { Direction::Cw })?;
    println!("The slide moves. Press I3 to end it.");

    while example.goes_on() {
        // Nothing happens for long at times, so this says that the program is alive. It is also told
        // here when the transfer has ended.
        handler.feed_watchdog()?;
        let Ok(event) = events.recv_timeout(Duration::from_millis(100)) else { continue };
        match event {
            Event::InputChanged { input: Input::I1, pressed: true, .. } => {
                println!("I1, the start, after {} pulses.", pulses(&handler));
                drive(&handler, Direction::Cw)?;
            }
            Event::InputChanged { input: Input::I2, pressed: true, .. } => {
                println!("I2, the end, after {} pulses.", pulses(&handler));
                drive(&handler, Direction::Ccw)?;
            }
            Event::InputChanged { input: Input::I3, pressed: true, .. } => {
                println!("I3 is pressed.");
                break;
            }
            _ => {}
        }
    }
    println!("{} events were lost.", events.lost());
    // Stops the motor.
    handler.end_transfer()?;
    Ok(())
}

/// Moves the slide, and counts its pulses from here. The answer to an event goes out with the very
/// next request.
fn drive(handler: &TransferAreaComHandler, direction: Direction) -> common::Result {
    let area = &mut handler.lock()[LOCAL_IO];
    area.set_out_motor_values(Motor::M1, DUTY_MAX, direction)?;
    area.start_counter_reset(Counter::C1);
    Ok(())
}

fn pulses(handler: &TransferAreaComHandler) -> u16 {
    handler.lock()[LOCAL_IO].get_in_cnt_count(Counter::C1)
}

/// The slide of the default world with a faster motor, and somebody who presses the button.
fn simulated() -> common::Result<SimulatedTxtBuilder> {
    let mut world = World::default();
    for motor in world.master.motors.values_mut() {
        motor.top_speed = 9.0;
        if let Some(slide) = &mut motor.slide {
            (slide.travel, slide.position) = (Travel::Pulses(600.0), 540.0);
        }
    }
    let press = ScriptEvent { at: 3.0, controller: 0, input: Input::I3, pressed: true };
    world.script.events.push(press);
    Ok(SimulatedTxt::builder().world(world))
}
