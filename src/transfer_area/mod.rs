//! The TX-compatible transfer area: plain data, one [`FishX1Transfer`] per controller.
//!
//! The master is area [`LOCAL_IO`], the extensions are [`REMOTE_IO_1`] to [`REMOTE_IO_8`]. Every
//! field has the same offset as on the 32-bit controller, and pointers are `u32`; the layout is
//! checked when the crate is compiled. There are only integers and arrays of integers, so every
//! bit pattern is a valid area.
//!
//! Where each terminal has a value, its index is the terminal, as in `input.uni[I1]` and `output.duty[O1]`, or a
//! number that counts from 0; see [`PerInput`], [`PerOutput`], [`PerCounter`] and [`PerMotor`].
//!
//! | part | what it holds | written by |
//! |---|---|---|
//! | [`config`](FishX1Transfer::config) | what is plugged in where | the program |
//! | [`output`](FishX1Transfer::output), [`txt_outputs`](FishX1Transfer::txt_outputs) | motors, lamps, counter resets, sound | the program |
//! | [`input`](FishX1Transfer::input), [`txt_inputs`](FishX1Transfer::txt_inputs), [`txt_inputs2`](FishX1Transfer::txt_inputs2) | inputs, counters, infrared, microphone | the controller |
//! | [`state`](FishX1Transfer::state) | `config_id`, connected extensions | both |
//! | [`timer`](FishX1Transfer::timer) | time since the transfer began (master only) | the transfer |
//!
//! The fields are those of the controller's memory, so these structs are closed on purpose: a program can
//! write them out. Each of an area's 1024 bytes is in a field, so no firmware can add one.
//!
//! An online transfer neither reads nor writes the other parts. They are there for TX programs and for the
//! memory layout.

#[macro_use]
mod structs;

mod bytes;
mod config;
mod constants;
mod input;
mod layout;
mod output;
mod per_terminal;
mod state;
mod unused;

use std::fmt;

pub use config::{Config, CounterConfig, CounterMode, InputMode, UniConfig};
pub use constants::*;
pub use input::{InputValues, IrInput, Timer, TxtInputs, TxtInputs2};
pub use output::{OutputValues, TxtOutputs};
pub use per_terminal::{PerCounter, PerInput, PerMotor, PerOutput};
pub use state::{BtStatus, Info, ProgramInfo, State, Versions};
pub use unused::{Change, Display, DisplayFrame, DisplayMessage, InputSim, MotorValues, Status};

