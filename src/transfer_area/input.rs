//! The parts that the controller writes: inputs, infrared remotes, microphone, timers.

use std::time::Duration;

use super::{PerCounter, PerInput, PerMotor, IZ_IR_RECEIVER};

/// Values of the inputs and counters, 68 bytes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_INPUT")]
#[doc(alias = "TA_INPUT")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputValues {
    /// I1 to I8: 0 or 1 when digital, else Ω, mV or cm as configured
    /// (see [`InputMode`](super::InputMode)).
    #[doc(alias = "m_universalInputs")]
    pub uni: PerInput<i16>,
    /// C1 to C4: the current level, 0 or 1.
    #[doc(alias = "m_counter_input")]
    pub cnt_in: PerCounter<i16>,
    /// C1 to C4: pulses since the last reset.
    #[doc(alias = "m_counter_value")]
    pub counter: PerCounter<i16>,
    /// Left button of the ROBO TX. Not used online.
    pub display_button_left: i16,
    /// Right button of the ROBO TX. Not used online.
    pub display_button_right: i16,
    /// C1 to C4: set to 1 when the last requested counter reset is done; the program clears it.
    pub cnt_resetted: PerCounter<u16>,
    /// M1 to M4: set to 1 when the last motor command is done; the program clears it.
    #[doc(alias = "motor_pos_reached")]
    pub motor_ex_reached: PerMotor<u16>,
    /// C1 to C4: id of the last counter reset that is done.
    #[doc(alias = "m_counter_command_id")]
    pub cnt_reset_cmd_id: PerCounter<u16>,
    /// M1 to M4: id of the last motor command that is done.
    #[doc(alias = "m_motor_command_id")]
    pub motor_ex_cmd_id: PerMotor<u16>,
}

/// What one infrared remote sends, 32 bytes.
///
/// The joysticks give −15..=15 with 0 in the middle. After each signed value come its two halves, as
/// distances from the middle, 0..=15.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "KE_IR_INPUT_V01")]
#[doc(alias = "IR_DATA")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IrInput {
    /// Left joystick, left to right: −15..=15.
    #[doc(alias = "i16JoyLeftX")]
    pub joy_left_x: i16,
    /// Left joystick, how far to the left: 0..=15.
    #[doc(alias = "u16JoyLeftXtoLeft")]
    pub joy_left_x_to_left: u16,
    /// Left joystick, how far to the right: 0..=15.
    #[doc(alias = "u16JoyLeftXtoRight")]
    pub joy_left_x_to_right: u16,
    /// Left joystick, backwards to forward: −15..=15.
    #[doc(alias = "i16JoyLeftY")]
    pub joy_left_y: i16,
    /// Left joystick, how far forward: 0..=15.
    #[doc(alias = "u16JoyLeftYtoForward")]
    pub joy_left_y_to_forward: u16,
    /// Left joystick, how far backwards: 0..=15.
    #[doc(alias = "u16JoyLeftYtoBackwards")]
    pub joy_left_y_to_backwards: u16,
    /// Right joystick, left to right: −15..=15.
    #[doc(alias = "i16JoyRightX")]
    pub joy_right_x: i16,
    /// Right joystick, how far to the left: 0..=15.
    #[doc(alias = "u16JoyRightXtoLeft")]
    pub joy_right_x_to_left: u16,
    /// Right joystick, how far to the right: 0..=15.
    #[doc(alias = "u16JoyRightXtoRight")]
    pub joy_right_x_to_right: u16,
    /// Right joystick, backwards to forward: −15..=15.
    #[doc(alias = "i16JoyRightY")]
    pub joy_right_y: i16,
    /// Right joystick, how far forward: 0..=15.
    #[doc(alias = "u16JoyRightYtoForward")]
    pub joy_right_y_to_forward: u16,
    /// Right joystick, how far backwards: 0..=15.
    #[doc(alias = "u16JoyRightYtoBackwards")]
    pub joy_right_y_to_backwards: u16,
    /// ON button: 1 while pressed.
    #[doc(alias = "u16ButtonOn")]
    pub button_on: u16,
    /// OFF button: 1 while pressed.
    #[doc(alias = "u16ButtonOff")]
    pub button_off: u16,
    /// DIP switch 1: 1 when on. Sent only together with another change.
    #[doc(alias = "u16DipSwitch1")]
    pub dip_switch_1: u16,
    /// DIP switch 2: 1 when on. Sent only together with another change.
    #[doc(alias = "u16DipSwitch2")]
    pub dip_switch_2: u16,
}

