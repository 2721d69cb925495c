//! What an input reports of a sensor.

use ft_transfer_area::transfer_area::{
    InputMode, UniConfig, NO_ULTRASONIC, R2_MAX, R2_MIN, R2_OVR, R_MAX, R_MIN, R_OVR,
    ULTRASONIC_MAX, ULTRASONIC_MIN, ULTRASONIC_OVR, U_MAX, U_OVR,
};

use super::sensor::{Sensor, Signal};

/// A digital resistance input reports 1 below this part of its range: 2500 Ω or 7500 Ω.
const CLOSED_BELOW: f64 = 0.5;
/// A digital voltage input reports 1 from this many mV on.
const HIGH_FROM: f64 = 5000.0;

/// A new mode needs an arm in `report`.
const _: () = assert!(InputMode::ALL.len() == 4);

/// What an input with this configuration reports for what is plugged in.
///
/// A distance is never digital, and an unknown mode measures a voltage: so the maker's library asks the board.
pub(super) fn report(sensor: Option<&Sensor>, config: UniConfig) -> i16 {
    let digital = config.digital != 0;
    match config.mode {
        mode if mode == InputMode::Voltage as u8 => voltage(sensor, digital),
        mode if mode == InputMode::Resistance as u8 => {
            resistance(sensor, digital, R_MIN, R_MAX, R_OVR)
        }
        mode if mode == InputMode::Resistance15k as u8 => {
            resistance(sensor, digital, R2_MIN, R2_MAX, R2_OVR)
        }
        mode if mode == InputMode::Ultrasonic as u8 => distance(sensor),
        _ => voltage(sensor, false),
    }
}

fn voltage(sensor: Option<&Sensor>, digital: bool) -> i16 {
    let mv = match sensor.map(Sensor::signal) {
        Some(Signal::Millivolts(mv)) => mv,
        Some(Signal::Ohms(_) | Signal::Echo(_)) | None => 0.0,
    };
    if digital {
        return i16::from(mv >= HIGH_FROM);
    }
    within(mv, 0, U_MAX, U_OVR)
}

fn resistance(sensor: Option<&Sensor>, digital: bool, least: i16, most: i16, over: i16) -> i16 {
    let ohms = match sensor.map(Sensor::signal) {
        Some(Signal::Ohms(ohms)) => ohms,
        Some(Signal::Millivolts(_) | Signal::Echo(_)) | None => f64::INFINITY,
    };
    if digital {
        return i16::from(ohms < CLOSED_BELOW * f64::from(over));
    }
    within(ohms, least, most, over)
}

fn distance(sensor: Option<&Sensor>) -> i16 {
    match sensor.map(Sensor::signal) {
        Some(Signal::Echo(cm)) => within(cm, ULTRASONIC_MIN, ULTRASONIC_MAX, ULTRASONIC_OVR),
        Some(Signal::Ohms(_) | Signal::Millivolts(_)) | None => NO_ULTRASONIC,
    }
}

