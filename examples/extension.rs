//! Extension: the button on the master runs the motor on the extension, and the button on the
//! extension the motor on the master. While the extension is away, its motor can't be told anything
//! and its button is not believed.
//!
//! Wiring, the same on both controllers: a push button on I1 (contacts 1 and 3), a motor on M1. The
//! second TXT is connected to the first one's EXT socket, and set to be an extension in its menu.
//!
//! ```text
//! cargo run --example extension                  # a simulated TXT; somebody pulls the plug
//! cargo run --example extension -- 192.168.7.2   # a TXT on USB
//! cargo run --example extension -- --seconds 30 127.0.0.1:65000
//! ```
//!
//! It prints what has changed, and ends when its time is up or on Ctrl-C; all motors stop.

mod common;

use std::process::ExitCode;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{InputMode, DUTY_MAX, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::FishX1Transfer;

const USAGE: &str = "usage: extension [--seconds N] [HOST[:PORT]]";

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let example = Example::start(USAGE, simulated)?;
    // The master and one extension. All motors stop when the loop below hangs for a second.
    let handler = example.handler().areas(2).watchdog(Duration::from_secs(1)).build()?;
    handler.lock().iter_mut().for_each(configure);
    handler.begin_transfer()?;

    // Whether the extension is there, and the two buttons, as printed last.
    let mut shown: Option<(bool, bool, bool)> = None;
    while example.goes_on() {
        let mut areas = handler.wait_cycle()?;
        let is_there = areas[LOCAL_IO].slaves_alive() > 0;
        if is_there && matches!(shown, Some((false, ..))) {
            // It may have been switched off, and forgotten what it was told.
            configure(&mut areas[REMOTE_IO_1]);
        }

        let master_pressed = areas[LOCAL_IO].get_in_io_value_binary(Input::I1)?;
        // While it is away, its area has the inputs that it sent last.
        let extension_pressed = is_there && areas[REMOTE_IO_1].get_in_io_value_binary(Input::I1)?;
        let power = |pressed| if pressed { DUTY_MAX } else { 0 };
        areas[REMOTE_IO_1].set_out_motor_power(Motor::M1, power(master_pressed))?;
        areas[LOCAL_IO].set_out_motor_power(Motor::M1, power(extension_pressed))?;

        // The console is slow, and the outputs leave when the areas are dropped.
        drop(areas);
        let state = Some((is_there, master_pressed, extension_pressed));
        if state != shown {
            shown = state;
            let button = |pressed| if pressed { "pressed" } else { "open   " };
            let motor = |runs| if runs { "runs" } else { "stands" };
            print!(
                "master: I1 {}, M1 {:6}    extension: ",
                button(master_pressed),
                motor(extension_pressed)
            );
            if is_there {
                println!("I1 {}, M1 {}", button(extension_pressed), motor(master_pressed));
            } else {
                println!("away");
            }
        }
    }
    handler.end_transfer()?;
    Ok(())
}

fn configure(area: &mut FishX1Transfer) {
    area.set_ft_uni_config(Input::I1, InputMode::Resistance, true);
}

/// A TXT with an extension that is unplugged for a second every five, of 100 exchanges each.
fn simulated() -> common::Result<SimulatedTxtBuilder> {
    let world = World::from_toml(include_str!("worlds/extension.toml"))?;
    Ok(SimulatedTxt::builder().extensions(1).world(world).on_exchange(|machine| {
        let exchange = machine.exchanges() % 500;
        machine.alive[0] = !(180..280).contains(&exchange);
    }))
}
