//! Hooks whose results come by callback: Bluetooth, which is off, and I2C.

use std::ffi::c_void;
use std::sync::Arc;

use super::callbacks::Callbacks;
use super::system;
use crate::errors::{FTLIB_ERR_FAILED, FTLIB_ERR_SUCCESS};
use crate::ffi::guarded;
use crate::i2c::{Access, Request};
use crate::memory::{AreaArray, Ta};

/// `BT_SWITCHED_OFF`.
const BT_SWITCHED_OFF: u16 = 3;

/// `BT_CB`.
#[repr(C)]
pub(super) struct BtCb {
    chan_idx: u16,
    status: u16,
}

/// `BT_RECV_CB`.
#[repr(C)]
pub(super) struct BtRecvCb {
    chan_idx: u16,
    status: u16,
    msg_len: u16,
    msg: [u8; 16],
}

/// `I2C_CB`.
#[repr(C)]
pub(super) struct I2cCb {
    value: u16,
    status: u16,
}

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

fn answer_off(channel: u32, callback: Callback<BtCb>) {
    guarded((), || {
        if let Some(system) = system::current() {
            tell(
                &system.callbacks,
                &system.array,
                callback,
                BtCb { chan_idx: channel as u16, status: BT_SWITCHED_OFF },
            );
        }
    });
}

fn answer_receive_off(channel: u32, callback: Callback<BtRecvCb>) {
    guarded((), || {
        let (chan_idx, status) = (channel as u16, BT_SWITCHED_OFF);
        let data = BtRecvCb { chan_idx, status, msg_len: 0, msg: [0; 16] };
        if let Some(system) = system::current() {
            tell(&system.callbacks, &system.array, callback, data);
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
    bt_connect(*const u8) -> Callback<BtCb>: answer_off;
    /// `BtDisconnect`.
    bt_disconnect() -> Callback<BtCb>: answer_off;
    /// `BtSend`.
    bt_send(u32, *const c_void) -> Callback<BtCb>: answer_off;
    /// `BtStartReceive`.
    bt_start_receive() -> Callback<BtRecvCb>: answer_receive_off;
    /// `BtStopReceive`.
    bt_stop_receive() -> Callback<BtRecvCb>: answer_receive_off;
    /// `BtStartListen`.
    bt_start_listen(*const u8) -> Callback<BtCb>: answer_off;
    /// `BtStopListen`.
    bt_stop_listen() -> Callback<BtCb>: answer_off;
}

fn i2c(device: u8, offset: u32, protocol: u8, access: Access, callback: Callback<I2cCb>) -> u32 {
    guarded(FTLIB_ERR_FAILED, || {
        let Some(system) = system::current() else { return FTLIB_ERR_FAILED };
        let (callbacks, areas) = (Arc::clone(&system.callbacks), Arc::clone(&system.array));
        let done = move |value, status| tell(&callbacks, &areas, callback, I2cCb { value, status });
        let request = Request::new(device, offset, protocol, access);
        let begun = request.and_then(|request| system.i2c.lock().request(request, Box::new(done)));
        begun.err().unwrap_or(FTLIB_ERR_SUCCESS)
    })
}

/// `I2cRead`.
pub(super) extern "C" fn i2c_read(
    device: u8,
    offset: u32,
    protocol: u8,
    callback: Callback<I2cCb>,
) -> u32 {
    i2c(device, offset, protocol, Access::Read, callback)
}

/// `I2cWrite`.
pub(super) extern "C" fn i2c_write(
    device: u8,
    offset: u32,
    data: u16,
    protocol: u8,
    callback: Callback<I2cCb>,
) -> u32 {
    i2c(device, offset, protocol, Access::Write(data), callback)
}
