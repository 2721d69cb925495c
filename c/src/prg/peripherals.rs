//! Hooks whose results come by callback: Bluetooth, which is off, and I2C.

use std::ffi::c_void;
use std::sync::Arc;

use super::callbacks::Callbacks;
use super::system;
use crate::errors::{FTLIB_ERR_FAILED, FTLIB_ERR_SUCCESS};
use crate::ffi::guarded;
use crate::i2c::{Access, Request};
use crate::memory::{AreaArray, Ta};
use crate::results::{BtReceived, BtResult, I2cResult};

/// A callback of the program, with the master's area and what has happened.
pub(super) type Callback<T> = Option<unsafe extern "C-unwind" fn(*mut Ta, *mut T)>;

/// Tells the program something between two tics.
fn tell<T: Send + 'static>(
    callbacks: &Callbacks,
    areas: &Arc<AreaArray<Ta>>,
    callback: Callback<T>,
    mut data: T,
) {
    let Some(callback) = callback else { return };
    let areas = Arc::clone(areas);
    // SAFETY: the program's function, of the type that its header gives it, and the areas of its run.
    let call = move || unsafe { callback(areas.as_ptr(), &raw mut data) };
    callbacks.add(Box::new(call));
}

fn answer_off(channel: u32, callback: Callback<BtResult>) {
    guarded((), || {
        if let Some(system) = system::current() {
            tell(&system.callbacks, &system.array, callback, BtResult::off(channel as u16));
        }
    });
}

fn answer_receive_off(channel: u32, callback: Callback<BtReceived>) {
    guarded((), || {
        if let Some(system) = system::current() {
            tell(&system.callbacks, &system.array, callback, BtReceived::off(channel as u16));
        }
    });
}

macro_rules! bluetooth {
    ($($(#[$doc:meta])* $name:ident($($unused:ty),*) -> $callback:ty: $answer:ident;)+) => {$(
        $(#[$doc])*
        pub(super) extern "C" fn $name(channel: u32, $(_: $unused,)* callback: $callback) {
            $answer(channel, callback);
        }
    )+};
}

bluetooth! {
    /// `BtConnect`.
    bt_connect(*const u8) -> Callback<BtResult>: answer_off;
    /// `BtDisconnect`.
    bt_disconnect() -> Callback<BtResult>: answer_off;
    /// `BtSend`.
    bt_send(u32, *const c_void) -> Callback<BtResult>: answer_off;
    /// `BtStartReceive`.
    bt_start_receive() -> Callback<BtReceived>: answer_receive_off;
    /// `BtStopReceive`.
    bt_stop_receive() -> Callback<BtReceived>: answer_receive_off;
    /// `BtStartListen`.
    bt_start_listen(*const u8) -> Callback<BtResult>: answer_off;
    /// `BtStopListen`.
    bt_stop_listen() -> Callback<BtResult>: answer_off;
}

fn i2c(
    device: u8,
    offset: u32,
    protocol: u8,
    access: Access,
    callback: Callback<I2cResult>,
) -> u32 {
    guarded(FTLIB_ERR_FAILED, || {
        let Some(system) = system::current() else { return FTLIB_ERR_FAILED };
        let (callbacks, areas) = (Arc::clone(&system.callbacks), Arc::clone(&system.array));
        let done =
            move |value, status| tell(&callbacks, &areas, callback, I2cResult { value, status });
        let request = Request::new(device, offset, protocol, access);
        let begun = request.and_then(|request| {
            // There is one transfer.
            system.i2c.lock().request(request, Box::new(|| true), Box::new(done))
        });
        begun.err().unwrap_or(FTLIB_ERR_SUCCESS)
    })
}

/// `I2cRead`.
pub(super) extern "C" fn i2c_read(
    device: u8,
    offset: u32,
    protocol: u8,
    callback: Callback<I2cResult>,
) -> u32 {
    i2c(device, offset, protocol, Access::Read, callback)
}

/// `I2cWrite`.
pub(super) extern "C" fn i2c_write(
    device: u8,
    offset: u32,
    data: u16,
    protocol: u8,
    callback: Callback<I2cResult>,
) -> u32 {
    i2c(device, offset, protocol, Access::Write(data), callback)
}
