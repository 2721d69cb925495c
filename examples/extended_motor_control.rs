//! Extended motor control: motors that the controller stops after a number of pulses of their
//! encoders, alone and synchronised, and how to leave that mode again. A port of FtTxtLib's sample
//! TestProj02 and of the TX library's sample of extended motor control.
//!
//! Wiring: two encoder motors on M1 and M2, their encoders on C1 and C2.
//!
//! ```text
//! cargo run --example extended_motor_control                  # a simulated TXT
//! cargo run --example extended_motor_control -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! The motors turn as soon as it starts, for about four seconds. Ctrl-C stops them. Next: `wifi` for
//! distances over a connection that may be lost.

use std::env;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::tx::Direction::{Ccw, Cw};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// A little more than two turns of fischertechnik's encoder motor.
const PULSES: u16 = 150;

/// Longer than any of these movements takes, unless a motor is stuck or its encoder is not plugged in.
const LIMIT: Duration = Duration::from_secs(5);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without an address, a simulated TXT runs as long as the second value lives.
    let (address, _simulated) = controller()?;
    // The motors stop when this program hangs for a second.
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    let driven = drive(areas);
    handler.end_transfer()?;
    // Printing may take long, so it comes when the motors stand.
    match &driven {
        Err(Error::NotStarted) => {
            println!("Stopped by Ctrl-C.");
            return Ok(());
        }
        Err(Error::WaitTimedOut { .. }) => {
            println!("A motor has not arrived. Are M1 with C1 and M2 with C2 plugged in, and free to turn?");
        }
        _ => {}
    }
    Ok(driven?)
}

fn drive(areas: &TransferAreas) -> Result<(), Error> {
    println!("M1 turns for {PULSES} pulses.");
    areas.lock()[LOCAL_IO].start_motor_ex_cmd(M1, DUTY_MAX, Cw, &[], PULSES.into())?;
    // A copy is printed, because the outputs wait for the end of a guard.
    let area = areas.wait_motor_ex(LOCAL_IO, M1, LIMIT)?[LOCAL_IO];
    print_counters("arrived", &area);

    // A distance begins with a reset of its counters, but the old counts stay until the first response.
    // So reset them before.
    areas.lock()[LOCAL_IO].start_counter_reset(C1);
    areas.lock()[LOCAL_IO].start_counter_reset(C2);
    areas.wait_counter_reset(LOCAL_IO, C1, LIMIT)?;
    let area = areas.wait_counter_reset(LOCAL_IO, C2, LIMIT)?[LOCAL_IO];
    print_counters("counters reset", &area);

    println!("M1 and M2 turn together for {PULSES} pulses, M2 the other way round.");
    let slaves = [(M2, Ccw)];
    areas.lock()[LOCAL_IO].start_motor_ex_cmd(M1, DUTY_MAX, Cw, &slaves, PULSES.into())?;
    for quarter in 1..4 {
        let enough =
            |now: &[FishX1Transfer]| now[LOCAL_IO].get_in_cnt_count(C1) >= quarter * PULSES / 4;
        let area = areas.wait_until(enough, LIMIT)?[LOCAL_IO];
        print_counters("on the way", &area);
    }
    // Each motor of the group reports by itself when it has arrived.
    areas.wait_motor_ex(LOCAL_IO, M1, LIMIT)?;
    let area = areas.wait_motor_ex(LOCAL_IO, M2, LIMIT)?[LOCAL_IO];
    print_counters("arrived", &area);

    println!("At plain speed nothing turns before the distance is left.");
    turn_half_a_second(areas)?;

    println!("They leave the extended mode, and turn at plain speed.");
    areas.lock()[LOCAL_IO].stop_motor_ex_cmd(M1)?;
    areas.lock()[LOCAL_IO].stop_motor_ex_cmd(M2)?;
    turn_half_a_second(areas)
}

/// Turns both motors at plain speed for 50 cycles, half a second.
fn turn_half_a_second(areas: &TransferAreas) -> Result<(), Error> {
    set_both(&mut areas.lock()[LOCAL_IO], DUTY_MAX)?;
    for _ in 0..50 {
        areas.wait_cycle()?;
    }
    let mut now = areas.wait_cycle()?;
    set_both(&mut now[LOCAL_IO], 0)?;
    let area = now[LOCAL_IO];
    drop(now);
    print_counters("after half a second", &area);
    Ok(())
}

fn set_both(area: &mut FishX1Transfer, duty: i16) -> Result<(), Error> {
    area.set_out_motor_values(M1, duty, Cw)?;
    area.set_out_motor_values(M2, duty, Ccw)?;
    Ok(())
}

fn print_counters(what: &str, area: &FishX1Transfer) {
    println!("  {what}: C1 {}, C2 {}", area.get_in_cnt_count(C1), area.get_in_cnt_count(C2));
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
