//! A C program and its port, line by line. A gate opens when somebody presses a button, with a bell and
//! a blinking lamp. Before and after that the gate closes until it presses its end switch.
//!
//! The lines after `// C:` are the whole C program, with the calls of FtTxtLib. Below each is its port.
//! These things are different on purpose:
//!
//! - A call that can fail returns an error, which `?` passes on; the C program ignores it.
//! - Each wait has a time limit, and ends when the connection ends.
//! - The motors stop at every end of the program. Ctrl-C ends it with a last exchange.
//!
//! Wiring: the gate's encoder motor on M3 and C3, a switch on I4 that the closed gate presses, a
//! push button on I3 (both on contacts 1 and 3), a lamp between O7 and ⊥. M3 clockwise opens.
//!
//! ```text
//! cargo run --example c_program                  # a simulated TXT
//! cargo run --example c_program -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! Next: `docs/porting.md` has all the calls.

// C: #include <stdio.h>
// C: #include <windows.h>
// C: #include "FtTxtLib.h"
// C: using namespace fischertechnik::txt::ids;
// C: using namespace fischertechnik::txt::remote::api;
use std::env;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area::tx::Sound;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// For the wait for the next visitor.
const FOREVER: Duration = Duration::MAX;
/// The gate takes no longer than this, unless something is in its way.
const LIMIT: Duration = Duration::from_secs(20);

// C:
// C: void close(ftIF2013TransferAreaComHandlerEx2 *txt)
// C: {
fn close(areas: &TransferAreas) -> Result<(), Error> {
    // C:     txt->SetOutMotorValues(ShmIfId_TXT::LOCAL_IO, Motor::M3, 512, Direction::CCW);
    // C:     while (!txt->GetInIOValueBinary(ShmIfId_TXT::LOCAL_IO, Input::I4))
    // C:         Sleep(10);
    // C:     txt->SetOutMotorValues(ShmIfId_TXT::LOCAL_IO, Motor::M3, 0, Direction::Halt);
    areas.lock()[LOCAL_IO].set_out_motor_values(M3, 512, Direction::Ccw)?;
    areas.wait_until(pressed(I4), LIMIT)?; // the C program waits forever
    areas.lock()[LOCAL_IO].set_out_motor_values(M3, 0, Direction::Halt)?;
    Ok(())
    // C: }
}

/// A condition for a wait: this input is pressed.
fn pressed(input: Input) -> impl Fn(&[FishX1Transfer]) -> bool {
    move |now| now[LOCAL_IO].get_in_io_value_binary(input) == Ok(true)
}

