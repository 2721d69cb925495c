//! Wi-Fi: a slide moves back and forth by distances, and goes on after a lost connection. After each
//! gap it looks for its start again, because its position is no longer known.
//!
//! Wiring: the slide's encoder motor on M3 and C3, a switch at its start on I4 (contacts 1 and 3).
//! M3 counterclockwise moves it towards the switch. The slide needs a way of more than 300 pulses.
//!
//! ```text
//! cargo run --example wifi                  # a simulated TXT
//! cargo run --example wifi -- 192.168.8.2   # a TXT on Wi-Fi
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! To lose the connection to a real TXT, leave the room with the PC, or switch the TXT off and on
//! again. With `txt simulate`, end it and start it again. Ctrl-C stops the motor and ends
//! the sample, also in a gap.

use std::env;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area::TimeLimits;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// A slow Wi-Fi may need this long for a response, because a lost packet is sent again. The
/// controller closes the connection after 5 s without commands, so more does not help.
const READ_LIMIT: Duration = Duration::from_secs(4);
/// The motor stops when this program hangs for this time. Longer than a response may take.
const WATCHDOG: Duration = Duration::from_secs(5);
/// How long the handler tries to re-establish a lost connection.
const RECONNECT_LIMIT: Duration = Duration::from_secs(60);

/// How many pulses the slide first moves away from its start, and then back and forth.
const AWAY: u16 = 50;
const PULSES: u16 = 250;
/// Every movement takes less time, unless the slide is stuck.
const WAY_LIMIT: Duration = Duration::from_secs(10);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (address, simulated) = controller()?;
    let builder = TransferAreaComHandler::builder(address)
        .time_limits(TimeLimits::default().read(READ_LIMIT))
        .watchdog(WATCHDOG)
        .reconnect(RECONNECT_LIMIT);
    let handler = Arc::new(builder.build()?);
    let areas = handler.areas();
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;
    if let Some(txt) = simulated {
        let handler = Arc::clone(&handler);
        thread::spawn(move || switch_off_and_on(txt, &handler));
    }

    // When the connection was lost, while there is none.
    let mut lost: Option<Instant> = None;
    loop {
        let result = match lost {
            None => work(areas),
            Some(since) => wait_for_connection(areas, since),
        };
        match result {
            Ok(()) => lost = None,
            Err(error @ Error::ConnectionLost { .. }) => {
                println!("Lost: {error}.");
                print_outputs(&areas.lock()[LOCAL_IO]);
                lost = Some(Instant::now());
            }
            // The connection is fine, and the motor is stopped.
            Err(error @ Error::WatchdogExpired { .. }) => println!("Stopped: {error}."),
            Err(error @ Error::WaitTimedOut { .. }) => {
                handler.end_transfer()?; // before a line that may take long
                println!("The slide does not arrive. Are M3, C3 and I4 plugged in?");
                return Err(error.into());
            }
            // Ctrl-C, or an error that has ended the transfer.
            Err(_) => break,
        }
    }
    let gaps = areas.statistics().gaps;
    handler.end_transfer()?;
    println!("Connections that were lost and re-established: {gaps}.");
    Ok(())
}

/// Finds the start, and then moves back and forth until something is wrong.
fn work(areas: &TransferAreas) -> Result<(), Error> {
    println!("M3 looks for the start.");
    areas.lock()[LOCAL_IO].stop_motor_ex_cmd(M3)?;
    areas.lock()[LOCAL_IO].set_out_motor_values(M3, DUTY_MAX, Direction::Ccw)?;
    let is_at_start = |now: &[FishX1Transfer]| now[LOCAL_IO].get_in_io_value_binary(I4) == Ok(true);
    let mut now = areas.wait_until(is_at_start, WAY_LIMIT)?;
    now[LOCAL_IO].set_out_motor_values(M3, 0, Direction::Halt)?;
    drop(now);

    // The ways back end a little before the start, because the slide can't move beyond it.
    drive(areas, Direction::Cw, AWAY)?;
    loop {
        drive(areas, Direction::Cw, PULSES)?;
        drive(areas, Direction::Ccw, PULSES)?;
    }
}

/// Drives some pulses.
fn drive(areas: &TransferAreas, direction: Direction, pulses: u16) -> Result<(), Error> {
    let way = if direction == Direction::Cw { "there" } else { "back" };
    println!("M3 runs {pulses} pulses {way}.");
    let distance = pulses.into();
    areas.lock()[LOCAL_IO].start_motor_ex_cmd(M3, DUTY_MAX, direction, &[], distance)?;
    // An interrupted movement is never reported as finished: this returns the error instead.
    let area = areas.wait_motor_ex(LOCAL_IO, M3, WAY_LIMIT)?[LOCAL_IO];
    println!("  done after {} pulses.", area.get_in_cnt_count(C3));
    Ok(())
}

/// Waits for a new connection, at most as long as the handler tries.
fn wait_for_connection(areas: &TransferAreas, since: Instant) -> Result<(), Error> {
    let area = areas.wait_cycle()?[LOCAL_IO];
    println!("The connection is restored after {:.1} s.", since.elapsed().as_secs_f64());
    print_outputs(&area);
    Ok(())
}

fn print_outputs(area: &FishX1Transfer) {
    let done = if area.is_motor_ex_ready(M3) { "done" } else { "not done" };
    let [.., cw, ccw, _, _] = *area.output.duty;
    println!("  M3 has duty {cw} and {ccw}; its last way reads as {done}.");
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

/// Switches the simulated TXT off for three seconds, and later ends the transfer.
fn switch_off_and_on(txt: SimulatedTxt, handler: &TransferAreaComHandler) {
    let port = txt.port();
    txt.wait_until(|machine| machine.exchanges() > 270, Duration::MAX);
    println!("[The simulated TXT is switched off.]");
    drop(txt);
    thread::sleep(Duration::from_secs(3));
    println!("[It is switched on again.]");
    let since = Instant::now();
    let txt = loop {
        match SimulatedTxt::builder().port(port).world(World::default()).start() {
            Ok(txt) => break txt,
            // Another program may have the port for a moment.
            Err(_) if since.elapsed() < RECONNECT_LIMIT => thread::sleep(Duration::from_millis(50)),
            Err(error) => return eprintln!("{error:#}"),
        }
    };
    txt.wait_until(|machine| machine.exchanges() > 300, Duration::MAX);
    let _ = handler.end_transfer();
}
