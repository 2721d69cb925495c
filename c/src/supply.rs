//! What a program on a TXT reads of its supply and temperature. A TXT in online mode does not send it, so these are
//! the values of one with a full battery.

use ft_transfer_area::transfer_area::TxtInputs;

use crate::host;
use crate::report;

/// The environment variables with other values. The first one is in millivolts; the units of the others are not known. A
/// TXT has one byte for the temperature, and 14 bits for the voltages.
const POWER: Variable = Variable { name: "FT_TXT_POWER", most: 0x3FFF, full: 8400 };
const TEMPERATURE: Variable = Variable { name: "FT_TXT_TEMPERATURE", most: 0xFF, full: 40 };
const REFERENCE: Variable = Variable { name: "FT_TXT_REFERENCE", most: 0x3FFF, full: 3300 };
/// One byte, and nobody says what it is.
const VB: u16 = 84;

/// A value that the environment may set.
struct Variable {
    name: &'static str,
    most: u16,
    /// With a full battery.
    full: u16,
}

impl Variable {
    fn value(&self) -> u16 {
        host::variable(self.name).map_or(self.full, |text| {
            self.value_of(&text).unwrap_or_else(|| {
                let Self { name, most, .. } = self;
                report::failure(format_args!(
                    "{name} is {text:?}, but has to be a number from 0 to {most}"
                ));
                self.full
            })
        })
    }

    fn value_of(&self, text: &str) -> Option<u16> {
        text.parse().ok().filter(|value| *value <= self.most)
    }
}

/// The supply of the TXT that a program believes to run on.
#[derive(Clone, Copy)]
pub(crate) struct Supply {
    power: u16,
    temperature: u16,
    reference: u16,
}

impl Supply {
    /// What the environment variables say, or a full battery.
    pub(crate) fn of_environment() -> Self {
        let [power, temperature, reference] =
            [POWER, TEMPERATURE, REFERENCE].map(|variable| variable.value());
        Self { power, temperature, reference }
    }

    /// Writes it into the inputs.
    pub(crate) fn fill(self, inputs: &mut TxtInputs) {
        inputs.txt_power = self.power;
        inputs.txt_temp = self.temperature;
        inputs.txt_ref = self.reference;
        inputs.txt_vb = VB;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_has_14_bits() {
        let powers = ["6500", "0", "16383", "16384", "-1", "9V"].map(|text| POWER.value_of(text));
        assert_eq!(powers, [Some(6500), Some(0), Some(16383), None, None, None]);
    }
}
