//! Infrared remote: its joysticks drive a car with two motors, the left joystick M1, the right one M2.
//! The button ON lets them drive, OFF stops them.
//!
//! Wiring: the motors of the left and the right wheel on M1 and M2, their encoders, if they have
//! any, on C1 and C2. The remote's DIP switches say which remote it is: here 1 is on and 2 is off.
//!
//! ```text
//! cargo run --example infrared_remote                  # a simulated TXT
//! cargo run --example infrared_remote -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! It prints each change. Ctrl-C stops the motors and ends the transfer. Next: `extension`.

use std::env;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::tx::{IrDevice, JoystickAxis, JoystickSwitch};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Error, SimulatedTxt};

/// The remote with DIP switch 1 on and 2 off. `IrDevice::Any` is any remote.
const REMOTE: IrDevice = IrDevice::OnOff;

/// How far a joystick moves from its middle in each direction.
const JOYSTICK_MAX: i16 = 15;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (address, simulated) = controller()?;
    // The car stops when the loop below hangs for a second.
    let builder = TransferAreaComHandler::builder(address);
    let handler = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    println!(
        "Press ON, and drive with both joysticks. The remote needs DIP switch 1 on and 2 off."
    );
    let mut driving = false;
    let mut shown = None;
    let cycles = if simulated.is_some() { 500 } else { u64::MAX };
    for _ in 0..cycles {
        // Ctrl-C or an error ends the loop.
        let Ok(mut now) = areas.wait_cycle() else { break };
        let area = &mut now[LOCAL_IO];
        if area.get_joystick_but_swi(REMOTE, JoystickSwitch::On) {
            driving = true;
        }
        if area.get_joystick_but_swi(REMOTE, JoystickSwitch::Off) {
            driving = false;
        }
        let left = area.get_joystick_full(REMOTE, JoystickAxis::LeftY);
        let right = area.get_joystick_full(REMOTE, JoystickAxis::RightY);
        for (motor, joystick) in [(M1, left), (M2, right)] {
            let power = if driving { DUTY_MAX * joystick / JOYSTICK_MAX } else { 0 };
            area.set_out_motor_power(motor, power)?;
        }

        // Printing is slow, so a copy is printed while the outputs are sent.
        let copy = *area;
        drop(now);
        let state = Some((left, right, driving));
        if state != shown {
            shown = state;
            println!(
                "left {left:3}, right {right:3}   {}   M1 {:4}, M2 {:4}   C1 {:4}, C2 {:4}",
                if driving { "ON " } else { "OFF" },
                copy.get_out_motor_values(M1)?,
                copy.get_out_motor_values(M2)?,
                copy.get_in_cnt_count(C1),
                copy.get_in_cnt_count(C2),
            );
        }
    }
    // This returns the error, if one has ended the transfer.
    handler.end_transfer()?;
    Ok(())
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
