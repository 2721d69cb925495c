//! Infrared remote: its joysticks drive a car on two motors, the left one M1, the right one M2. The
//! button ON lets them drive, OFF stops them.
//!
//! Wiring: the motors of the left and the right wheel on M1 and M2, their encoders, if they have
//! any, on C1 and C2. The remote's DIP switches say which remote it is; it works with switch 1 on
//! and switch 2 off, or as `--remote` says.
//!
//! ```text
//! cargo run --example infrared_remote                  # a simulated TXT; its remote moves by itself
//! cargo run --example infrared_remote -- 192.168.7.2   # a TXT on USB
//! cargo run --example infrared_remote -- --remote off-off 192.168.7.2
//! cargo run --example infrared_remote -- --remote any --seconds 30 127.0.0.1:65000
//! ```
//!
//! It prints what has changed, and ends when its time is up or on Ctrl-C; the motors stop.

mod common;

use std::process::ExitCode;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::world::{Remote, World};
use ft_transfer_area::simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, IrDevice, JoystickAxis, JoystickSwitch, Motor};
use lexopt::ValueExt;

const USAGE: &str = "usage: infrared_remote [--remote any|off-off|on-off|off-on|on-on] \
                     [--seconds N] [HOST[:PORT]]";

/// How far a joystick moves from its middle in each direction.
const JOYSTICK_MAX: i16 = 15;

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let mut remote = IrDevice::OnOff;
    let example = Example::start_with(USAGE, simulated, |option, parser| {
        if option == "remote" {
            remote = parser.value()?.parse_with(remote_from)?;
        }
        Ok(option == "remote")
    })?;
    // The car stops when the loop below hangs for a second.
    let handler = example.handler().watchdog(Duration::from_secs(1)).build()?;
    handler.begin_transfer()?;

    println!("Press ON, and drive with both joysticks.");
    let mut driving = false;
    let mut shown = None;
    while example.goes_on() {
        let mut areas = handler.wait_cycle()?;
        let area = &mut areas[LOCAL_IO];
        if area.get_joystick_but_swi(remote, JoystickSwitch::On) {
            driving = true;
        }
        if area.get_joystick_but_swi(remote, JoystickSwitch::Off) {
            driving = false;
        }
        let left = area.get_joystick_full(remote, JoystickAxis::LeftY);
        let right = area.get_joystick_full(remote, JoystickAxis::RightY);
        for (motor, joystick) in [(Motor::M1, left), (Motor::M2, right)] {
            let power = if driving { DUTY_MAX * joystick / JOYSTICK_MAX } else { 0 };
            area.set_out_motor_power(motor, power)?;
        }

        // The console is slow, so a copy is printed, and the outputs leave meanwhile.
        let copy = *area;
        drop(areas);
        let state = Some((left, right, driving));
        if state != shown {
            shown = state;
            println!(
                "left {left:3}, right {right:3}   {}   M1 {:4}, M2 {:4}   C1 {:4}, C2 {:4}",
                if driving { "ON " } else { "OFF" },
                copy.get_out_motor_values(Motor::M1)?,
                copy.get_out_motor_values(Motor::M2)?,
                copy.get_in_cnt_count(Counter::C1),
                copy.get_in_cnt_count(Counter::C2),
            );
        }
    }
    handler.end_transfer()?;
    Ok(())
}

fn remote_from(text: &str) -> Result<IrDevice, String> {
    match text {
        "any" => Ok(IrDevice::Any),
        "off-off" => Ok(IrDevice::OffOff),
        "on-off" => Ok(IrDevice::OnOff),
        "off-on" => Ok(IrDevice::OffOn),
        "on-on" => Ok(IrDevice::OnOn),
        _ => Err(USAGE.to_owned()),
    }
}

/// Two motors, and two remotes that move by themselves. Only one of them has the right switches.
fn simulated() -> common::Result<SimulatedTxtBuilder> {
    let world = World::from_toml(include_str!("worlds/two_motors.toml"))?;
    Ok(SimulatedTxt::builder().world(world).on_exchange(move_joysticks))
}

/// What happens at which exchange, again and again: left and right joystick, ON, OFF.
const DRIVE: [(u64, i8, i8, bool, bool); 9] = [
    (0, 0, 0, false, false),
    (30, 15, 15, false, false), // nothing moves before ON
    (60, 0, 0, true, false),
    (80, 0, 0, false, false),
    (100, 15, 15, false, false), // straight ahead
    (180, 15, 5, false, false),  // to the right
    (240, -8, -8, false, false), // back
    (300, -8, -8, false, true),  // OFF while it drives
    (320, 0, 0, false, false),
];
const DRIVE_LENGTH: u64 = 400;

fn move_joysticks(machine: &mut Machine) {
    let exchange = machine.exchanges() % DRIVE_LENGTH;
    let Some(world) = machine.world_mut() else { return };
    if let Some(&(_, left_y, right_y, on, off)) = DRIVE.iter().find(|step| step.0 == exchange) {
        world.set_remote(Remote { dip1: true, left_y, right_y, on, off, ..Remote::default() });
    }
    // Somebody else plays with a remote whose switches are both off.
    let left_x = if exchange % 50 < 25 { -15 } else { 15 };
    world.set_remote(Remote { left_x, left_y: 15, on: true, ..Remote::default() });
}
