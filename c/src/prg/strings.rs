//! The C library's functions as programs find them among the hooks: lengths have 32 bits, and some of the
//! functions are not in today's C libraries.
//!
//! On the TX there was memory at address 0, so a null pointer went unnoticed there. Here it is an empty text,
//! or nothing to do.

use std::ffi::{c_char, c_int, c_void, CStr};
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether `strtok` has got a text.
static STRTOK_HAS_TEXT: AtomicBool = AtomicBool::new(false);

/// The text at `s`, without its 0.
///
/// # Safety
///
/// `s` is null or points to a text that ends with 0 and does not change while the result is used.
unsafe fn bytes<'a>(s: *const c_char) -> &'a [u8] {
    if s.is_null() {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(s) }.to_bytes()
}

/// Writes a text and its 0, through a pointer that is not null. The text may overlap with its place.
///
/// # Safety
///
/// There is place for the text and its 0 at `to`.
unsafe fn put(to: *mut c_char, text: *const u8, length: usize) {
    // SAFETY: as the caller promises.
    unsafe {
        ptr::copy(text, to.cast(), length);
        *to.add(length) = 0;
    }
}

/// The order of two texts, as C's comparisons return it.
fn order<T: Ord>(a: impl Iterator<Item = T>, b: impl Iterator<Item = T>) -> i32 {
    a.cmp(b) as i32
}

macro_rules! hooks {
    ($($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty $body:block)+) => {$(
        $(#[$doc])*
        ///
        /// # Safety
        ///
        /// As for C's function of this name, but null pointers are allowed.
        pub(super) unsafe extern "C" fn $name($($argument: $type),*) -> $result {
            // SAFETY: as the caller promises.
            unsafe { $body }
        }
    )+};
}

hooks! {
    /// `memcmp`.
    fn memcmp(a: *const c_void, b: *const c_void, n: u32) -> i32 {
        if a.is_null() || b.is_null() {
            return i32::from(b.is_null()) - i32::from(a.is_null());
        }
        libc::memcmp(a, b, n as usize)
    }
    /// `memcpy`; the places may overlap.
    fn memcpy(to: *mut c_void, from: *const c_void, n: u32) -> *mut c_void {
        if !to.is_null() && !from.is_null() {
            ptr::copy(from.cast::<u8>(), to.cast::<u8>(), n as usize);
        }
        to
    }
    /// `memset`.
    fn memset(to: *mut c_void, value: i32, n: u32) -> *mut c_void {
        if !to.is_null() {
            ptr::write_bytes(to.cast::<u8>(), value as u8, n as usize);
        }
        to
    }
    /// `strcat`.
    fn strcat(to: *mut c_char, from: *const c_char) -> *mut c_char {
        if !to.is_null() {
            let from = bytes(from);
            put(to.add(bytes(to).len()), from.as_ptr(), from.len());
        }
        to
    }
    /// `strncat`.
    fn strncat(to: *mut c_char, from: *const c_char, n: u32) -> *mut c_char {
        if !to.is_null() && !from.is_null() {
            let length = libc::strnlen(from, n as usize);
            put(to.add(bytes(to).len()), from.cast(), length);
        }
        to
    }
    /// `strchr`.
    fn strchr(s: *const c_char, c: i32) -> *mut c_char {
        if s.is_null() { ptr::null_mut() } else { libc::strchr(s, c) }
    }
    /// `strrchr`.
    fn strrchr(s: *const c_char, c: i32) -> *mut c_char {
        if s.is_null() { ptr::null_mut() } else { libc::strrchr(s, c) }
    }
    /// `strcmp`.
    fn strcmp(a: *const c_char, b: *const c_char) -> i32 {
        order(bytes(a).iter(), bytes(b).iter())
    }
    /// `strncmp`. The texts need no 0 within the first `n` bytes.
    fn strncmp(a: *const c_char, b: *const c_char, n: u32) -> i32 {
        order(first(a, n).iter(), first(b, n).iter())
    }
    /// `stricmp`: without regard to the case of a to z.
    fn stricmp(a: *const c_char, b: *const c_char) -> i32 {
        order(lower(bytes(a)), lower(bytes(b)))
    }
    /// `strnicmp`.
    fn strnicmp(a: *const c_char, b: *const c_char, n: u32) -> i32 {
        order(lower(first(a, n)), lower(first(b, n)))
    }
    /// `strcpy`.
    fn strcpy(to: *mut c_char, from: *const c_char) -> *mut c_char {
        if !to.is_null() {
            let from = bytes(from);
            put(to, from.as_ptr(), from.len());
        }
        to
    }
    /// `strncpy`: fills the place with zeros; without one when the text does not fit.
    fn strncpy(to: *mut c_char, from: *const c_char, n: u32) -> *mut c_char {
        if !to.is_null() {
            let (from, n) = (first(from, n), n as usize);
            ptr::copy(from.as_ptr(), to.cast(), from.len());
            ptr::write_bytes(to.add(from.len()), 0, n - from.len());
        }
        to
    }
    /// `strlen`.
    fn strlen(s: *const c_char) -> u32 {
        bytes(s).len() as u32
    }
    /// `strstr`.
    fn strstr(s: *const c_char, part: *const c_char) -> *mut c_char {
        match (s.is_null(), part.is_null()) {
            (true, _) => ptr::null_mut(),
            (false, true) => s.cast_mut(),
            (false, false) => libc::strstr(s, part),
        }
    }
    /// `strtok`, with the C library's memory of where it was.
    fn strtok(s: *mut c_char, ends: *const c_char) -> *mut c_char {
        let ends = if ends.is_null() { c"".as_ptr() } else { ends };
        // Without a text before, there is no next word.
        if !STRTOK_HAS_TEXT.fetch_or(!s.is_null(), Ordering::Relaxed) && s.is_null() {
            return ptr::null_mut();
        }
        libc::strtok(s, ends)
    }
    /// `strupr`: a to z become A to Z.
    fn strupr(s: *mut c_char) -> *mut c_char {
        change(s, |byte| byte.to_ascii_uppercase());
        s
    }
    /// `strlwr`: A to Z become a to z.
    fn strlwr(s: *mut c_char) -> *mut c_char {
        change(s, |byte| byte.to_ascii_lowercase());
        s
    }
    /// `atoi`.
    fn atoi(s: *const c_char) -> i32 {
        if s.is_null() { 0 } else { libc::atoi(s) }
    }
}

/// `sprintf` is the C library's: no function of Rust has a variable number of arguments.
pub(super) const SPRINTF: unsafe extern "C" fn(*mut c_char, *const c_char, ...) -> c_int =
    libc::sprintf;

/// The text at `s`, or its first `n` bytes when it is longer.
///
/// # Safety
///
/// `s` is null or points to a text that ends with 0 or has `n` bytes.
unsafe fn first<'a>(s: *const c_char, n: u32) -> &'a [u8] {
    if s.is_null() {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts(s.cast(), libc::strnlen(s, n as usize)) }
}

fn lower(text: &[u8]) -> impl Iterator<Item = u8> + '_ {
    text.iter().map(u8::to_ascii_lowercase)
}

