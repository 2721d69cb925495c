//! A slide that moves back and forth between its end switches. Events reverse it.
//!
//! Wiring: the slide's encoder motor on M3 and C3, a switch at its start on I4, one at its end on
//! I5, a push button on I3 (all on contacts 1 and 3). M3 clockwise moves it towards I5.
//!
//! ```text
//! cargo run --example slide_on_events                  # a simulated TXT
//! cargo run --example slide_on_events -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! When I3 is pressed, or on Ctrl-C, the motor stops and the program ends. Next: `wifi`, which goes on
//! after a lost connection.

use std::env;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area::{Event, EventKind};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// If a running motor counts nothing for this time, it is blocked or not plugged in.
const STILL: Duration = Duration::from_secs(2);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without an address, a simulated TXT runs as long as the second value lives.
    let (address, _simulated) = controller()?;
    // The motor stops when the loop below hangs for a second.
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    let events = areas.events(&[EventKind::InputChanged], 100)?;
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    // There are only events for changes, but the slide may already be at its end.
    let is_at_end = areas.wait_cycle()?[LOCAL_IO].get_in_io_value_binary(I5)?;
    drive(areas, if is_at_end { Direction::Ccw } else { Direction::Cw })?;
    println!("The slide moves. Press I3 to end it.");

    // The count of C3, and since when.
    let (mut count, mut since) = (0, Instant::now());
    // Sometimes nothing happens for a long time, so this shows the watchdog that the program is alive.
    // It fails when the transfer has ended.
    let mut why = None;
    while why.is_none() && areas.feed_watchdog().is_ok() {
        match events.recv_timeout(Duration::from_millis(100)).map(|timed| timed.event) {
            Ok(Event::InputChanged { input: I4, pressed: true, .. }) => {
                let count = pulses(areas);
                drive(areas, Direction::Cw)?;
                // Printing may take long, so the motor does not wait for it.
                println!("I4, the start, after {count} pulses.");
            }
            Ok(Event::InputChanged { input: I5, pressed: true, .. }) => {
                let count = pulses(areas);
                drive(areas, Direction::Ccw)?;
                println!("I5, the end, after {count} pulses.");
            }
            Ok(Event::InputChanged { input: I3, pressed: true, .. }) => {
                why = Some("I3 is pressed.".to_owned());
            }
            _ => {}
        }
        if pulses(areas) != count {
            (count, since) = (pulses(areas), Instant::now());
        } else if since.elapsed() > STILL {
            let what = format!("The slide stands still at {count} pulses.");
            why = Some(what + " Are M3, C3, I4 and I5 plugged in?");
        }
    }
    // Stops the motor, and returns the error, if one has ended the transfer.
    handler.end_transfer()?;
    why.iter().for_each(|why| println!("{why}"));
    println!("{} events were lost.", events.lost());
    Ok(())
}

/// Moves the slide, and counts its pulses from here. The next request has this answer to an event.
fn drive(areas: &TransferAreas, direction: Direction) -> Result<(), Error> {
    let area = &mut areas.lock()[LOCAL_IO];
    area.set_out_motor_values(M3, DUTY_MAX, direction)?;
    area.start_counter_reset(C3);
    Ok(())
}

fn pulses(areas: &TransferAreas) -> u16 {
    areas.lock()[LOCAL_IO].get_in_cnt_count(C3)
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
