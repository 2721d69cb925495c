//! Why a call of this module was refused.

use std::fmt;
use std::ops::RangeInclusive;

use super::{Input, Motor, Output};

/// Why a call of [`tx`](crate::tx) was refused. Nothing was changed, and nothing is sent.
///
/// It says what is wrong and which values are right. `?` makes it an [`Error`](crate::Error) in a function that
/// returns one. `{:?}` is the sentence of `{}`, as for `Error`.
#[doc(alias = "FTLIB_ERR_INVALID_PARAM")]
#[derive(Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum InvalidCall {
    /// An argument is out of its range.
    OutOfRange {
        /// What the number is for.
        what: &'static str,
        /// What was given.
        given: i64,
        /// The lowest number allowed.
        least: i64,
        /// The highest number allowed.
        most: i64,
    },
    /// The call is for a motor, but these outputs are configured as two single ones.
    NotAMotor {
        /// The motor.
        motor: Motor,
    },
    /// The call is for a single output, but this one is configured as half of a motor.
    NotAnOutput {
        /// The output.
        output: Output,
    },
    /// A motor command has 0 pulses. To turn motors without a distance, use
    /// [`start_synchronised`](crate::FishX1Transfer::start_synchronised).
    ZeroPulses,
    /// A motor command names this motor twice.
    MotorTwice {
        /// The motor.
        motor: Motor,
    },
    /// The call is for a digital input, but this one reports a measured value.
    NotDigital {
        /// The input.
        input: Input,
    },
    /// The call is for a measured value, but this input is digital.
    NotAnalog {
        /// The input.
        input: Input,
    },
}

impl InvalidCall {
    /// Returns an error unless a number is in its range.
    pub(super) fn check_range(
        what: &'static str,
        given: i64,
        range: RangeInclusive<i64>,
    ) -> Result<(), Self> {
        if range.contains(&given) {
            return Ok(());
        }
        Err(Self::OutOfRange { what, given, least: *range.start(), most: *range.end() })
    }
}

impl fmt::Display for InvalidCall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { what, given, least, most } => {
                write!(f, "the {what} is {given}, but has to be {least} to {most}")
            }
            Self::NotAMotor { motor } => {
                let [first, second] = motor.outputs();
                write!(
                    f,
                    "{motor} is configured as the single outputs {first} and {second}; make it a motor \
                     by set_ft_motor_config, or use set_out_pwm_values"
                )
            }
            Self::NotAnOutput { output } => write!(
                f,
                "{output} belongs to {}, which is configured as a motor; make it two single outputs \
                 by set_ft_motor_config, or use set_out_motor_values",
                output.motor()
            ),
            Self::ZeroPulses => write!(
                f,
                "a distance is 1 to 65535 pulses, not 0; to turn motors without a distance, alone or \
                 together, call start_synchronised"
            ),
            Self::MotorTwice { motor } => write!(
                f,
                "{motor} is named twice in one motor command; master and slaves have to be \
                 different motors"
            ),
            Self::NotDigital { input } => write!(
                f,
                "{input} is configured to report its measured value; make it digital by \
                 set_ft_uni_config, or use get_in_io_value_analogue"
            ),
            Self::NotAnalog { input } => write!(
                f,
                "{input} is configured as digital; make it report its measured value by \
                 set_ft_uni_config, or use get_in_io_value_binary"
            ),
        }
    }
}

impl fmt::Debug for InvalidCall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for InvalidCall {}