// C:
// C: void control(ftIF2013TransferAreaComHandlerEx2 *txt)
// C: {
fn control(areas: &TransferAreas) -> Result<(), Error> {
    // C:     printf("It closes, until it presses I4.\n");
    // C:     close(txt);
    println!("It closes, until it presses I4.");
    close(areas)?;

    // C:
    // C:     printf("Press I3 to open the gate.\n");
    // C:     while (!txt->GetInIOValueBinary(ShmIfId_TXT::LOCAL_IO, Input::I3))
    // C:         Sleep(10);
    println!("Press I3 to open the gate.");
    areas.wait_until(pressed(I3), FOREVER)?;

    // C:
    // C:     printf("It opens.\n");
    // C:     txt->SetSound(ShmIfId_TXT::LOCAL_IO, 3, 1);
    // C:     txt->StartMotorExCmd(ShmIfId_TXT::LOCAL_IO, Motor::M3, 512, Direction::CW, 200);
    println!("It opens.");
    areas.lock()[LOCAL_IO].set_sound(Sound::Bell, 1)?;
    areas.lock()[LOCAL_IO].start_motor_ex_cmd(M3, 512, Direction::Cw, &[], 200)?;

    // C:     bool lit = false;
    // C:     while (!txt->IsMotorExReady(ShmIfId_TXT::LOCAL_IO, Motor::M3)) {
    // C:         lit = !lit;
    // C:         txt->SetOutPwmValues(ShmIfId_TXT::LOCAL_IO, Output::O7, lit ? 512 : 0);
    // C:         Sleep(200);
    // C:     }
    let (mut lit, begin) = (false, Instant::now());
    while !areas.wait_cycle()?[LOCAL_IO].is_motor_ex_ready(M3) {
        lit = !lit;
        areas.lock()[LOCAL_IO].set_out_pwm_values(O7, if lit { 512 } else { 0 })?;
        thread::sleep(Duration::from_millis(200));
        if begin.elapsed() > LIMIT {
            return Err(Error::WaitTimedOut { limit: LIMIT });
        }
    }

    // C:     printf("It is open after %d pulses.\n",
    // C:         txt->GetInCntCount(ShmIfId_TXT::LOCAL_IO, Counter::C3));
    let pulses = areas.lock()[LOCAL_IO].get_in_cnt_count(C3);
    println!("It is open after {pulses} pulses.");

    // C:     while (!txt->IsSoundReady(ShmIfId_TXT::LOCAL_IO))
    // C:         Sleep(10);
    areas.wait_sound(LOCAL_IO, LIMIT)?;

    // C:
    // C:     txt->StopMotorExCmd(ShmIfId_TXT::LOCAL_IO, Motor::M3);
    // C:     txt->StartCounterReset(ShmIfId_TXT::LOCAL_IO, Counter::C3);
    // C:     while (!txt->IsCntResetReady(ShmIfId_TXT::LOCAL_IO, Counter::C3))
    // C:         Sleep(10);
    areas.lock()[LOCAL_IO].stop_motor_ex_cmd(M3)?;
    areas.lock()[LOCAL_IO].start_counter_reset(C3);
    areas.wait_counter_reset(LOCAL_IO, C3, LIMIT)?;

    // C:     close(txt);
    // C:     txt->SetOutPwmValues(ShmIfId_TXT::LOCAL_IO, Output::O7, 0);
    // C:     printf("It is closed after %d pulses.\n",
    // C:         txt->GetInCntCount(ShmIfId_TXT::LOCAL_IO, Counter::C3));
    close(areas)?;
    areas.lock()[LOCAL_IO].set_out_pwm_values(O7, 0)?;
    let pulses = areas.lock()[LOCAL_IO].get_in_cnt_count(C3);
    println!("It is closed after {pulses} pulses.");
    Ok(())
    // C: }
}

// C:
// C: int main()
// C: {
fn main() -> Result<(), Box<dyn std::error::Error>> {
    // C:     ftIF2013TransferAreaComHandlerEx2 *txt =
    // C:         new ftIF2013TransferAreaComHandlerEx2(1, "192.168.7.2", "65000");
    let (address, _simulated) = controller()?;
    // The C program does not have this: the motor stops when the program hangs for a second.
    let builder = TransferAreaComHandler::builder(address).areas(1);
    let txt = builder.watchdog(Duration::from_secs(1)).build()?;
    let areas = txt.areas();

    // C:     txt->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, Input::I3, InputMode::MODE_R, true);
    // C:     txt->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, Input::I4, InputMode::MODE_R, true);
    // C:     txt->SetFtMotorConfig(ShmIfId_TXT::LOCAL_IO, Motor::M4, false);
    areas.lock()[LOCAL_IO].set_ft_uni_config(I3, InputMode::Resistance, true);
    areas.lock()[LOCAL_IO].set_ft_uni_config(I4, InputMode::Resistance, true);
    areas.lock()[LOCAL_IO].set_ft_motor_config(M4, false);

    // C:     if (txt->ftxStartTransferArea() != FtErrors::FTLIB_ERR_SUCCESS) {
    // C:         printf("There is no TXT.\n");
    // C:         return 1;
    // C:     }
    txt.begin_transfer()?;

    // The C program does not have this: Ctrl-C ends the transfer, which stops the motor.
    let on_ctrl_c = txt.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    // C:     control(txt);
    // C:     txt->ftxStopTransferArea();
    let controlled = control(areas);
    txt.end_transfer()?;

    // C:     delete txt;
    // C:     return 0;
    // C: }
    // Printing may take long, so it comes when the motor stands.
    match &controlled {
        Err(Error::NotStarted) => {
            println!("Stopped by Ctrl-C.");
            return Ok(());
        }
        Err(Error::WaitTimedOut { .. }) => {
            println!("The gate does not arrive. Are M3, C3 and I4 plugged in?");
        }
        _ => {}
    }
    Ok(controlled?)
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
