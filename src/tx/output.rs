//! Motors at plain speed control, and single outputs.

use super::{InvalidCall, Motor, Output};
use crate::transfer_area::{FishX1Transfer, DUTY_MAX, DUTY_MIN};

/// Which way a motor turns. The numbers are FtTxtLib's. Closed on purpose: there is no other way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Counterclockwise: the second output of the pair is on.
    #[doc(alias = "CCW")]
    Ccw = -1,
    /// The motor does not turn, with any duty.
    Halt = 0,
    /// Clockwise: the first output of the pair is on.
    #[doc(alias = "CW")]
    Cw = 1,
}

impl FishX1Transfer {
    /// Turns a motor with this duty, 0..=512, in this direction.
    ///
    /// In the extended mode the motor goes on to its distance with the new duty.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::OutOfRange`] for the duty, [`InvalidCall::NotAMotor`] for a pair of single outputs.
    #[doc(alias = "SetOutMotorValues")]
    pub fn set_out_motor_values(
        &mut self,
        motor: Motor,
        duty: i16,
        direction: Direction,
    ) -> Result<(), InvalidCall> {
        check_duty(duty)?;
        self.check_motor(motor)?;
        self.set_duties(motor, duty, direction);
        Ok(())
    }

    /// Turns a motor with this power: −512 counterclockwise to 512 clockwise. FtTxtLib has it under
    /// the same name as [`set_out_motor_values`](Self::set_out_motor_values).
    ///
    /// # Errors
    ///
    /// [`InvalidCall::OutOfRange`] for the power, [`InvalidCall::NotAMotor`] for a pair of single outputs.
    #[doc(alias = "SetOutMotorValues")]
    pub fn set_out_motor_power(&mut self, motor: Motor, power: i16) -> Result<(), InvalidCall> {
        check_power(power)?;
        let direction = if power < 0 { Direction::Ccw } else { Direction::Cw };
        self.set_out_motor_values(motor, power.abs(), direction)
    }

    /// Lets a motor turn the other way with the same duty.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::NotAMotor`] for a pair of single outputs.
    #[doc(alias = "SetOutMotorInverse")]
    pub fn set_out_motor_inverse(&mut self, motor: Motor) -> Result<(), InvalidCall> {
        self.check_motor(motor)?;
        let [first, second] = motor.outputs();
        self.output.duty.swap(first.index(), second.index());
        Ok(())
    }

    /// The power of a motor, −512 to 512: the duty of its first output minus that of its second.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::NotAMotor`] for a pair of single outputs.
    #[doc(alias = "GetOutMotorValues")]
    pub fn get_out_motor_values(&self, motor: Motor) -> Result<i16, InvalidCall> {
        self.check_motor(motor)?;
        let [first, second] = motor.outputs().map(|output| self.output.duty[output.index()]);
        Ok(first.saturating_sub(second))
    }

    /// Sets the duty of a single output, 0 off to 512 full.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::OutOfRange`] for the duty, [`InvalidCall::NotAnOutput`] for half of a motor.
    #[doc(alias = "SetOutPwmValues")]
    pub fn set_out_pwm_values(&mut self, output: Output, duty: i16) -> Result<(), InvalidCall> {
        check_duty(duty)?;
        self.check_output(output)?;
        self.output.duty[output.index()] = duty;
        Ok(())
    }

    /// The duty of a single output.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::NotAnOutput`] for half of a motor.
    #[doc(alias = "GetOutPwmValues")]
    pub fn get_out_pwm_values(&self, output: Output) -> Result<i16, InvalidCall> {
        self.check_output(output)?;
        Ok(self.output.duty[output.index()])
    }

    /// Sets both outputs of a pair.
    pub(super) fn set_duties(&mut self, motor: Motor, duty: i16, direction: Direction) {
        let duties = match direction {
            Direction::Cw => [duty, 0],
            Direction::Halt => [0, 0],
            Direction::Ccw => [0, duty],
        };
        for (output, duty) in motor.outputs().into_iter().zip(duties) {
            self.output.duty[output.index()] = duty;
        }
    }

    /// An error when the pair is two single outputs.
    pub(super) fn check_motor(&self, motor: Motor) -> Result<(), InvalidCall> {
        if self.is_motor(motor) {
            Ok(())
        } else {
            Err(InvalidCall::NotAMotor { motor })
        }
    }

    fn check_output(&self, output: Output) -> Result<(), InvalidCall> {
        if self.is_motor(output.motor()) {
            Err(InvalidCall::NotAnOutput { output })
        } else {
            Ok(())
        }
    }
}

