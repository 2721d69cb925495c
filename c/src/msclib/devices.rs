//! Opening and closing devices, and their transfers.

use std::ffi::c_int;
use std::ptr::null_mut;

use super::arguments::{Handle, Out, TextIn};
use super::library::LIBRARY;
use super::{answer, index, with_device};
use crate::errors::{
    FTLIB_ERR_FAILED, FTLIB_ERR_INVALID_PARAM, FTLIB_ERR_LIB_IS_INITIALIZED,
    FTLIB_ERR_LIB_IS_NOT_INITIALIZED, FTLIB_ERR_SUCCESS, FTLIB_ERR_THREAD_IS_RUNNING,
    FTLIB_ERR_THREAD_NOT_RUNNING, FTLIB_ERR_THREAD_SYNCHRONIZED,
};
use crate::ffi::guarded;
use crate::memory::{Ta, AREAS};
use crate::session::{STATUS_RUN, STATUS_SYNC};
use ft_transfer_area::transfer_area::Status;

/// Starts the library. The first call of a program.
#[no_mangle]
pub(crate) extern "C" fn ftxInitLib() -> u32 {
    answer(|| LIBRARY.initialize())
}

/// Closes all devices, with all motors off, takes all callbacks away and ends the library, which can be
/// started again. From a callback, too.
#[no_mangle]
pub(crate) extern "C" fn ftxCloseLib() -> u32 {
    answer(|| LIBRARY.close())
}

/// Whether the library is initialized, as one of two codes.
#[no_mangle]
pub(crate) extern "C" fn ftxIsLibInit() -> u32 {
    guarded(FTLIB_ERR_FAILED, || match LIBRARY.is_initialized() {
        true => FTLIB_ERR_LIB_IS_INITIALIZED,
        false => FTLIB_ERR_LIB_IS_NOT_INITIALIZED,
    })
}

/// Opens the controller at a COM port or a host, and asks for its name. The baud rate means nothing here.
#[no_mangle]
pub(crate) extern "C" fn ftxOpenComDevice(port: TextIn, _baud: u32, error: Out<u32>) -> Handle {
    open(error, || LIBRARY.open(&port.get()?))
}

/// Opens the controller at `COM` and this number.
#[no_mangle]
pub(crate) extern "C" fn ftxOpenComDeviceNr(number: u32, _baud: u32, error: Out<u32>) -> Handle {
    open(error, || match number {
        0 => Err(FTLIB_ERR_INVALID_PARAM),
        number => LIBRARY.open(&format!("COM{number}")),
    })
}

fn open(error: Out<u32>, open: impl FnOnce() -> Result<Handle, u32>) -> Handle {
    let opened = guarded(Err(FTLIB_ERR_FAILED), open);
    // A program may not want to know the error.
    let _ = error.put(opened.err().unwrap_or(FTLIB_ERR_SUCCESS));
    opened.unwrap_or(null_mut())
}

/// Closes a device, with all motors off. Its areas are gone afterwards.
#[no_mangle]
pub(crate) extern "C" fn ftxCloseDevice(handle: Handle) -> u32 {
    with_device(handle, |device| LIBRARY.close_device(device))
}

/// Closes all devices.
#[no_mangle]
pub(crate) extern "C" fn ftxCloseAllDevices() -> u32 {
    answer(|| {
        LIBRARY.callbacks().ok_or(FTLIB_ERR_LIB_IS_NOT_INITIALIZED)?;
        LIBRARY.close_devices();
        Ok(())
    })
}

/// Begins to exchange the areas. Returns after the first response of the controller.
#[no_mangle]
pub(crate) extern "C" fn ftxStartTransferArea(handle: Handle) -> u32 {
    with_device(handle, |device| LIBRARY.start(device))
}

/// Ends the exchange, with all motors off. The areas stay.
#[no_mangle]
pub(crate) extern "C" fn ftxStopTransferArea(handle: Handle) -> u32 {
    with_device(handle, |device| device.stop())
}

/// How the exchange stands, as one of three codes.
#[no_mangle]
pub(crate) extern "C" fn ftxIsTransferActiv(handle: Handle) -> u32 {
    with_device(handle, |device| {
        Err(match device.session().status() {
            STATUS_RUN => FTLIB_ERR_THREAD_IS_RUNNING,
            STATUS_SYNC => FTLIB_ERR_THREAD_SYNCHRONIZED,
            _ => FTLIB_ERR_THREAD_NOT_RUNNING,
        })
    })
}

/// The nine areas of a device, at a place that stays until it is closed. Null for a wrong handle.
#[no_mangle]
pub(crate) extern "C" fn GetTransferAreasArrayAddr(handle: Handle) -> *mut Ta {
    guarded(null_mut(), || match LIBRARY.device(handle) {
        Ok(device) => device.array().as_ptr(),
        Err(_) => null_mut(),
    })
}

/// The status of an area. Null for a wrong handle or index.
#[no_mangle]
pub(crate) extern "C" fn GetTransferAreaStatusAddr(
    handle: Handle,
    controller: c_int,
) -> *mut Status {
    guarded(null_mut(), || match (LIBRARY.device(handle), index(controller, AREAS)) {
        (Ok(device), Ok(area)) => device.array().places(area).status,
        _ => null_mut(),
    })
}

/// Whether a handle is one of an open device.
#[no_mangle]
pub(crate) extern "C" fn ftxIsHandleValid(handle: Handle) -> u32 {
    answer(|| LIBRARY.check_handle(handle))
}

/// Whether the port of a device is open, which is the same.
#[no_mangle]
pub(crate) extern "C" fn GetComStatus(handle: Handle) -> u32 {
    answer(|| LIBRARY.check_handle(handle))
}
