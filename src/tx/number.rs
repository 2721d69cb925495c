//! Conversion of a C program's numbers to the types of the calls.

use super::{Counter, Direction, Input, InvalidCall, IrDevice, Motor, Output, Sound};
use crate::transfer_area::{CounterMode, InputMode};

/// The variant with this number; all variants, in order, have the numbers from `least` on.
fn variant<T: Copy>(
    what: &'static str,
    given: i64,
    least: i64,
    all: &[T],
) -> Result<T, InvalidCall> {
    let place = usize::try_from(given - least).ok();
    let found = place.and_then(|place| all.get(place)).copied();
    let most = least + all.len() as i64 - 1;
    found.ok_or(InvalidCall::OutOfRange { what, given, least, most })
}

/// Implements `TryFrom` for types whose variants have consecutive numbers: from the integer type that
/// the area or its indices have, and from `i32` for C's `int` and plain numbers.
macro_rules! from_numbers {
    ($($(#[$about:meta])* $type:ty, $($number:ty)|+: $what:literal, $least:expr, $all:expr;)+) => {
        $(from_numbers!(@each [$(#[$about])*] $type, [$($number)+], $what, $least, $all);)+
    };
    (@each $about:tt $type:ty, [$($number:ty)+], $what:literal, $least:expr, $all:expr) => {
        $(from_numbers!(@one $about $type, $number, $what, $least, $all);)+
    };
    (@one [$(#[$about:meta])*] $type:ty, $number:ty, $what:literal, $least:expr, $all:expr) => {
        $(#[$about])*
        ///
        /// # Errors
        ///
        /// [`InvalidCall::OutOfRange`] for any other number.
        impl TryFrom<$number> for $type {
            type Error = InvalidCall;

            fn try_from(number: $number) -> Result<Self, InvalidCall> {
                variant($what, i64::try_from(number).unwrap_or(i64::MAX), $least, &$all)
            }
        }
    };
}

from_numbers! {
    /// 0 is I1, as the C libraries count.
    Input, usize | i32: "input's index", 0, Input::ALL;
    /// 0 is C1, as the C libraries count.
    Counter, usize | i32: "counter's index", 0, Counter::ALL;
    /// 0 is M1, as the C libraries count.
    Motor, usize | i32: "motor's index", 0, Motor::ALL;
    /// 0 is O1, as the C libraries count.
    Output, usize | i32: "output's index", 0, Output::ALL;
    /// −1 is counterclockwise, 0 is halt, 1 is clockwise.
    Direction, i32: "direction", -1, [Direction::Ccw, Direction::Halt, Direction::Cw];
    /// The number that an area holds, FtTxtLib's too: 0 `MODE_U`, 1 `MODE_R`, 3 `MODE_ULTRASONIC`.
    InputMode, u8 | i32: "input's mode", 0, *InputMode::ALL;
    /// The number that an area holds. In the TX library 0 is normal and 1 inverted.
    CounterMode, u8 | i32: "counter's mode", 0, CounterMode::ALL;
    /// The index of the infrared remote in an area.
    IrDevice, usize | i32: "infrared remote's index", 0, IrDevice::ALL;
    /// The number of the sound's file.
    Sound, u16 | i32: "sound's index", 1, *Sound::ALL;
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;
    use std::ops::RangeInclusive;

    use super::*;

    /// Checks that these numbers become the variants in order, and that numbers around them are refused.
    fn check<T, N>(numbers: RangeInclusive<i64>, all: &[T])
    where
        T: TryFrom<N, Error = InvalidCall> + PartialEq + Debug,
        N: TryFrom<i64>,
    {
        for (number, variant) in numbers.clone().zip(all) {
            let Ok(number) = N::try_from(number) else { panic!("{number} does not fit") };
            assert_eq!(T::try_from(number).as_ref(), Ok(variant));
        }
        assert_eq!(numbers.clone().count(), all.len());
        for number in [numbers.start() - 1, numbers.end() + 1, 255, 32_767] {
            if let Ok(wrong) = N::try_from(number) {
                let error = T::try_from(wrong).unwrap_err();
                let (least, most) = (*numbers.start(), *numbers.end());
                assert!(
                    matches!(error, InvalidCall::OutOfRange { given, least: l, most: m, .. }
                        if (given, l, m) == (number, least, most)),
                    "{error:?}"
                );
            }
        }
    }

    #[test]
    fn numbers_outside_their_range_are_refused() {
        check::<Input, usize>(0..=7, &Input::ALL);
        check::<Counter, usize>(0..=3, &Counter::ALL);
        check::<Motor, usize>(0..=3, &Motor::ALL);
        check::<Output, usize>(0..=7, &Output::ALL);
        check::<Motor, i32>(0..=3, &Motor::ALL);
        check::<Direction, i32>(-1..=1, &[Direction::Ccw, Direction::Halt, Direction::Cw]);
        check::<CounterMode, u8>(0..=1, &CounterMode::ALL);
        check::<IrDevice, usize>(0..=4, &IrDevice::ALL);
        check::<Sound, u16>(1..=29, Sound::ALL);
        check::<InputMode, u8>(0..=3, InputMode::ALL);
        assert!(InputMode::ALL.iter().zip(0..).all(|(mode, number)| u8::from(*mode) == number));
        assert_eq!(CounterMode::ALL.map(u8::from), [0, 1]);
        assert!(Motor::try_from(usize::MAX).is_err());
        assert!(Direction::try_from(i32::MIN).is_err());
    }
}
