//! A C program and its port, line by line: a gate that opens when somebody presses a button, rings
//! and blinks meanwhile, and closes until it presses its end switch.
//!
//! The lines behind `// C:` are the whole C program, in the calls of FtTxtLib. Below each is what it
//! becomes here. What is different on purpose:
//!
//! - A call that can fail returns an error, which `?` hands on; the C program does not look at it.
//! - Each wait says how long it may take, and ends when the connection does.
//! - However the program ends, also by an error, the motors are stopped.
//!
//! Wiring: the gate's encoder motor on M1 and C1, a switch on I1 that the closed gate presses, a
//! push button on I3 (both on contacts 1 and 3), a lamp between O7 and ⊥. M1 clockwise opens.
//!
//! ```text
//! cargo run --example c_program                  # a simulated TXT; somebody presses I3
//! cargo run --example c_program -- 192.168.7.2   # a TXT on USB
//! cargo run --example c_program -- --seconds 60 127.0.0.1:65000
//! ```
//!
//! Ctrl-C stops the motor and goes offline.

mod common;

// C: #include <stdio.h>
// C: #include <windows.h>
// C: #include "FtTxtLib.h"
// C: using namespace fischertechnik::txt::ids;
// C: using namespace fischertechnik::txt::remote::api;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::{InputMode, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor, Output, Sound};
use ft_transfer_area::FishX1Transfer;

const USAGE: &str = "usage: c_program [--seconds N] [HOST[:PORT]]";

/// For the wait for the next visitor.
const FOREVER: Duration = Duration::MAX;
/// The gate takes no longer than this, unless something is in its way.
const LIMIT: Duration = Duration::from_secs(20);

// C:
// C: int main()
// C: {
fn run() -> common::Result {
    // C:     ftIF2013TransferAreaComHandlerEx2 *txt =
    // C:         new ftIF2013TransferAreaComHandlerEx2(1, "192.168.7.2", "65000");
    let example = Example::start(USAGE, simulated)?;
    let txt = example.handler().areas(1).build()?;

    // C:     txt->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, Input::I1, InputMode::MODE_R, true);
    // C:     txt->SetFtUniConfig(ShmIfId_TXT::LOCAL_IO, Input::I3, InputMode::MODE_R, true);
    // C:     txt->SetFtMotorConfig(ShmIfId_TXT::LOCAL_IO, Motor::M4, false);
    txt.lock()[LOCAL_IO].set_ft_uni_config(Input::I1, InputMode::Resistance, true);
    txt.lock()[LOCAL_IO].set_ft_uni_config(Input::I3, InputMode::Resistance, true);
    txt.lock()[LOCAL_IO].set_ft_motor_config(Motor::M4, false);

    // C:     if (txt->ftxStartTransferArea() != FtErrors::FTLIB_ERR_SUCCESS) {
    // C:         printf("There is no TXT.\n");
    // C:         return 1;
    // C:     }
    txt.begin_transfer()?;
    example.stop_in_time(&txt);

    // C:
    // C:     printf("Press I3 to open the gate.\n");
    // C:     while (!txt->GetInIOValueBinary(ShmIfId_TXT::LOCAL_IO, Input::I3))
    // C:         Sleep(10);
    println!("Press I3 to open the gate.");
    let pressed = |input: Input| {
        move |areas: &[FishX1Transfer]| areas[LOCAL_IO].get_in_io_value_binary(input) == Ok(true)
    };
    txt.wait_until(pressed(Input::I3), FOREVER)?;

    // C:
    // C:     printf("It opens.\n");
    // C:     txt->SetSound(ShmIfId_TXT::LOCAL_IO, 3, 1);
    // C:     txt->StartMotorExCmd(ShmIfId_TXT::LOCAL_IO, Motor::M1, 512, Direction::CW, 200);
    println!("It opens.");
    txt.lock()[LOCAL_IO].set_sound(Sound::Bell, 1)?;
    txt.lock()[LOCAL_IO].start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 200)?;

    // C:     bool lit = false;
    // C:     while (!txt->IsMotorExReady(ShmIfId_TXT::LOCAL_IO, Motor::M1)) {
    // C:         lit = !lit;
    // C:         txt->SetOutPwmValues(ShmIfId_TXT::LOCAL_IO, Output::O7, lit ? 512 : 0);
    // C:         Sleep(200);
    // C:     }
    let mut lit = false;
    while !txt.wait_cycle()?[LOCAL_IO].is_motor_ex_ready(Motor::M1) {
        lit = !lit;
        txt.lock()[LOCAL_IO].set_out_pwm_values(Output::O7, if lit { 512 } else { 0 })?;
        thread::sleep(Duration::from_millis(200));
    }

    // C:     printf("It is open after %d pulses.\n",
    // C:         txt->GetInCntCount(ShmIfId_TXT::LOCAL_IO, Counter::C1));
    let pulses = txt.lock()[LOCAL_IO].get_in_cnt_count(Counter::C1);
    println!("It is open after {pulses} pulses.");

    // C:     while (!txt->IsSoundReady(ShmIfId_TXT::LOCAL_IO))
    // C:         Sleep(10);
    txt.wait_sound(LOCAL_IO, LIMIT)?;

    // C:
    // C:     txt->StopMotorExCmd(ShmIfId_TXT::LOCAL_IO, Motor::M1);
    // C:     txt->StartCounterReset(ShmIfId_TXT::LOCAL_IO, Counter::C1);
    // C:     while (!txt->IsCntResetReady(ShmIfId_TXT::LOCAL_IO, Counter::C1))
    // C:         Sleep(10);
    txt.lock()[LOCAL_IO].stop_motor_ex_cmd(Motor::M1)?;
    txt.lock()[LOCAL_IO].start_counter_reset(Counter::C1);
    txt.wait_counter_reset(LOCAL_IO, Counter::C1, LIMIT)?;

    // C:     txt->SetOutMotorValues(ShmIfId_TXT::LOCAL_IO, Motor::M1, 512, Direction::CCW);
    // C:     while (!txt->GetInIOValueBinary(ShmIfId_TXT::LOCAL_IO, Input::I1))
    // C:         Sleep(10);
    // C:     txt->SetOutMotorValues(ShmIfId_TXT::LOCAL_IO, Motor::M1, 0, Direction::Halt);
    txt.lock()[LOCAL_IO].set_out_motor_values(Motor::M1, 512, Direction::Ccw)?;
    txt.wait_until(pressed(Input::I1), LIMIT)?;
    txt.lock()[LOCAL_IO].set_out_motor_values(Motor::M1, 0, Direction::Halt)?;

    // C:     txt->SetOutPwmValues(ShmIfId_TXT::LOCAL_IO, Output::O7, 0);
    // C:     printf("It is closed after %d pulses.\n",
    // C:         txt->GetInCntCount(ShmIfId_TXT::LOCAL_IO, Counter::C1));
    txt.lock()[LOCAL_IO].set_out_pwm_values(Output::O7, 0)?;
    let pulses = txt.lock()[LOCAL_IO].get_in_cnt_count(Counter::C1);
    println!("It is closed after {pulses} pulses.");

    // C:
    // C:     txt->ftxStopTransferArea();
    // C:     delete txt;
    // C:     return 0;
    // C: }
    txt.end_transfer()?;
    Ok(())
}

fn main() -> ExitCode {
    common::main(run)
}

/// The gate, and a visitor.
fn simulated() -> common::Result<SimulatedTxtBuilder> {
    let world = World::from_toml(include_str!("worlds/gate.toml"))?;
    Ok(SimulatedTxt::builder().world(world))
}
