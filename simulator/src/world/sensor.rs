//! Sensors: how a file has them, their ranges, and what they give to their input.

use ft_transfer_area::transfer_area::InputMode;
use toml::de::DeValue;

use super::mistake::{at, in_range, not_negative, Checked, Mistake};
use super::read::{number, only, truth, whole, Keys, Read};
use super::slide::SEEN_BY;

const SENSOR: &str = "expected one sensor, as in I1 = { button = {} }";
const VALUES: &str = "expected what belongs to it in braces, as in { ultrasonic = { cm = 30 } }";
const CONTACT: &str = "expected \"normally_open\" or \"normally_closed\"";

/// The range of an NTC in °C.
const CELSIUS_MIN: f64 = -50.0;
const CELSIUS_MAX: f64 = 150.0;

/// fischertechnik's NTC at 25 °C, in Ω.
const NTC_OHMS: f64 = 1500.0;
/// How steep its curve is, in K.
const NTC_B: f64 = 3900.0;
/// 0 °C in K.
const ICE: f64 = 273.15;

/// A photo transistor in the dark and in bright light, in Ω.
const PHOTO_DARK: f64 = 20_000.0;
const PHOTO_BRIGHT: f64 = 100.0;

/// The output of a trail sensor over white and over black, in mV.
const TRAIL_WHITE: f64 = 9000.0;
const TRAIL_BLACK: f64 = 300.0;

/// A sensor plugged into a universal input.
///
/// What an input reports depends on its [mode](InputMode):
///
/// | sensor | resistance | voltage | ultrasonic |
/// |---|---|---|---|
/// | switch, button | closed: lowest value of the range; open: over range | 0 | not present |
/// | resistor, NTC, photo transistor | its Ω | 0 | not present |
/// | voltage, colour, trail | over range | its mV | not present |
/// | ultrasonic | over range | 0 | its cm |
/// | nothing | over range | 0 | not present |
///
/// A digital input reports 1 for less than half its range in Ω (2500 or 7500), and for 5000 mV or
/// more. These thresholds are assumed; the kit does not name them. A distance is in cm, also when the
/// input is digital, and in a mode that does not exist a voltage is measured in mV.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Sensor {
    /// A switch that a slide or the test presses.
    Switch {
        /// Which of its contacts is used.
        contact: Contact,
        /// Whether it is pressed at the start.
        pressed: bool,
    },
    /// A push button that a finger presses.
    Button {
        /// Which of its contacts is used.
        contact: Contact,
        /// Whether it is pressed at the start.
        pressed: bool,
    },
    /// A resistor or potentiometer.
    Resistor {
        /// Its resistance in Ω.
        ohms: u32,
    },
    /// fischertechnik's NTC: 1.5 kΩ at 25 °C, less when it is warmer.
    Ntc {
        /// Its temperature in °C, −50..=150.
        celsius: f64,
    },
    /// A photo transistor: 20 kΩ in the dark, 100 Ω in bright light.
    PhotoTransistor {
        /// The brightness, 0..=1. The current through it is proportional.
        light: f64,
    },
    /// A voltage.
    Voltage {
        /// In mV.
        mv: u16,
    },
    /// The ultrasonic distance sensor.
    Ultrasonic {
        /// The distance of the echo in cm, at least 0. Above 1023 there is no echo.
        cm: f64,
    },
    /// The optical colour sensor.
    Colour {
        /// Its output in mV.
        mv: u16,
    },
    /// One half of the infrared trail sensor: 9 V over white, 0.3 V over black.
    Trail {
        /// Whether it is over white.
        white: bool,
    },
}

/// Which contact of a switch is used. There are only these two, so it is closed on purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Contact {
    /// Closed while the switch is pressed (contacts 1 and 3).
    #[default]
    NormallyOpen,
    /// Open while the switch is pressed (contacts 1 and 2).
    NormallyClosed,
}

impl Contact {
    fn read(value: &DeValue<'_>) -> Read<Self> {
        match value.as_str() {
            Some("normally_open") => Ok(Self::NormallyOpen),
            Some("normally_closed") => Ok(Self::NormallyClosed),
            _ => Err(Mistake::new(CONTACT)),
        }
    }
}

/// The present value of a [`Sensor`] as one number.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SensorValue {
    /// The value; 1 for pressed, or for white under a trail sensor, and otherwise 0.
    pub value: f64,
    /// The least value that is of use.
    pub min: f64,
    /// The greatest value that is of use.
    pub max: f64,
    /// Its unit: Ω, °C, %, mV or cm; empty for pressed and white.
    pub unit: &'static str,
}

