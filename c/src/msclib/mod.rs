//! ftMscLib: the library by which PC programs control a ROBO TX, for a TXT.
//!
//! All 82 functions, and the 28 of ftMscLibEx, are exported under their names, as `extern "C"`; the callbacks that a
//! program gives are `extern "system"`. What is exported does not read memory of the program itself: [`arguments`]
//! does.
//!
//! | file | what it has |
//! |---|---|
//! | `library` | the state of the library: whether it is initialized, its devices and their handles |
//! | `device` | one open device: its areas, its transfer, its I2C |
//! | `callbacks` | the thread that calls the program back |
//! | `kinds` | the kinds of callbacks, and what they are told |
//! | `changes` | which changes of inputs a program is told |
//! | `arguments` | what C passes: texts, places for values, `bool` |
//! | all others | the exported functions, by their groups |
//!
//! What the functions have in common:
//!
//! - Any thread may call any function, also from a callback, and while another closes the device or the
//!   library. The call then works, or answers that the device is closed.
//! - A handle is a number, not an address, and is not given a second time: one that was never given is
//!   answered with `FTLIB_ERR_UNKNOWN_DEVICE_HANDLE`, one of a closed device with
//!   `FTLIB_ERR_DEVICE_NOT_OPEN`.
//! - A null pointer and an index out of range are answered with `FTLIB_ERR_INVALID_PARAM`, and nothing is
//!   changed. Texts are cut to their buffers.
//! - Functions for texts return the length, and 0 for every error.

mod absent;
mod arguments;
mod bluetooth;
mod callbacks;
mod changes;
mod configuration;
mod device;
mod devices;
mod extended;
mod i2c;
mod information;
mod inputs;
mod kinds;
mod library;
mod older;
mod outputs;
mod ports;

use std::ffi::c_int;
use std::sync::Arc;

use crate::errors::{FTLIB_ERR_FAILED, FTLIB_ERR_INVALID_PARAM, FTLIB_ERR_SUCCESS};
use crate::ffi::guarded;
use crate::memory::{Places, AREAS};
use arguments::Handle;
use device::Device;
use library::LIBRARY;

pub use information::report_version_of_ex;

/// Runs a call that answers with a code.
fn answer(call: impl FnOnce() -> Result<(), u32>) -> u32 {
    guarded(FTLIB_ERR_FAILED, || call().err().unwrap_or(FTLIB_ERR_SUCCESS))
}

/// Runs a call for an open device.
fn with_device(handle: Handle, call: impl FnOnce(&Arc<Device>) -> Result<(), u32>) -> u32 {
    answer(|| call(&LIBRARY.device(handle)?))
}

/// Runs a call for one area of an open device.
fn with_area(
    handle: Handle,
    controller: c_int,
    call: impl FnOnce(&Device, Places) -> Result<(), u32>,
) -> u32 {
    with_device(handle, |device| {
        let area = index(controller, AREAS)?;
        call(device, device.array().places(area))
    })
}

/// An index below `count`.
fn index(given: c_int, count: usize) -> Result<usize, u32> {
    let index = usize::try_from(given).ok().filter(|index| *index < count);
    index.ok_or(FTLIB_ERR_INVALID_PARAM)
}

/// A number up to `most`.
fn number(given: c_int, most: u16) -> Result<u16, u32> {
    let number = u16::try_from(given).ok().filter(|number| *number <= most);
    number.ok_or(FTLIB_ERR_INVALID_PARAM)
}
