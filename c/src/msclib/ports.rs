//! The list of ports.

use std::ffi::c_int;

use parking_lot::Mutex;

use super::arguments::TextOut;
use crate::errors::{FTLIB_ERR_FAILED, FTLIB_ERR_INVALID_PARAM};
use crate::ffi::guarded;
use crate::ports::{Ports, Selection};

/// What the last `GetAvailableComPorts` has listed; `None` before the first one.
static LISTED: Mutex<Option<Vec<String>>> = Mutex::new(None);

/// Lists the ports: all (0), USB only (1), Bluetooth only (2). Returns how many there are, within about a
/// second.
#[no_mangle]
pub(crate) extern "C" fn GetAvailableComPorts(selection: c_int) -> u32 {
    guarded(0, || {
        let selection = match selection {
            0 => Selection::All,
            1 => Selection::Usb,
            2 => Selection::Bluetooth,
            _ => return 0,
        };
        // Not under the lock, since the search takes a while.
        let ports = Ports::configured().list(selection);
        let count = ports.len() as u32;
        *LISTED.lock() = Some(ports);
        count
    })
}

/// The text of a port, by its index from 0 in the last list: `COM1 (ROBO TXT, USB)`. Returns the index, or
/// `FTLIB_ERR_INVALID_PARAM`.
#[no_mangle]
pub(crate) extern "C" fn EnumComPorts(index: u32, text: TextOut, size: u32) -> u32 {
    guarded(FTLIB_ERR_FAILED, || {
        if !text.has_room(size) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        if LISTED.lock().is_none() {
            GetAvailableComPorts(0);
        }
        // Not under the lock, because a wrong pointer calls the program's handler, which may call this again.
        let port = LISTED.lock().as_ref().and_then(|ports| ports.get(index as usize).cloned());
        text.put(port.as_deref().unwrap_or_default(), size);
        port.map_or(FTLIB_ERR_INVALID_PARAM, |_| index)
    })
}
