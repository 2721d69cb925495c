//! What a TXT measures of itself.

use toml::de::DeValue;

use super::mistake::{at, expect, Checked};
use super::read::{whole, Keys, Read};

const SUPPLY: &str = "expected a supply, as in { power = 6500 }";

/// A TXT has 14 bits for the voltages, and one byte for the temperature.
const VOLTAGE_MAX: u16 = 0x3FFF;
const TEMPERATURE_MAX: u16 = 0xFF;

/// The supply of the master, as a program on the TXT itself reads it. The default is that of a full battery.
///
/// A TXT in online mode does not send it, so the simulated TXT does not either: it is for what runs a program as if it
/// were on the TXT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Supply {
    /// Its voltage in mV.
    pub power: u16,
    /// The TXT's temperature, in a unit that is not known.
    pub temperature: u16,
    /// The reference voltage, in a unit that is not known.
    pub reference: u16,
}

impl Default for Supply {
    fn default() -> Self {
        Self { power: 8400, temperature: 40, reference: 3300 }
    }
}

impl Supply {
    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let full = Self::default();
        let keys = Keys::of(value, SUPPLY, &full.all().map(|(key, ..)| key))?;
        let number = |key, value, most: u16| keys.or(key, value, whole(0..=most.into()));
        let [power, temperature, reference] =
            full.all().map(|(key, value, most)| number(key, value, most));
        Ok(Self { power: power?, temperature: temperature?, reference: reference? })
    }

    pub(super) fn check(&self) -> Checked {
        self.all().into_iter().try_for_each(|(key, value, most)| {
            at(key, expect(value <= most, || format!("expected 0 to {most}, not {value}")))
        })
    }

    /// Each key with its value and the highest one.
    fn all(&self) -> [(&'static str, u16, u16); 3] {
        [
            ("power", self.power, VOLTAGE_MAX),
            ("temperature", self.temperature, TEMPERATURE_MAX),
            ("reference", self.reference, VOLTAGE_MAX),
        ]
    }
}
