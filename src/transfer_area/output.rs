//! The parts that the program writes: motors, lamps, counter resets, sound.

use super::{PerCounter, PerMotor, PerOutput, DUTY_MAX, DUTY_MIN};

/// Values for the outputs, motor commands and counter resets, 44 bytes.
///
/// M1 uses `duty[O1]` and `duty[O2]`, M2 `duty[O3]` and `duty[O4]`, and so on. A motor turns forward
/// when the first of the two is 1..=512 and the second is 0, and backwards when the first is 0 and
/// the second is 1..=512.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "FTX1_OUTPUT")]
#[doc(alias = "TA_OUTPUT")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputValues {
    /// C1 to C4: a new id resets the counter.
    /// [`start_counter_reset`](super::FishX1Transfer::start_counter_reset) raises it.
    #[doc(alias = "m_counter_reset_command_id")]
    pub cnt_reset_cmd_id: PerCounter<u16>,
    /// M1 to M4: 0 independent, 1..=4 synchronised to that motor, 5..=8 synchronised to motor 1..=4
    /// with [`distance`](Self::distance) as injected error. Needs a new
    /// [`motor_ex_cmd_id`](Self::motor_ex_cmd_id) after a change.
    #[doc(alias = "m_motor_master")]
    pub master: PerMotor<u8>,
    /// O1 to O8: 0 off to 512 full. May change at any time. Less than 0 goes out as 0, more than 512
    /// as 512, with a warning in the log. The maker's firmware 4.7.0 (measured under emulation) hands 8 bits to its
    /// I/O board, 512 as 255 and others halved, so 1 is off, and 2 is as 3.
    #[doc(alias = "m_pwmOutputValues")]
    pub duty: PerOutput<i16>,
    /// M1 to M4: stop after this many pulses of the motor's counter, 0 for no limit. Needs a
    /// new [`motor_ex_cmd_id`](Self::motor_ex_cmd_id) after a change.
    #[doc(alias = "m_motor_distance")]
    pub distance: PerMotor<u16>,
    /// M1 to M4: a new id makes the controller take over [`distance`](Self::distance) and
    /// [`master`](Self::master).
    /// [`raise_motor_ex_cmd_id`](super::FishX1Transfer::raise_motor_ex_cmd_id) raises it.
    #[doc(alias = "m_motor_command_id")]
    pub motor_ex_cmd_id: PerMotor<u16>,
}

impl OutputValues {
    /// The duties as they are sent: each the nearest one of 0..=512.
    pub fn sent_duty(&self) -> PerOutput<i16> {
        self.duty.map(|duty| duty.clamp(DUTY_MIN, DUTY_MAX)).into()
    }

    /// Switches every output off and every motor back to plain speed control: duty, distance and
    /// master 0, and a new command id for each motor.
    #[doc(alias = "StopMotors")]
    pub fn stop_motors(&mut self) {
        self.duty = PerOutput::default();
        self.distance = PerMotor::default();
        self.master = PerMotor::default();
        for id in &mut self.motor_ex_cmd_id {
            *id = id.wrapping_add(1);
        }
    }
}

/// The TXT's further outputs, 10 bytes.
///
/// Closed on purpose: the fields are those of the controller's memory.
#[doc(alias = "TXT_SPECIAL_OUTPUTS")]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TxtOutputs {
    /// A new id starts the sound below, or plays the same one again.
    /// [`raise_sound_cmd_id`](super::FishX1Transfer::raise_sound_cmd_id) raises it.
    #[doc(alias = "u16SoundCmdId")]
    #[doc(alias = "m_sound_command_id")]
    pub sound_cmd_id: u16,
    /// Number of the sound file, 1..=29 as delivered; 0 is silence.
    #[doc(alias = "u16SoundIndex")]
    #[doc(alias = "m_sound_index")]
    pub sound_index: u16,
    /// How often the sound is played. The kit's manual says that 0 is without end; the maker's firmware 4.7.0
    /// (measured under emulation) plays it once then.
    #[doc(alias = "u16SoundRepeat")]
    #[doc(alias = "m_sound_repeat")]
    pub sound_repeat: u16,
    /// Red part of the start button's colour. This and the next two fields are not sent online.
    #[doc(alias = "u8LEDColorR")]
    pub led_color_r: u8,
    /// Green part.
    #[doc(alias = "u8LEDColorG")]
    pub led_color_g: u8,
    /// Blue part.
    #[doc(alias = "u8LEDColorB")]
    pub led_color_b: u8,
    /// Unused.
    pub dummy: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stopping_the_motors_leaves_the_extended_mode_with_a_new_id() {
        let mut output = OutputValues {
            duty: [512, 0, 0, 300, 1, 2, 3, 4].into(),
            distance: [1000, 0, 0, 5].into(),
            master: [0, 1, 0, 8].into(),
            motor_ex_cmd_id: [7, 0, u16::MAX, 1].into(),
            cnt_reset_cmd_id: [1, 2, 3, 4].into(),
        };
        output.stop_motors();
        assert_eq!(
            output,
            OutputValues {
                motor_ex_cmd_id: [8, 1, 0, 2].into(),
                cnt_reset_cmd_id: [1, 2, 3, 4].into(),
                ..OutputValues::default()
            }
        );
    }
}