/// Changes each byte of a text where it is.
///
/// # Safety
///
/// `s` is null or points to a text that ends with 0 and may be written.
unsafe fn change(s: *mut c_char, change: impl Fn(u8) -> u8) {
    // SAFETY: as the caller promises; each byte lies before the 0.
    unsafe {
        for index in 0..bytes(s).len() {
            let byte = s.cast::<u8>().add(index);
            *byte = change(*byte);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(s: &[c_char]) -> String {
        // SAFETY: the tests write texts that end with 0.
        unsafe { CStr::from_ptr(s.as_ptr()) }.to_string_lossy().into_owned()
    }

    #[test]
    fn texts_are_copied_cut_and_joined() {
        let mut place = [0x7F; 16];
        let at = place.as_mut_ptr();
        // SAFETY: 16 bytes are enough for all of these.
        unsafe {
            strcpy(at, c"ab".as_ptr());
            strcat(at, c"cd".as_ptr());
            strncat(at, c"efgh".as_ptr(), 2);
            assert_eq!((text(&place), strlen(at)), ("abcdef".to_owned(), 6));
            strupr(at);
            assert_eq!(text(&place), "ABCDEF");
            strlwr(at);
            assert_eq!(text(&place), "abcdef");
            strncpy(at, c"xyz".as_ptr(), 5);
        }
        assert_eq!(place[..6], *b"xyz\0\0f".map(|byte| byte as c_char).as_slice());
    }

    #[test]
    fn comparisons_know_order_case_and_length() {
        let order = |a: &CStr, b: &CStr| {
            // SAFETY: texts that end with 0.
            unsafe {
                [
                    strcmp(a.as_ptr(), b.as_ptr()),
                    stricmp(a.as_ptr(), b.as_ptr()),
                    strncmp(a.as_ptr(), b.as_ptr(), 2),
                    strnicmp(a.as_ptr(), b.as_ptr(), 2),
                ]
            }
        };
        assert_eq!(order(c"abc", c"abd"), [-1, -1, 0, 0]);
        assert_eq!(order(c"ABC", c"abc"), [-1, 0, -1, 0]);
        assert_eq!(order(c"abc", c"ab"), [1, 1, 0, 0]);
    }

    #[test]
    fn a_null_pointer_is_an_empty_text() {
        let (null, nowhere) = (ptr::null(), ptr::null_mut());
        // SAFETY: null pointers are allowed.
        unsafe {
            assert_eq!((strlen(null), atoi(null), strcmp(null, c"".as_ptr())), (0, 0, 0));
            assert!(strcpy(nowhere, c"a".as_ptr()).is_null());
            assert!(strupr(nowhere).is_null());
            assert!(strstr(null, c"a".as_ptr()).is_null());
            // Nobody calls it before in these tests.
            assert!(strtok(nowhere, c"a".as_ptr()).is_null());
            assert!(memset(ptr::null_mut(), 1, 9).is_null());
            assert!(memcpy(ptr::null_mut(), ptr::null(), 9).is_null());
            assert_eq!(memcmp(ptr::null(), ptr::null(), 9), 0);
        }
    }
}