/// One transfer area: everything a program shares with one controller, 1024 bytes.
///
/// The default is the configuration of the kit's `SetDefaultConfig`: all universal inputs are digital
/// resistance inputs (switches), all counters are normal, all outputs are motors, `config_id` is 1, and
/// everything else is 0.
///
/// Its [`Display`](fmt::Display) form is the line that the kit's `PrintIO` prints; the number
/// after `ID` is [`state.id`](State::id), which a handler and
/// [`do_transfer`](crate::TxtClient::do_transfer) set to the area's index.
///
/// ```
/// use ft_transfer_area::prelude::*;
///
/// let mut area = FishX1Transfer::default();
/// area.output.duty[O1] = DUTY_MAX; // M1 forward at full speed
/// assert_eq!(
///     area.to_string(),
///     "Transfer ID=0 I=0 0 0 0 0 0 0 0 C=0 0 0 0 O=512-0 0-0 0-0 0-0"
/// );
/// ```
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FISH_X1_TRANSFER")]
#[doc(alias = "shm_if_s")]
#[doc(alias = "SetDefaultConfig")]
#[doc(alias = "PrintIO")]
#[doc(alias = "TA")]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FishX1Transfer {
    /// Names and versions of the controller. Not used online.
    #[doc(alias = "ftX1info")]
    pub info: Info,
    /// State of the interface: the configuration's id and the connected extensions.
    #[doc(alias = "ftX1state")]
    pub state: State,
    /// What is plugged in where. Raise [`State::config_id`] after a change.
    #[doc(alias = "ftX1config")]
    pub config: Config,
    /// Values of the inputs and counters.
    #[doc(alias = "ftX1in")]
    pub input: InputValues,
    /// Values for the outputs, motor commands and counter resets.
    #[doc(alias = "ftX1out")]
    pub output: OutputValues,
    /// The ROBO TX's display. Not used online.
    #[doc(alias = "ftX1display")]
    pub display: Display,
    /// State of the ROBO TX's serial transfer. Not used online.
    #[doc(alias = "IFStatus")]
    pub status: Status,
    /// Change marks of the ROBO TX's serial transfer. Not used online.
    #[doc(alias = "IFChange")]
    pub change: Change,
    /// Time since the transfer began; kept in the master's area only.
    #[doc(alias = "IFTimer")]
    pub timer: Timer,
    /// Motor values as the controller's own control loop sees them. Not used online.
    #[doc(alias = "IFMotor")]
    pub motor: MotorValues,
    /// Simulated buttons of the ROBO TX. Not used online.
    #[doc(alias = "IFInputSim")]
    pub input_sim: InputSim,
    /// Addresses of the controller's own functions. Not used online.
    #[doc(alias = "IFHookTable")]
    pub hook_table: [u32; 35],
    /// The TXT's further inputs: infrared remotes and the finished sound.
    #[doc(alias = "sTxtInputs")]
    pub txt_inputs: TxtInputs,
    /// The TXT's further outputs: sound.
    #[doc(alias = "sTxtOutputs")]
    pub txt_outputs: TxtOutputs,
    /// The TXT's microphone, from firmware 4.2.4 on; 0 otherwise.
    #[doc(alias = "sTxtInputs2")]
    pub txt_inputs2: TxtInputs2,
    /// Unused, up to 1024 bytes.
    pub reserved: [u8; 158],
}

impl Default for FishX1Transfer {
    fn default() -> Self {
        Self {
            info: Info::default(),
            state: State { config_id: 1, ..State::default() },
            config: Config::default(),
            input: InputValues::default(),
            output: OutputValues::default(),
            display: Display::default(),
            status: Status::default(),
            change: Change::default(),
            timer: Timer::default(),
            motor: MotorValues::default(),
            input_sim: InputSim::default(),
            hook_table: [0; 35],
            txt_inputs: TxtInputs::default(),
            txt_outputs: TxtOutputs::default(),
            txt_inputs2: TxtInputs2::default(),
            reserved: [0; 158],
        }
    }
}

impl fmt::Display for FishX1Transfer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Transfer ID={} I={}", self.state.id, self.input.uni[0])?;
        for value in &self.input.uni[1..] {
            write!(f, " {value}")?;
        }
        write!(f, " C={}", self.input.counter[0])?;
        for value in &self.input.counter[1..] {
            write!(f, " {value}")?;
        }
        write!(f, " O={}-{}", self.output.duty[0], self.output.duty[1])?;
        for pair in self.output.duty[2..].chunks_exact(2) {
            write!(f, " {}-{}", pair[0], pair[1])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_kits_default_configuration() {
        let area = FishX1Transfer::default();
        assert_eq!(area.state.config_id, 1);
        assert_eq!(area.config.motor, [1; 4]);
        assert_eq!(area.config.uni, [UniConfig::digital(InputMode::Resistance); 8]);
        assert!(area.config.cnt.iter().all(|counter| counter.mode == 1));
        assert_eq!(area.output, OutputValues::default());
    }

    #[test]
    fn the_printed_line_is_the_kits() {
        let mut area = FishX1Transfer::default();
        area.state.id = 1;
        *area.input.uni = [1, 27, -3, 0, 5000, 0, 0, 1];
        *area.input.counter = [4, 3, 2, 1];
        *area.output.duty = [512, 0, 0, 256, 1, 2, 0, 0];
        assert_eq!(
            area.to_string(),
            "Transfer ID=1 I=1 27 -3 0 5000 0 0 1 C=4 3 2 1 O=512-0 0-256 1-2 0-0"
        );
    }
}
