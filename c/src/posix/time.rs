//! Time.

use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant, UNIX_EPOCH};

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

/// As [`GetTickCount`].
#[no_mangle]
pub extern "C" fn timeGetTime() -> u32 {
    GetTickCount()
}

/// Changes nothing: the system waits to a millisecond. 0 when that is enough.
#[no_mangle]
pub extern "C" fn timeBeginPeriod(_: u32) -> u32 {
    0
}

/// Changes nothing.
#[no_mangle]
pub extern "C" fn timeEndPeriod(_: u32) -> u32 {
    0
}

/// A date and a time of day. Sunday is the weekday 0.
#[repr(C)]
pub struct SystemTime {
    year: u16,
    month: u16,
    weekday: u16,
    day: u16,
    hour: u16,
    minute: u16,
    second: u16,
    millisecond: u16,
}

type Parts = unsafe extern "C" fn(*const libc::time_t, *mut libc::tm) -> *mut libc::tm;

/// # Safety
///
/// `to` is null or a place that this call alone uses.
unsafe fn give_now(to: *mut SystemTime, parts_of: Parts) {
    if to.is_null() {
        return;
    }
    let now = std::time::SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let seconds = now.as_secs() as libc::time_t;
    // SAFETY: integers and a pointer, for which all bits 0 are valid.
    let mut parts: libc::tm = unsafe { std::mem::zeroed() };
    // SAFETY: both places are this function's; the text of the zone is not used.
    unsafe { parts_of(&raw const seconds, &raw mut parts) };
    let now = SystemTime {
        year: (parts.tm_year + 1900) as u16,
        month: (parts.tm_mon + 1) as u16,
        weekday: parts.tm_wday as u16,
        day: parts.tm_mday as u16,
        hour: parts.tm_hour as u16,
        minute: parts.tm_min as u16,
        second: parts.tm_sec as u16,
        millisecond: now.subsec_millis() as u16,
    };
    // SAFETY: as the caller promises.
    unsafe { to.write_unaligned(now) };
}

/// The time of day here.
///
/// # Safety
///
/// `to` is null or a place that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetLocalTime(to: *mut SystemTime) {
    // SAFETY: as the caller promises.
    caught((), || unsafe { give_now(to, libc::localtime_r) });
}

/// The time of day in the world.
///
/// # Safety
///
/// As for [`GetLocalTime`].
#[no_mangle]
pub unsafe extern "C" fn GetSystemTime(to: *mut SystemTime) {
    // SAFETY: as the caller promises.
    caught((), || unsafe { give_now(to, libc::gmtime_r) });
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
