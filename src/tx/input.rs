//! Universal inputs, the microphone and the extensions.

use super::{Input, InvalidCall};
use crate::transfer_area::FishX1Transfer;

/// What a universal input reports. Closed on purpose: it has the two values of the C call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IoValue {
    /// 0 or 1 when digital, else Ω, mV or cm as configured.
    pub value: i16,
    /// Whether a measured value is over range, also when nothing is connected.
    #[doc(alias = "overrun")]
    pub over_range: bool,
}

impl FishX1Transfer {
    /// The value of a universal input, and whether it is over range: above the
    /// [range](crate::transfer_area::InputMode::range) of its mode. An ultrasonic sensor that is not connected
    /// is over range too.
    #[doc(alias = "GetInIOValue")]
    #[must_use]
    pub fn get_in_io_value(&self, input: Input) -> IoValue {
        let value = self.input.uni[input.index()];
        let over_range = self.config.uni[input.index()].is_over_range(value);
        IoValue { value, over_range }
    }

    /// The state of a digital input.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::NotDigital`] when the input reports a measured value.
    #[doc(alias = "GetInIOValueBinary")]
    pub fn get_in_io_value_binary(&self, input: Input) -> Result<bool, InvalidCall> {
        if !self.config.uni[input.index()].is_digital() {
            return Err(InvalidCall::NotDigital { input });
        }
        Ok(self.input.uni[input.index()] != 0)
    }

    /// The measured value of an input: Ω, mV or cm as configured.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::NotAnalog`] when the input is digital.
    #[doc(alias = "GetInIOValueAnalogue")]
    pub fn get_in_io_value_analogue(&self, input: Input) -> Result<i16, InvalidCall> {
        if self.config.uni[input.index()].is_digital() {
            return Err(InvalidCall::NotAnalog { input });
        }
        Ok(self.input.uni[input.index()])
    }

    /// The loudness at the microphone, linear. 0 in the simple exchange and before firmware 4.2.4.
    #[doc(alias = "GetMicLin")]
    #[must_use]
    pub fn get_mic_lin(&self) -> u16 {
        self.txt_inputs2.mic_lin
    }

    /// The loudness at the microphone, logarithmic. 0 in the simple exchange and before firmware
    /// 4.2.4.
    #[doc(alias = "GetMicLog")]
    #[must_use]
    pub fn get_mic_log(&self) -> u16 {
        self.txt_inputs2.mic_log
    }

    /// How many extensions took part in the last exchange. Only the master's area has it.
    #[doc(alias = "IsSlaveActive")]
    #[must_use]
    pub fn slaves_alive(&self) -> usize {
        self.state.io_slave_alive.iter().filter(|alive| **alive != 0).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer_area::{InputMode, UniConfig, NO_ULTRASONIC};

    #[test]
    fn each_mode_has_its_own_over_range() {
        for (mode, most) in [
            (InputMode::Voltage, 9_999),
            (InputMode::Resistance, 4_999),
            (InputMode::Resistance15k, 14_999),
            (InputMode::Ultrasonic, 1_023),
        ] {
            let mut area = FishX1Transfer::default();
            area.set_ft_uni_config(Input::I5, mode, false);
            for (value, over_range) in [(0, false), (most, false), (most + 1, true)] {
                area.input.uni[4] = value;
                assert_eq!(area.get_in_io_value(Input::I5), IoValue { value, over_range });
            }
        }
        let mut area = FishX1Transfer::default();
        area.set_ft_uni_config(Input::I1, InputMode::Ultrasonic, false);
        area.input.uni[0] = NO_ULTRASONIC;
        assert!(area.get_in_io_value(Input::I1).over_range);
        area.config.uni[0] = UniConfig { mode: 9, digital: 0, dummy: [0; 2] };
        assert!(!area.get_in_io_value(Input::I1).over_range);
    }

    #[test]
    fn digital_and_measured_values_are_not_taken_for_each_other() {
        let mut area = FishX1Transfer::default();
        area.set_ft_uni_config(Input::I2, InputMode::Resistance, false);
        *area.input.uni = [1, 4000, 0, 0, 0, 0, 0, 0];
        assert_eq!(area.get_in_io_value_binary(Input::I1), Ok(true));
        assert_eq!(area.get_in_io_value_binary(Input::I3), Ok(false));
        assert_eq!(area.get_in_io_value_analogue(Input::I2), Ok(4000));
        let (digital, analog) = (Input::I1, Input::I2);
        assert_eq!(
            area.get_in_io_value_analogue(digital),
            Err(InvalidCall::NotAnalog { input: digital })
        );
        assert_eq!(
            area.get_in_io_value_binary(analog),
            Err(InvalidCall::NotDigital { input: analog })
        );
        assert!(!area.get_in_io_value(digital).over_range);
    }

    #[test]
    fn microphone_and_extensions_are_read() {
        let mut area = FishX1Transfer::default();
        area.state.io_slave_alive = [1, 0, 1, 0, 0, 0, 0, 1];
        (area.txt_inputs2.mic_lin, area.txt_inputs2.mic_log) = (7, 8);
        assert_eq!((area.slaves_alive(), area.get_mic_lin(), area.get_mic_log()), (3, 7, 8));
    }
}