/// The TXT's further inputs, 188 bytes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "TXT_SPECIAL_INPUTS")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TxtInputs {
    /// Supply voltage. Not sent online.
    #[doc(alias = "u16TxtPower")]
    pub txt_power: u16,
    /// Processor temperature. Not sent online.
    #[doc(alias = "u16TxtTemp")]
    pub txt_temp: u16,
    /// Reference voltage. Not sent online.
    #[doc(alias = "u16TxtRef")]
    pub txt_ref: u16,
    /// Another voltage. Not sent online.
    #[doc(alias = "u16TxtVB")]
    pub txt_vb: u16,
    /// The infrared remotes, by [`IR_RECEIVER_IDX_ALL_DATA`](super::IR_RECEIVER_IDX_ALL_DATA) and the
    /// constants after it. The order is that of the wire; the kit's document describes another one.
    #[doc(alias = "sIrInput")]
    #[doc(alias = "m_ir")]
    pub ir_input: [IrInput; IZ_IR_RECEIVER + 1],
    /// Id of the last sound command that is done.
    #[doc(alias = "u16SoundCmdId")]
    pub sound_cmd_id: u16,
    /// Clock of the controller: seconds. This and the next fields are not sent online.
    #[doc(alias = "u16Sec")]
    pub sec: u16,
    /// Minutes.
    #[doc(alias = "u16Min")]
    pub min: u16,
    /// Hours, 0..=23.
    #[doc(alias = "u16Hour24")]
    pub hour24: u16,
    /// Hours, 1..=12.
    #[doc(alias = "u16Hour12")]
    pub hour12: u16,
    /// 1 after noon.
    #[doc(alias = "u16PmFlag")]
    pub pm_flag: u16,
    /// Day of the month, 1..=31.
    #[doc(alias = "u16MDay")]
    pub m_day: u16,
    /// Month.
    #[doc(alias = "u16Month")]
    pub month: u16,
    /// Year.
    #[doc(alias = "u16Year")]
    pub year: u16,
    /// Day of the week.
    #[doc(alias = "u16WDay")]
    pub w_day: u16,
}

/// The TXT's microphone, 4 bytes.
///
/// Sent by the compressed exchange of firmware 4.2.4 and later, else 0.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "TXT_SPECIAL_INPUTS_2")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TxtInputs2 {
    /// Loudness, linear.
    #[doc(alias = "u16MicLin")]
    pub mic_lin: u16,
    /// Loudness, logarithmic.
    #[doc(alias = "u16MicLog")]
    pub mic_log: u16,
}

/// Time since the transfer began, in six steps, 12 bytes.
///
/// Each counts modulo 65536: [`timer_1ms`](Self::timer_1ms) starts again after 65.5 s,
/// [`timer_10ms`](Self::timer_10ms) after 10.9 minutes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "RP_TIMER")]
#[doc(alias = "TA_TIMER")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timer {
    /// Milliseconds.
    #[doc(alias = "Timer1ms")]
    pub timer_1ms: u16,
    /// Hundredths of a second.
    #[doc(alias = "Timer10ms")]
    pub timer_10ms: u16,
    /// Tenths of a second.
    #[doc(alias = "Timer100ms")]
    pub timer_100ms: u16,
    /// Seconds.
    #[doc(alias = "Timer1s")]
    pub timer_1s: u16,
    /// Tens of seconds.
    #[doc(alias = "Timer10s")]
    pub timer_10s: u16,
    /// Minutes.
    #[doc(alias = "Timer1min")]
    pub timer_1min: u16,
}

impl Timer {
    /// Sets all six timers to this time since the transfer began.
    ///
    /// A handler does this at every lock. Programs with an [`Exchange`](crate::Exchange) of their own
    /// call it once per cycle.
    #[doc(alias = "UpdateTimers")]
    pub fn set_elapsed(&mut self, elapsed: Duration) {
        let ms = elapsed.as_millis();
        // The truncation is the documented modulo 65536.
        let steps = |step: u128| (ms / step) as u16;
        self.timer_1ms = steps(1);
        self.timer_10ms = steps(10);
        self.timer_100ms = steps(100);
        self.timer_1s = steps(1_000);
        self.timer_10s = steps(10_000);
        self.timer_1min = steps(60_000);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timers_count_in_their_steps_modulo_65536() {
        let mut timer = Timer::default();
        timer.set_elapsed(Duration::from_millis(65_536 + 1_234));
        assert_eq!(
            timer,
            Timer {
                timer_1ms: 1_234,
                timer_10ms: 6_677,
                timer_100ms: 667,
                timer_1s: 66,
                timer_10s: 6,
                timer_1min: 1
            }
        );
    }
}
