//! The 36 functions of `TA.hook_table`.

use std::ffi::{c_char, c_void};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use super::{peripherals, strings, system};
use crate::ffi::guarded;
use crate::memory::{HookTable, Ta};

/// The most characters of a message.
const MESSAGE_MAX: usize = 98;

/// All hooks, in the order of the table.
pub(super) fn table() -> HookTable {
    macro_rules! table {
        ($($hook:expr),+ $(,)?) => { HookTable([$($hook as *const c_void),+]) };
    }
    table![
        is_run_allowed,
        get_system_time,
        display_msg,
        is_display_being_refreshed,
        peripherals::bt_connect,
        peripherals::bt_disconnect,
        peripherals::bt_send,
        peripherals::bt_start_receive,
        peripherals::bt_stop_receive,
        peripherals::bt_start_listen,
        peripherals::bt_stop_listen,
        bt_addr_to_str,
        peripherals::i2c_read,
        peripherals::i2c_write,
        strings::SPRINTF,
        strings::memcmp,
        strings::memcpy,
        strings::memcpy, // memmove
        strings::memset,
        strings::strcat,
        strings::strncat,
        strings::strchr,
        strings::strrchr,
        strings::strcmp,
        strings::strncmp,
        strings::stricmp,
        strings::strnicmp,
        strings::strcpy,
        strings::strncpy,
        strings::strlen,
        strings::strstr,
        strings::strtok,
        strings::strupr,
        strings::strlwr,
        strings::atoi,
        get_ext_bt_dev_addr,
    ]
}

/// `IsRunAllowed`: a program that is asked to end sees it here first.
extern "C" fn is_run_allowed() -> u32 {
    u32::from(system::stop_reason().is_none())
}

/// `GetSystemTime`, in a unit of `enum TimerUnit`.
extern "C" fn get_system_time(unit: u32) -> u32 {
    in_unit(since_power_on(), unit)
}

fn in_unit(time: Duration, unit: u32) -> u32 {
    match unit {
        2 => time.as_secs() as u32,
        3 => time.as_millis() as u32,
        4 => time.as_micros() as u32,
        _ => 0,
    }
}

/// The time since this machine was switched on, so it differs from start to start as on the TX, and
/// programs take a first random number from it.
fn since_power_on() -> Duration {
    #[cfg(unix)]
    {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the place for the time is this function's.
        if unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) } == 0 {
            return Duration::new(time.tv_sec as u64, time.tv_nsec as u32);
        }
    }
    static FIRST: OnceLock<Instant> = OnceLock::new();
    FIRST.get_or_init(Instant::now).elapsed()
}

/// `DisplayMsg`.
///
/// # Safety
///
/// `message` is null or points to a text that ends with 0.
unsafe extern "C" fn display_msg(area: *mut Ta, message: *mut c_char) {
    guarded((), || {
        let Some(system) = system::current() else { return };
        // SAFETY: as the caller promises.
        let text = unsafe { text_of_display(message) };
        system.display.show_message(system.index_of(area), text);
    });
}

/// The text of a message; `None` for a null pointer. Bytes that are not UTF-8 are those of Latin-1, which the
/// TX showed.
///
/// # Safety
///
/// `message` is null or points to a text that ends with 0.
unsafe fn text_of_display(message: *const c_char) -> Option<String> {
    if message.is_null() {
        return None;
    }
    // SAFETY: as the caller promises.
    let bytes = unsafe { std::ffi::CStr::from_ptr(message) }.to_bytes();
    Some(decode(bytes))
}

/// A message's characters.
pub(super) fn decode(bytes: &[u8]) -> String {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().copied().map(char::from).collect(),
    };
    // What moves a terminal's cursor is not text.
    text.chars().filter(|c| *c == '\n' || !c.is_control()).take(MESSAGE_MAX).collect()
}

/// `IsDisplayBeingRefreshed`.
extern "C" fn is_display_being_refreshed(_area: *mut Ta) -> u32 {
    guarded(0, || u32::from(system::current().is_some_and(|system| system.display.is_busy())))
}

/// `BtAddrToStr`: `xx:xx:xx:xx:xx:xx`, with a 0 behind it. Null pointers give an empty text, or none.
///
/// # Safety
///
/// `address` is null or points to 6 bytes, `text` is null or to 18.
unsafe extern "C" fn bt_addr_to_str(address: *const u8, text: *mut c_char) -> *mut c_char {
    let written = if address.is_null() {
        String::new()
    } else {
        // SAFETY: as the caller promises.
        let bytes = unsafe { address.cast::<[u8; 6]>().read() };
        bytes.map(|byte| format!("{byte:02x}")).join(":")
    };
    // SAFETY: as the caller promises; that is 17 characters and a 0.
    unsafe { crate::ffi::copy_text(&written, text, 18) };
    text
}

/// `GetExtBtDevAddr`: 00:00:00:00:00:00, because no device is registered.
///
/// # Safety
///
/// `address` is null or points to 6 bytes that the program gives to this call alone.
unsafe extern "C" fn get_ext_bt_dev_addr(address: *mut u8) {
    if !address.is_null() {
        // SAFETY: as the caller promises.
        unsafe { address.cast::<[u8; 6]>().write([0; 6]) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_hook_is_missing() {
        assert!(table().0.iter().all(|hook| !hook.is_null()));
    }

    #[test]
    fn system_time_has_units() {
        let time = Duration::from_millis(5_000_000_123);
        assert_eq!(
            [2, 3, 4, 0].map(|unit| in_unit(time, unit)),
            [5_000_000, 705_032_827, 658_190_456, 0]
        );
        let before = get_system_time(4);
        assert!(get_system_time(4).wrapping_sub(before) < u32::MAX / 2, "it goes on");
    }

    #[test]
    fn a_bluetooth_address_is_written_with_colons() {
        let mut text = [0x7F; 18];
        let address = [0x00, 0x13, 0x7B, 0x52, 0xB1, 0xFA];
        // SAFETY: 6 bytes and 18 bytes.
        unsafe { bt_addr_to_str(address.as_ptr(), text.as_mut_ptr()) };
        assert_eq!(text.map(|c| c as u8), *b"00:13:7b:52:b1:fa\0");
        // SAFETY: null pointers are allowed.
        assert!(unsafe { bt_addr_to_str(std::ptr::null(), std::ptr::null_mut()) }.is_null());
    }

    #[test]
    fn no_bluetooth_device_is_registered() {
        let mut address = [0x7F; 7];
        // SAFETY: there are 6 bytes; none is given to the second call.
        unsafe {
            get_ext_bt_dev_addr(address.as_mut_ptr());
            get_ext_bt_dev_addr(std::ptr::null_mut());
        }
        assert_eq!(address, [0, 0, 0, 0, 0, 0, 0x7F]);
    }

    #[test]
    fn a_message_is_text_of_any_kind_without_controls() {
        assert_eq!(decode(b"5 \xB0C\r\x1B[2J\nok"), "5 °C[2J\nok");
        assert_eq!(decode("5 °C".as_bytes()), "5 °C");
        assert_eq!(decode(&[b'a'; 200]).len(), MESSAGE_MAX);
    }
}
