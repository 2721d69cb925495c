//! What every call from C needs.

use std::ffi::{c_char, CStr};
use std::mem;
use std::panic::{catch_unwind, AssertUnwindSafe};

use crate::inside;
use crate::process;

/// Runs a call from C, which no signal handler interrupts: a handler may make such calls itself. Otherwise as
/// [`caught`].
pub(crate) fn guarded<R>(otherwise: R, call: impl FnOnce() -> R) -> R {
    let _inside = inside::enter();
    caught(otherwise, || {
        inside::prepare_to_wait();
        call()
    })
}

/// Runs a call from C. A panic does not cross into C: it is logged, and the program gets `otherwise`. So does a
/// child process after `fork`: there nobody would ever open the locks that a call waits for.
pub(crate) fn caught<R>(otherwise: R, call: impl FnOnce() -> R) -> R {
    let _uncancelled = inside::uncancelled();
    if process::is_forked() {
        process::tell_forked();
        // What it has taken is the parent's.
        mem::forget(call);
        return otherwise;
    }
    // What a panic leaves half done is behind locks that stay usable, as in the library below.
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|_| {
        log::error!("a call from C panicked, which is a mistake of this library");
        otherwise
    })
}

/// A text of the program's; what is not UTF-8 in it is replaced. `None` for a null pointer.
///
/// # Safety
///
/// `text` is null or points to a text that ends with 0 and does not change during the call.
pub(crate) unsafe fn text_of(text: *const c_char) -> Option<String> {
    if text.is_null() {
        return None;
    }
    // SAFETY: as the caller promises.
    let text = unsafe { CStr::from_ptr(text) };
    Some(text.to_string_lossy().into_owned())
}

/// Copies a text to the program, cut to what fits, with a 0 behind it. Returns its length there; 0 also
/// when there is no place for it.
///
/// # Safety
///
/// `to` is null or has `size` bytes that the program gives to this call alone.
pub(crate) unsafe fn copy_text(text: &str, to: *mut c_char, size: usize) -> usize {
    if to.is_null() || size == 0 {
        return 0;
    }
    let length = text.len().min(size - 1);
    // SAFETY: `length + 1` bytes lie within those that the caller promises.
    unsafe {
        to.cast::<u8>().copy_from_nonoverlapping(text.as_ptr(), length);
        *to.add(length) = 0;
    }
    length
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_to_what_fits_and_needs_a_place() {
        let mut place = [1; 4];
        // SAFETY: `place` has four bytes.
        let length = unsafe { copy_text("COM10", place.as_mut_ptr(), place.len()) };
        assert_eq!((length, place.map(|byte| byte as u8)), (3, *b"COM\0"));
        // SAFETY: no place is given.
        let nowhere = unsafe { copy_text("COM10", std::ptr::null_mut(), 9) };
        // SAFETY: none of its bytes is given.
        let empty = unsafe { copy_text("COM10", place.as_mut_ptr(), 0) };
        assert_eq!((nowhere, empty), (0, 0));
    }

    #[test]
    fn a_panic_becomes_the_answer_for_it() {
        assert_eq!(guarded(7, || panic!("as a test")), 7);
    }
}