/// What a sensor gives to its input.
#[derive(Clone, Copy, Debug)]
pub(super) enum Signal {
    /// A resistance; infinite when none can be measured.
    Ohms(f64),
    /// A voltage in mV.
    Millivolts(f64),
    /// The distance of an echo in cm.
    Echo(f64),
}

impl Sensor {
    /// A switch that is closed while it is pressed.
    pub const SWITCH: Self = Self::Switch { contact: Contact::NormallyOpen, pressed: false };

    /// A push button that is closed while it is pressed.
    pub const BUTTON: Self = Self::Button { contact: Contact::NormallyOpen, pressed: false };

    /// A sensor of each kind, as a file has it without any keys.
    const KINDS: [Self; 9] = [
        Self::SWITCH,
        Self::BUTTON,
        Self::Resistor { ohms: 0 },
        Self::Ntc { celsius: 0.0 },
        Self::PhotoTransistor { light: 0.0 },
        Self::Voltage { mv: 0 },
        Self::Ultrasonic { cm: 0.0 },
        Self::Colour { mv: 0 },
        Self::Trail { white: false },
    ];

    /// Its name in a world file, such as `photo_transistor`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Switch { .. } => "switch",
            Self::Button { .. } => "button",
            Self::Resistor { .. } => "resistor",
            Self::Ntc { .. } => "ntc",
            Self::PhotoTransistor { .. } => "photo_transistor",
            Self::Voltage { .. } => "voltage",
            Self::Ultrasonic { .. } => "ultrasonic",
            Self::Colour { .. } => "colour",
            Self::Trail { .. } => "trail",
        }
    }

    /// Its present value as one number, in a unit and a range that suit a person.
    ///
    /// ```
    /// use ft_transfer_area_simulator::world::Sensor;
    ///
    /// let light = Sensor::PhotoTransistor { light: 0.25 }.value();
    /// assert_eq!((light.value, light.min, light.max, light.unit), (25.0, 0.0, 100.0, "%"));
    /// ```
    pub fn value(&self) -> SensorValue {
        let (value, min, max, unit) = match *self {
            Self::Switch { pressed: on, .. }
            | Self::Button { pressed: on, .. }
            | Self::Trail { white: on } => (f64::from(u8::from(on)), 0.0, 1.0, ""),
            Self::Resistor { ohms } => (f64::from(ohms), 0.0, 16_000.0, "Ω"),
            Self::Ntc { celsius } => (celsius, CELSIUS_MIN, CELSIUS_MAX, "°C"),
            Self::PhotoTransistor { light } => (light * 100.0, 0.0, 100.0, "%"),
            Self::Voltage { mv } | Self::Colour { mv } => (f64::from(mv), 0.0, 10_000.0, "mV"),
            // From 1024 cm on there is no echo.
            Self::Ultrasonic { cm } => (cm.min(1024.0), 0.0, 1024.0, "cm"),
        };
        SensorValue { value, min, max, unit }
    }

    /// Sets its value in the unit of [`value`](Self::value). A switch, button or trail sensor is pressed, or over
    /// white, with any number but 0.
    pub fn set_value(&mut self, value: f64) {
        match self {
            Self::Switch { pressed: on, .. }
            | Self::Button { pressed: on, .. }
            | Self::Trail { white: on } => *on = value != 0.0,
            // A number out of range becomes the nearest one in it.
            Self::Resistor { ohms } => *ohms = value.round() as u32,
            Self::Ntc { celsius } => *celsius = value,
            Self::PhotoTransistor { light } => *light = value / 100.0,
            Self::Voltage { mv } | Self::Colour { mv } => *mv = value.round() as u16,
            Self::Ultrasonic { cm } => *cm = value,
        }
    }

    /// The mode in which an input measures it, and whether the input is digital.
    pub fn input_mode(&self) -> (InputMode, bool) {
        match self {
            Self::Switch { .. } | Self::Button { .. } => (InputMode::Resistance, true),
            Self::Resistor { .. } | Self::Ntc { .. } => (InputMode::Resistance, false),
            Self::PhotoTransistor { .. } => (InputMode::Resistance15k, false),
            Self::Voltage { .. } | Self::Colour { .. } => (InputMode::Voltage, false),
            Self::Ultrasonic { .. } => (InputMode::Ultrasonic, false),
            Self::Trail { .. } => (InputMode::Voltage, true),
        }
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let (kind, value) = only(value, SENSOR)?;
        at(kind, Self::read_kind(kind, value))
    }

    fn read_kind(kind: &str, value: &DeValue<'_>) -> Read<Self> {
        let Some(mut sensor) = Self::KINDS.into_iter().find(|sensor| sensor.kind() == kind) else {
            let kinds = Self::KINDS.each_ref().map(Self::kind).join(", ");
            return Err(Mistake::new(format!("there is no such sensor; there are {kinds}")));
        };
        let keys = |known: &[&str]| Keys::of(value, VALUES, known);
        match &mut sensor {
            Self::Switch { contact, pressed } | Self::Button { contact, pressed } => {
                let keys = keys(&["contact", "pressed"])?;
                *contact = keys.or("contact", Contact::default(), Contact::read)?;
                *pressed = keys.or("pressed", false, truth)?;
            }
            Self::Resistor { ohms } => {
                *ohms = keys(&["ohms"])?.required("ohms", whole(0..=u32::MAX.into()))?;
            }
            Self::Ntc { celsius } => *celsius = keys(&["celsius"])?.required("celsius", number)?,
            Self::PhotoTransistor { light } => {
                *light = keys(&["light"])?.required("light", number)?;
            }
            Self::Voltage { mv } | Self::Colour { mv } => {
                *mv = keys(&["mv"])?.required("mv", whole(0..=u16::MAX.into()))?;
            }
            Self::Ultrasonic { cm } => *cm = keys(&["cm"])?.required("cm", number)?,
            Self::Trail { white } => *white = keys(&["white"])?.required("white", truth)?,
        }
        Ok(sensor)
    }

    pub(super) fn check(&self) -> Checked {
        let checked = match *self {
            Self::Ntc { celsius } => in_range("celsius", celsius, CELSIUS_MIN..=CELSIUS_MAX),
            Self::PhotoTransistor { light } => in_range("light", light, 0.0..=1.0),
            Self::Ultrasonic { cm } => not_negative("cm", cm),
            Self::Switch { .. }
            | Self::Button { .. }
            | Self::Resistor { .. }
            | Self::Voltage { .. }
            | Self::Colour { .. }
            | Self::Trail { .. } => Ok(()),
        };
        at(self.kind(), checked)
    }

    /// Whether it is pressed, for a switch or button.
    pub(super) fn pressed_mut(&mut self) -> Option<&mut bool> {
        if let Self::Switch { pressed, .. } | Self::Button { pressed, .. } = self {
            return Some(pressed);
        }
        None
    }

    pub(super) fn is_pressable(&self) -> bool {
        matches!(self, Self::Switch { .. } | Self::Button { .. })
    }

    /// Whether a slide moves it that names its input with this key.
    pub(super) fn is_moved_as(&self, key: &str) -> bool {
        if key == SEEN_BY {
            matches!(self, Self::Ultrasonic { .. })
        } else {
            self.is_pressable()
        }
    }

    /// What it gives to its input.
    pub(super) fn signal(&self) -> Signal {
        match *self {
            Self::Switch { contact, pressed } | Self::Button { contact, pressed } => {
                let closed = pressed == (contact == Contact::NormallyOpen);
                Signal::Ohms(if closed { 0.0 } else { f64::INFINITY })
            }
            Self::Resistor { ohms } => Signal::Ohms(f64::from(ohms)),
            Self::Ntc { celsius } => Signal::Ohms(ntc_ohms(celsius)),
            Self::PhotoTransistor { light } => {
                let dark = 1.0 / PHOTO_DARK;
                let bright = 1.0 / PHOTO_BRIGHT;
                Signal::Ohms(1.0 / (dark + light.clamp(0.0, 1.0) * (bright - dark)))
            }
            Self::Voltage { mv } | Self::Colour { mv } => Signal::Millivolts(f64::from(mv)),
            Self::Ultrasonic { cm } => Signal::Echo(cm),
            Self::Trail { white } => {
                Signal::Millivolts(if white { TRAIL_WHITE } else { TRAIL_BLACK })
            }
        }
    }
}

fn ntc_ohms(celsius: f64) -> f64 {
    NTC_OHMS * (NTC_B * (1.0 / (celsius + ICE) - 1.0 / (25.0 + ICE))).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_sensor_takes_its_whole_range() {
        for mut sensor in Sensor::KINDS {
            let SensorValue { min, max, .. } = sensor.value();
            for value in [min, max] {
                sensor.set_value(value);
                assert_eq!(sensor.value().value, value, "{sensor:?}");
                sensor.check().unwrap();
            }
        }
    }
}
