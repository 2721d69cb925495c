//! Texts.

use std::cmp::Ordering;
use std::ffi::{c_char, c_int, CStr};

use crate::ffi::{caught, guarded, text_of};
use crate::sentences;

/// Compares as if all letters were small. Of the result only the sign counts, as in the C library.
fn compare(one: &[u8], other: &[u8]) -> c_int {
    match one.to_ascii_lowercase().cmp(&other.to_ascii_lowercase()) {
        Ordering::Less => -1,
        Ordering::Equal => 0,
        Ordering::Greater => 1,
    }
}

/// What Windows answers when there is no text.
const NO_TEXT: c_int = c_int::MAX;

/// # Safety
///
/// `text` is null or points to a text that ends with 0 or has `length` bytes, and does not change during the
/// call.
unsafe fn bytes<'a>(text: *const c_char, length: usize) -> Option<&'a [u8]> {
    if text.is_null() {
        return None;
    }
    if length == usize::MAX {
        // SAFETY: as the caller promises.
        return Some(unsafe { CStr::from_ptr(text) }.to_bytes());
    }
    // SAFETY: no byte behind the end of the text is read.
    let end = (0..length).take_while(|&at| unsafe { *text.add(at) } != 0).count();
    // SAFETY: as the caller promises.
    Some(unsafe { std::slice::from_raw_parts(text.cast(), end) })
}

/// Compares two texts, with small and capital letters as the same.
///
/// # Safety
///
/// Both are null or texts that end with 0 and do not change during the call.
#[no_mangle]
pub unsafe extern "C" fn _stricmp(one: *const c_char, other: *const c_char) -> c_int {
    // SAFETY: as the caller promises.
    unsafe { _strnicmp(one, other, usize::MAX) }
}

/// As [`_stricmp`].
///
/// # Safety
///
/// As for [`_stricmp`].
#[no_mangle]
pub unsafe extern "C" fn stricmp(one: *const c_char, other: *const c_char) -> c_int {
    // SAFETY: as the caller promises.
    unsafe { _strnicmp(one, other, usize::MAX) }
}

/// Compares the first `length` characters of two texts.
///
/// # Safety
///
/// Both are null or texts that end with 0 or have `length` characters, and do not change during the call.
#[no_mangle]
pub unsafe extern "C" fn _strnicmp(
    one: *const c_char,
    other: *const c_char,
    length: usize,
) -> c_int {
    caught(NO_TEXT, || {
        // SAFETY: as the caller promises.
        match unsafe { (bytes(one, length), bytes(other, length)) } {
            (Some(one), Some(other)) => compare(one, other),
            _ => NO_TEXT,
        }
    })
}

/// As [`_strnicmp`].
///
/// # Safety
///
/// As for [`_strnicmp`].
#[no_mangle]
pub unsafe extern "C" fn strnicmp(
    one: *const c_char,
    other: *const c_char,
    length: usize,
) -> c_int {
    // SAFETY: as the caller promises.
    unsafe { _strnicmp(one, other, length) }
}

/// Changes each letter of a text, and returns the text.
///
/// # Safety
///
/// `text` is null or a text that ends with 0, which this call alone uses.
unsafe fn change_letters(text: *mut c_char, change: fn(&mut u8)) -> *mut c_char {
    if !text.is_null() {
        // SAFETY: as the caller promises.
        let letters = unsafe {
            let length = CStr::from_ptr(text).to_bytes().len();
            std::slice::from_raw_parts_mut(text.cast::<u8>(), length)
        };
        letters.iter_mut().for_each(change);
    }
    text
}

/// Makes all letters small.
///
/// # Safety
///
/// `text` is null or a text that ends with 0, which this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn _strlwr(text: *mut c_char) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { change_letters(text, u8::make_ascii_lowercase) }
}

/// As [`_strlwr`].
///
/// # Safety
///
/// As for [`_strlwr`].
#[no_mangle]
pub unsafe extern "C" fn strlwr(text: *mut c_char) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { _strlwr(text) }
}

/// Makes all letters capital.
///
/// # Safety
///
/// As for [`_strlwr`].
#[no_mangle]
pub unsafe extern "C" fn _strupr(text: *mut c_char) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { change_letters(text, u8::make_ascii_uppercase) }
}

/// As [`_strupr`].
///
/// # Safety
///
/// As for [`_strlwr`].
#[no_mangle]
pub unsafe extern "C" fn strupr(text: *mut c_char) -> *mut c_char {
    // SAFETY: as the caller promises.
    unsafe { _strupr(text) }
}

/// Writes a text to the error output.
///
/// # Safety
///
/// `text` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn OutputDebugStringA(text: *const c_char) {
    guarded((), || {
        // SAFETY: as the caller promises.
        if let Some(text) = unsafe { text_of(text) } {
            sentences::write(&text);
        }
    });
}

/// A text of wide characters.
///
/// # Safety
///
/// `text` is null or a text that ends with 0 and does not change during the call.
pub(super) unsafe fn wide_text_of(text: *const libc::wchar_t) -> Option<String> {
    if text.is_null() {
        return None;
    }
    // SAFETY: no character behind the end of the text is read.
    let characters = (0..).map(|at| unsafe { *text.add(at) }).take_while(|&one| one != 0);
    let character = |one| char::from_u32(one as u32).unwrap_or(char::REPLACEMENT_CHARACTER);
    Some(characters.map(character).collect())
}

/// As [`OutputDebugStringA`].
///
/// # Safety
///
/// As for [`OutputDebugStringA`].
#[no_mangle]
pub unsafe extern "C" fn OutputDebugStringW(text: *const libc::wchar_t) {
    guarded((), || {
        // SAFETY: as the caller promises.
        if let Some(text) = unsafe { wide_text_of(text) } {
            sentences::write(&text);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_compare_without_regard_to_capitals() {
        let compare = |one: &CStr, other: &CStr, length| {
            // SAFETY: both are texts.
            unsafe { _strnicmp(one.as_ptr(), other.as_ptr(), length) }
        };
        assert_eq!(compare(c"Com4", c"cOM4", usize::MAX), 0);
        assert_eq!(compare(c"COM4", c"COM5", usize::MAX), -1);
        assert_eq!(compare(c"COM4", c"COM5", 3), 0);
        assert_eq!(compare(c"COM", c"CO", 3), 1);
        // SAFETY: no text is given.
        assert_eq!(unsafe { _stricmp(std::ptr::null(), c"".as_ptr()) }, NO_TEXT);
    }
}