/// The nearest whole number, at least `least`, and `over` when it is more than `most`.
fn within(value: f64, least: i16, most: i16, over: i16) -> i16 {
    let value = value.round();
    if value > f64::from(most) {
        over
    } else {
        (value as i16).max(least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Contact;

    const R: UniConfig = UniConfig::analog(InputMode::Resistance);
    const R2: UniConfig = UniConfig::analog(InputMode::Resistance15k);
    const U: UniConfig = UniConfig::analog(InputMode::Voltage);
    const CM: UniConfig = UniConfig::analog(InputMode::Ultrasonic);

    fn digital(config: UniConfig) -> UniConfig {
        UniConfig { digital: 1, ..config }
    }

    #[test]
    fn resistances_keep_to_both_ranges() {
        for (ohms, small, large) in [
            (0, 10, 30),
            (10, 10, 30),
            (29, 29, 30),
            (4999, 4999, 4999),
            (5000, 5000, 5000),
            (5001, 5000, 5001),
            (14_999, 5000, 14_999),
            (15_000, 5000, 15_000),
            (u32::MAX, 5000, 15_000),
        ] {
            let sensor = Sensor::Resistor { ohms };
            assert_eq!(report(Some(&sensor), R), small, "{ohms} Ω");
            assert_eq!(report(Some(&sensor), R2), large, "{ohms} Ω");
        }
    }

    #[test]
    fn voltages_and_distances_keep_to_their_ranges() {
        for (mv, value) in [(0, 0), (9999, 9999), (10_000, 10_000), (u16::MAX, 10_000)] {
            assert_eq!(report(Some(&Sensor::Voltage { mv }), U), value);
            assert_eq!(report(Some(&Sensor::Colour { mv }), U), value);
        }
        for (cm, value) in [(0.0, 2), (2.4, 2), (2.5, 3), (1023.4, 1023), (1024.0, 1024)] {
            assert_eq!(report(Some(&Sensor::Ultrasonic { cm }), CM), value, "{cm} cm");
        }
        assert_eq!(report(Some(&Sensor::Ultrasonic { cm: f64::INFINITY }), CM), 1024);
    }

    #[test]
    fn an_empty_input_is_reported() {
        assert_eq!([R, R2, U, CM].map(|config| report(None, config)), [5000, 15_000, 0, 4096]);
        assert_eq!([R, R2, U].map(|config| report(None, digital(config))), [0; 3]);
    }

    #[test]
    fn a_sensor_in_the_mode_of_another_counts_as_none() {
        let voltage = Sensor::Voltage { mv: 4500 };
        assert_eq!([R, R2, CM].map(|config| report(Some(&voltage), config)), [5000, 15_000, 4096]);
        let ultrasonic = Sensor::Ultrasonic { cm: 50.0 };
        assert_eq!([R, R2, U].map(|config| report(Some(&ultrasonic), config)), [5000, 15_000, 0]);
        assert_eq!([U, CM].map(|config| report(Some(&Sensor::SWITCH), config)), [0, 4096]);
    }

    #[test]
    fn a_switch_closes_or_opens_when_it_is_pressed() {
        for (contact, pressed, closed) in [
            (Contact::NormallyOpen, false, false),
            (Contact::NormallyOpen, true, true),
            (Contact::NormallyClosed, false, true),
            (Contact::NormallyClosed, true, false),
        ] {
            for sensor in [Sensor::Switch { contact, pressed }, Sensor::Button { contact, pressed }]
            {
                assert_eq!(report(Some(&sensor), digital(R)), i16::from(closed));
                assert_eq!(report(Some(&sensor), R), if closed { 10 } else { 5000 });
            }
        }
    }

    #[test]
    fn digital_inputs_have_their_thresholds() {
        for (ohms, small, large) in [(2499, 1, 1), (2500, 0, 1), (7499, 0, 1), (7500, 0, 0)] {
            let sensor = Sensor::Resistor { ohms };
            assert_eq!(report(Some(&sensor), digital(R)), small, "{ohms} Ω");
            assert_eq!(report(Some(&sensor), digital(R2)), large, "{ohms} Ω");
        }
        for (mv, value) in [(4999, 0), (5000, 1)] {
            assert_eq!(report(Some(&Sensor::Voltage { mv }), digital(U)), value);
        }
        for (white, value) in [(true, 1), (false, 0)] {
            assert_eq!(report(Some(&Sensor::Trail { white }), digital(U)), value);
        }
    }

    #[test]
    fn a_flag_without_a_meaning_in_a_mode_has_no_effect() {
        for (sensor, value) in [(Some(Sensor::Ultrasonic { cm: 40.0 }), 40), (None, 4096)] {
            let values = [CM, digital(CM)].map(|config| report(sensor.as_ref(), config));
            assert_eq!(values, [value; 2], "{sensor:?}");
        }
        let unknown = UniConfig { mode: 9, ..U };
        for config in [unknown, digital(unknown)] {
            assert_eq!(report(Some(&Sensor::Voltage { mv: 4500 }), config), 4500);
        }
    }

    #[test]
    fn an_ntc_has_less_resistance_when_it_is_warmer() {
        for (celsius, ohms) in [(0.0, 4966), (25.0, 1500), (50.0, 545), (100.0, 108)] {
            assert_eq!(report(Some(&Sensor::Ntc { celsius }), R), ohms, "{celsius} °C");
        }
        assert_eq!(report(Some(&Sensor::Ntc { celsius: -30.0 }), R), 5000);
    }

    #[test]
    fn a_photo_transistor_lets_more_through_when_it_is_brighter() {
        for (light, ohms) in [(0.0, 15_000), (0.01, 6689), (0.5, 199), (1.0, 100)] {
            assert_eq!(report(Some(&Sensor::PhotoTransistor { light }), R2), ohms, "{light}");
        }
    }
}
