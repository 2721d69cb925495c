//! Extension: the button on the master runs the motor on the extension, and the button on the
//! extension runs the motor on the master. While the extension is not plugged in, its motor can't be
//! controlled and its button is ignored.
//!
//! Plug it in before the program starts: the maker's firmware 4.7.0 (measured under emulation) looks for
//! extensions only when a transfer begins. One that is unplugged later is still
//! reported (there, with a simulated board). The simulated TXT has it unplugged for a second.
//!
//! Wiring, the same on both controllers: a push button on I1 (contacts 1 and 3), a motor on M1. The
//! second TXT is connected to the first one's EXT socket, and set to be an extension in its menu.
//!
//! ```text
//! cargo run --example extension                  # a simulated TXT
//! cargo run --example extension -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! It prints each change. Ctrl-C stops all motors and ends the transfer. Next: `i2c`, with another
//! device in the EXT socket.

use std::env;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (address, simulated) = controller()?;
    // The master and one extension. All motors stop when the loop below hangs for a second.
    let builder = TransferAreaComHandler::builder(address).areas(2);
    let handler = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = handler.areas();
    areas.lock().iter_mut().for_each(configure);
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, which stops the motors.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    // Whether the extension is there, and the two buttons, as printed last.
    let mut shown: Option<(bool, bool, bool)> = None;
    let cycles = if simulated.is_some() { 600 } else { u64::MAX };
    for _ in 0..cycles {
        // Ctrl-C or an error ends the loop.
        let Ok(mut now) = areas.wait_cycle() else { break };
        let is_there = now[LOCAL_IO].slaves_alive() > 0;
        if is_there && matches!(shown, Some((false, ..))) {
            // It may have been switched off, and have lost its configuration.
            configure(&mut now[REMOTE_IO_1]);
        }

        let master_pressed = now[LOCAL_IO].get_in_io_value_binary(I1)?;
        // While it is not plugged in, its area has the inputs that it sent last.
        let extension_pressed = is_there && now[REMOTE_IO_1].get_in_io_value_binary(I1)?;
        let power = |pressed| if pressed { DUTY_MAX } else { 0 };
        now[REMOTE_IO_1].set_out_motor_power(M1, power(master_pressed))?;
        now[LOCAL_IO].set_out_motor_power(M1, power(extension_pressed))?;

        // Printing is slow, and the outputs are sent after the guard is dropped. So copies are printed.
        let (master, extension) = (now[LOCAL_IO], now[REMOTE_IO_1]);
        drop(now);
        let state = Some((is_there, master_pressed, extension_pressed));
        if state != shown {
            shown = state;
            let extension =
                if is_there { describe(&extension)? } else { "not plugged in".to_owned() };
            println!("master: {}    extension: {extension}", describe(&master)?);
        }
    }
    // This returns the error, if one has ended the transfer.
    handler.end_transfer()?;
    Ok(())
}

/// Button and motor of a controller.
fn describe(area: &FishX1Transfer) -> Result<String, Error> {
    let button = if area.get_in_io_value_binary(I1)? { "pressed" } else { "open" };
    let motor = if area.get_out_motor_values(M1)? != 0 { "runs" } else { "off" };
    Ok(format!("I1 {button:7}, M1 {motor:6}"))
}

fn configure(area: &mut FishX1Transfer) {
    area.set_ft_uni_config(I1, InputMode::Resistance, true);
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), ft_transfer_area_simulator::Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!(
        "No address is given, so this is a simulated TXT. Its buttons are pressed by a script."
    );
    // Somebody unplugs the extension for a second, from the 330th exchange to the 430th.
    let unplug = |exchange| (330..430).contains(&exchange);
    let txt = SimulatedTxt::builder()
        .world(World::default())
        .on_exchange(move |machine| machine.alive[0] = !unplug(machine.exchanges()))
        .start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