/// A duty of an output, 0 off to 512 full, from any number.
///
/// # Errors
///
/// [`InvalidCall::OutOfRange`].
pub fn check_duty(duty: impl Into<i64>) -> Result<i16, InvalidCall> {
    checked(duty.into(), DUTY_MIN)
}

/// The power of a motor, −512 counterclockwise to 512 clockwise, from any number.
///
/// # Errors
///
/// [`InvalidCall::OutOfRange`].
pub fn check_power(power: impl Into<i64>) -> Result<i16, InvalidCall> {
    checked(power.into(), -DUTY_MAX)
}

fn checked(given: i64, least: i16) -> Result<i16, InvalidCall> {
    InvalidCall::check_range("duty", given, least.into()..=DUTY_MAX.into())?;
    // Checked above.
    Ok(given as i16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_switches_one_output_on_and_the_other_off() {
        let mut area = FishX1Transfer::default();
        for (direction, duties, power) in [
            (Direction::Cw, [300, 0], 300),
            (Direction::Ccw, [0, 300], -300),
            (Direction::Halt, [0, 0], 0),
        ] {
            area.set_out_motor_values(Motor::M2, 300, direction).unwrap();
            assert_eq!(area.output.duty, [0, 0, duties[0], duties[1], 0, 0, 0, 0]);
            assert_eq!(area.get_out_motor_values(Motor::M2), Ok(power));
            area.set_out_motor_inverse(Motor::M2).unwrap();
            assert_eq!(area.get_out_motor_values(Motor::M2), Ok(-power));
            area.set_out_motor_power(Motor::M2, power).unwrap();
            assert_eq!(area.output.duty[2..4], duties);
        }
    }

    #[test]
    fn duties_out_of_range_are_refused_and_change_nothing() {
        let mut area = FishX1Transfer::default();
        area.set_ft_motor_config(Motor::M4, false);
        *area.output.duty = [512, 0, 0, 0, 0, 0, 100, 0];
        let before = area;
        for duty in [-1, 513, i16::MIN, i16::MAX] {
            let given = i64::from(duty);
            let refused = Err(InvalidCall::OutOfRange { what: "duty", given, least: 0, most: 512 });
            assert_eq!(area.set_out_motor_values(Motor::M1, duty, Direction::Cw), refused);
            assert_eq!(area.set_out_pwm_values(Output::O7, duty), refused);
        }
        for power in [-513, 513, i16::MIN, i16::MAX] {
            let error = area.set_out_motor_power(Motor::M1, power).unwrap_err();
            assert!(
                matches!(error, InvalidCall::OutOfRange { least: -512, most: 512, .. }),
                "{error}"
            );
        }
        assert_eq!(area, before);
        area.set_out_motor_power(Motor::M1, -512).unwrap();
        area.set_out_pwm_values(Output::O7, 512).unwrap();
        assert_eq!(area.output.duty, [0, 512, 0, 0, 0, 0, 512, 0]);
    }

    #[test]
    fn motors_and_single_outputs_refuse_each_others_calls() {
        let mut area = FishX1Transfer::default();
        area.set_ft_motor_config(Motor::M4, false);
        area.set_out_pwm_values(Output::O8, 40).unwrap();
        let before = area;
        let (motor, output) = (Motor::M4, Output::O1);
        let not_a_motor = InvalidCall::NotAMotor { motor };
        assert_eq!(area.set_out_motor_values(motor, 1, Direction::Cw), Err(not_a_motor));
        assert_eq!(area.set_out_motor_power(motor, 1), Err(not_a_motor));
        assert_eq!(area.set_out_motor_inverse(motor), Err(not_a_motor));
        assert_eq!(area.get_out_motor_values(motor), Err(not_a_motor));
        assert_eq!(area.set_out_pwm_values(output, 1), Err(InvalidCall::NotAnOutput { output }));
        assert_eq!(area.get_out_pwm_values(output), Err(InvalidCall::NotAnOutput { output }));
        assert_eq!(area, before);
        assert_eq!(area.get_out_pwm_values(Output::O8), Ok(40));
    }

    #[test]
    fn any_bits_in_the_area_have_a_power() {
        let mut area = FishX1Transfer::default();
        *area.output.duty = [i16::MAX, i16::MIN, i16::MIN, i16::MAX, 0, 0, 0, 0];
        assert_eq!(area.get_out_motor_values(Motor::M1), Ok(i16::MAX));
        assert_eq!(area.get_out_motor_values(Motor::M2), Ok(i16::MIN));
    }
}
