//! WLAN: a slide goes to and fro by distances, and goes on after its connection was lost. After each
//! gap it looks for its start again, because its position is not known any more.
//!
//! Wiring: the slide's encoder motor on M1 and C1, a switch at its start on I1 (contacts 1 and 3).
//! M1 counterclockwise moves it towards the switch; its way has to be longer than 300 pulses.
//!
//! ```text
//! cargo run --example wlan                  # a simulated TXT that is away for three seconds
//! cargo run --example wlan -- 192.168.8.2   # a TXT on WLAN
//! cargo run --example wlan -- --seconds 60 127.0.0.1:65000
//! ```
//!
//! With a TXT of your own, leave the room with the PC, or switch the TXT off and on again. The sample
//! ends when its time is up or on Ctrl-C, also in a gap, with the motor stopped.

mod common;

use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use common::Example;
use ft_transfer_area::simulator::world::{Travel, World};
use ft_transfer_area::simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor};
use ft_transfer_area::{
    Error, FishX1Transfer, TimeLimits, TransferAreaComHandler, TransferAreaGuard,
};

const USAGE: &str = "usage: wlan [--seconds N] [HOST[:PORT]]";

/// A slow WLAN may need this long for an answer, because a lost packet is sent again. The
/// controller gives up after 5 s without commands, so more does not help.
const READ_LIMIT: Duration = Duration::from_secs(4);
/// The motor stops when this program hangs for so long. Longer than an answer may take.
const WATCHDOG: Duration = Duration::from_secs(5);
/// For how long a lost connection is made again.
const RECONNECT_LIMIT: Duration = Duration::from_secs(60);

/// How many pulses the slide first moves away from its start, and then there and back.
const AWAY: u16 = 50;
const PULSES: u16 = 250;
/// No way takes longer, unless the slide is stuck.
const WAY_LIMIT: Duration = Duration::from_secs(20);

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let mut example = Example::start(USAGE, || Ok(simulated(100.0)))?;
    if let Some(txt) = example.take_simulated() {
        thread::spawn(|| make_gap(txt));
    }
    let handler = example
        .handler()
        .time_limits(TimeLimits { read: READ_LIMIT, ..TimeLimits::default() })
        .watchdog(WATCHDOG)
        .reconnect(RECONNECT_LIMIT)
        .build()?;
    handler.begin_transfer()?;

    // When the connection was lost, until it stands again.
    let mut lost: Option<Instant> = None;
    while example.goes_on() {
        let result = match lost {
            None => work(&example, &handler),
            Some(since) => wait_for_connection(&handler, since),
        };
        match result {
            Ok(()) => lost = None,
            // Not yet. Ctrl-C can end it between two waits.
            Err(Error::WaitTimedOut { .. }) if lost.is_some() => {}
            Err(error @ Error::ConnectionLost { .. }) => {
                println!("Lost: {error}.");
                print_outputs(&handler.lock()[LOCAL_IO]);
                lost = Some(Instant::now());
            }
            // The connection stands, and the motor is stopped.
            Err(error @ Error::WatchdogExpired { .. }) => println!("Stopped: {error}."),
            Err(error) => return Err(error.into()),
        }
    }
    let gaps = handler.statistics().gaps;
    handler.end_transfer()?;
    println!("Connections that were lost and made again: {gaps}.");
    Ok(())
}

/// Finds the start, and then goes there and back until the example is to end.
fn work(example: &Example, handler: &TransferAreaComHandler) -> Result<(), Error> {
    println!("M1 looks for the start.");
    handler.lock()[LOCAL_IO].stop_motor_ex_cmd(Motor::M1)?;
    handler.lock()[LOCAL_IO].set_out_motor_values(Motor::M1, DUTY_MAX, Direction::Ccw)?;
    let is_at_start = |area: &FishX1Transfer| area.get_in_io_value_binary(Input::I1) == Ok(true);
    let mut areas = wait(example, handler, is_at_start)?;
    areas[LOCAL_IO].set_out_motor_values(Motor::M1, 0, Direction::Halt)?;
    drop(areas);

    // The ways back end a little before the start, because it can't go beyond that.
    drive(example, handler, Direction::Cw, AWAY)?;
    while example.goes_on() {
        drive(example, handler, Direction::Cw, PULSES)?;
        drive(example, handler, Direction::Ccw, PULSES)?;
    }
    Ok(())
}

