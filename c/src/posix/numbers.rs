//! Numbers as texts.

use std::ffi::{c_char, c_int, c_long, c_ulong};
use std::ptr;

use crate::ffi::{caught, copy_text};

/// More than any number has digits, with its sign and the 0 at the end: programs must have room for so many.
const LONGEST: usize = 66;

/// The digits of a number; `None` when there are none with this base.
fn digits(value: impl Into<u64>, is_negative: bool, base: c_int) -> Option<String> {
    let base = u32::try_from(base).ok().filter(|base| (2..=36).contains(base))?;
    let mut value = value.into();
    let mut backwards = Vec::new();
    loop {
        let digit = (value % u64::from(base)) as u32;
        backwards.extend(char::from_digit(digit, base));
        value /= u64::from(base);
        if value == 0 {
            break;
        }
    }
    backwards.extend(is_negative.then_some('-'));
    Some(backwards.into_iter().rev().collect())
}

/// A number with a sign: only with the base 10 it is shown. Numbers have 32 bits on Windows, so negative ones that fit
/// have them here, too.
fn signed(value: impl Into<i64>, base: c_int) -> Option<String> {
    let value = value.into();
    match (base, i32::try_from(value)) {
        (10, _) => digits(value.unsigned_abs(), value < 0, base),
        (_, Ok(short)) => digits(short as u32, false, base),
        (_, Err(_)) => digits(value as u64, false, base),
    }
}

/// Writes a text, and returns where; null when there is no text or no place.
///
/// # Safety
///
/// `to` is null or has room for the text, which this call alone uses.
unsafe fn give(text: Option<String>, to: *mut c_char) -> *mut c_char {
    let Some(text) = text.filter(|_| !to.is_null()) else { return ptr::null_mut() };
    // SAFETY: as the caller promises; the text is not cut.
    unsafe { copy_text(&text, to, LONGEST) };
    to
}

/// Writes a number.
///
/// # Safety
///
/// `to` is null or has room for all digits, a sign and a 0, which this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn _itoa(value: c_int, to: *mut c_char, base: c_int) -> *mut c_char {
    // SAFETY: as the caller promises.
    caught(ptr::null_mut(), || unsafe { give(signed(value, base), to) })
}

/// As [`_itoa`].
///
/// # Safety
///
/// As for [`_itoa`].
#[no_mangle]
pub unsafe extern "C" fn itoa(value: c_int, to: *mut c_char, base: c_int) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { _itoa(value, to, base) }
}

/// As [`_itoa`].
///
/// # Safety
///
/// As for [`_itoa`].
#[no_mangle]
pub unsafe extern "C" fn _ltoa(value: c_long, to: *mut c_char, base: c_int) -> *mut c_char {
    // SAFETY: as the caller promises.
    caught(ptr::null_mut(), || unsafe { give(signed(value, base), to) })
}

/// As [`_itoa`].
///
/// # Safety
///
/// As for [`_itoa`].
#[no_mangle]
pub unsafe extern "C" fn ltoa(value: c_long, to: *mut c_char, base: c_int) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { _ltoa(value, to, base) }
}

/// As [`_itoa`].
///
/// # Safety
///
/// As for [`_itoa`].
#[no_mangle]
pub unsafe extern "C" fn _ultoa(value: c_ulong, to: *mut c_char, base: c_int) -> *mut c_char {
    // SAFETY: as the caller promises.
    caught(ptr::null_mut(), || unsafe { give(digits(value, false, base), to) })
}

/// As [`_itoa`].
///
/// # Safety
///
/// As for [`_itoa`].
#[no_mangle]
pub unsafe extern "C" fn ultoa(value: c_ulong, to: *mut c_char, base: c_int) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { _ultoa(value, to, base) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_of_windows() {
        let cases =
            [(0, 10, "0"), (-12, 10, "-12"), (255, 16, "ff"), (-1, 16, "ffffffff"), (5, 2, "101")];
        for (value, base, text) in cases {
            assert_eq!(signed(value, base).as_deref(), Some(text));
        }
        assert_eq!(signed(i64::MIN, 10).as_deref(), Some("-9223372036854775808"));
        assert_eq!([0, 1, 37, -10].map(|base| signed(1, base)), [None, None, None, None]);
    }
}
