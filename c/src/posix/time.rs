//! Time.

use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use crate::ffi::caught;

const TRUE: i32 = 1;
const FALSE: i32 = 0;

/// Since the first call.
fn elapsed() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

/// Waits.
#[no_mangle]
pub extern "C" fn Sleep(milliseconds: u32) {
    caught((), || thread::sleep(Duration::from_millis(milliseconds.into())));
}

/// Milliseconds, which begin anew after 49 days.
#[no_mangle]
pub extern "C" fn GetTickCount() -> u32 {
    caught(0, || elapsed().as_millis() as u32)
}

/// Milliseconds.
#[no_mangle]
pub extern "C" fn GetTickCount64() -> u64 {
    caught(0, || elapsed().as_millis() as u64)
}

/// # Safety
///
/// `to` is null or points to an integer that this call alone uses.
unsafe fn give(to: *mut i64, value: i64) -> i32 {
    if to.is_null() {
        return FALSE;
    }
    // SAFETY: as the caller promises. A program may cast what is not aligned.
    unsafe { to.write_unaligned(value) };
    TRUE
}

/// Nanoseconds.
///
/// # Safety
///
/// `count` is null or points to an integer that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn QueryPerformanceCounter(count: *mut i64) -> i32 {
    // SAFETY: as the caller promises.
    caught(FALSE, || unsafe { give(count, elapsed().as_nanos() as i64) })
}

/// How many counts a second has.
///
/// # Safety
///
/// `per_second` is null or points to an integer that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn QueryPerformanceFrequency(per_second: *mut i64) -> i32 {
    // SAFETY: as the caller promises.
    caught(FALSE, || unsafe { give(per_second, 1_000_000_000) })
}