/// Drives some pulses, unless the example is to end.
fn drive(
    example: &Example,
    handler: &TransferAreaComHandler,
    direction: Direction,
    pulses: u16,
) -> Result<(), Error> {
    if !example.goes_on() {
        return Ok(());
    }
    let way = if direction == Direction::Cw { "there" } else { "back" };
    println!("M1 runs {pulses} pulses {way}.");
    handler.lock()[LOCAL_IO].start_motor_ex_cmd(
        Motor::M1,
        DUTY_MAX,
        direction,
        &[],
        pulses.into(),
    )?;
    // A way that is cut off never reads as done: this returns the error instead.
    let area = wait(example, handler, |area| area.is_motor_ex_ready(Motor::M1))?[LOCAL_IO];
    let end = if area.is_motor_ex_ready(Motor::M1) { "done" } else { "stopped" };
    println!("  {end} after {} pulses.", area.get_in_cnt_count(Counter::C1));
    Ok(())
}

/// Waits for a condition, or until the example is to end.
///
/// A cycle hook that does this would tell the watchdog that all is well, also when this hangs.
fn wait<'a>(
    example: &Example,
    handler: &'a TransferAreaComHandler,
    condition: impl Fn(&FishX1Transfer) -> bool,
) -> Result<TransferAreaGuard<'a>, Error> {
    handler.wait_until(|areas| !example.goes_on() || condition(&areas[LOCAL_IO]), WAY_LIMIT)
}

/// Waits a little for a connection that was lost.
fn wait_for_connection(handler: &TransferAreaComHandler, since: Instant) -> Result<(), Error> {
    let area = handler.wait_cycle_for(Duration::from_millis(100))?[LOCAL_IO];
    println!("The connection is restored after {:.1} s.", since.elapsed().as_secs_f64());
    print_outputs(&area);
    Ok(())
}

fn print_outputs(area: &FishX1Transfer) {
    let done = if area.is_motor_ex_ready(Motor::M1) { "done" } else { "not done" };
    let [cw, ccw, ..] = area.output.duty;
    println!("  M1 has duty {cw} and {ccw}; its last way reads as {done}.");
}

/// The slide of the default world, shorter and with a faster motor.
fn simulated(position: f64) -> SimulatedTxtBuilder {
    let mut world = World::default();
    for motor in world.master.motors.values_mut() {
        motor.top_speed = 9.0;
        if let Some(slide) = &mut motor.slide {
            (slide.travel, slide.position) = (Travel::Pulses(600.0), position);
        }
    }
    SimulatedTxt::builder().world(world)
}

/// Switches the simulated TXT off in the middle of a way, and three seconds later on again. The slide
/// stays where it is meanwhile.
fn make_gap(txt: SimulatedTxt) {
    let is_on_its_way = |machine: &Machine| {
        let outputs = &machine.controllers[LOCAL_IO].outputs;
        let counted = machine.controllers[LOCAL_IO].counter[0];
        machine.exchanges() > 200 && outputs.distance[0] > 0 && (100..200).contains(&counted)
    };
    txt.wait_until(Duration::MAX, is_on_its_way);
    let (counted, position) = txt.with_machine(|machine| {
        let slide = machine.world().and_then(|world| world.slide(LOCAL_IO, Motor::M1));
        (machine.controllers[LOCAL_IO].counter[0], slide.unwrap_or_default())
    });
    let port = txt.port();
    println!("[The simulated TXT is switched off. C1 has counted {counted} of {PULSES} pulses.]");
    drop(txt);
    thread::sleep(Duration::from_secs(3));
    println!("[It is switched on again.]");
    match simulated(position).port(port).start() {
        // It runs until the program ends.
        Ok(txt) => drop(txt.wait_until(Duration::MAX, |_| false)),
        Err(error) => eprintln!("{error}"),
    }
}
