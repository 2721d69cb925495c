//! What a program on a TXT reads of its supply and temperature. A TXT in online mode does not send it, so these are
//! the values of one with a full battery.

use ft_transfer_area::transfer_area::TxtInputs;

use crate::host;
use crate::report;

/// The environment variable with another supply voltage, in millivolts.
const VARIABLE: &str = "FT_TXT_POWER";
/// A TXT has 14 bits for it.
const POWER_MAX: u16 = 0x3FFF;

/// A full battery, in millivolts.
const POWER: u16 = 8400;
/// The units of these are not known. A TXT has one byte for the first and the last, and 14 bits for the other one.
const TEMPERATURE: u16 = 40;
const REFERENCE: u16 = 3300;
const VB: u16 = 84;

/// The supply of the TXT that a program believes to run on.
#[derive(Clone, Copy)]
pub(crate) struct Supply {
    power: u16,
}

impl Supply {
    /// What the environment variable says, or a full battery.
    pub(crate) fn of_environment() -> Self {
        let power = host::variable(VARIABLE).map_or(POWER, |text| {
            power_of(&text).unwrap_or_else(|| {
                report::failure(format_args!(
                    "{VARIABLE} is {text:?}, but has to be a number of millivolts up to {POWER_MAX}"
                ));
                POWER
            })
        });
        Self { power }
    }

    /// Writes it into the inputs.
    pub(crate) fn fill(self, inputs: &mut TxtInputs) {
        inputs.txt_power = self.power;
        inputs.txt_temp = TEMPERATURE;
        inputs.txt_ref = REFERENCE;
        inputs.txt_vb = VB;
    }
}

fn power_of(text: &str) -> Option<u16> {
    text.parse().ok().filter(|power| *power <= POWER_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_has_14_bits() {
        let powers = ["6500", "0", "16383", "16384", "-1", "9V"].map(power_of);
        assert_eq!(powers, [Some(6500), Some(0), Some(16383), None, None, None]);
    }
}
