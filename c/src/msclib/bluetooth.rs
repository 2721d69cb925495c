//! Bluetooth messages between controllers, which a TXT online does not have: each call is answered by its
//! callback with `BT_SWITCHED_OFF`.

use std::sync::Arc;

use super::arguments::{Bytes, Handle, Out};
use super::device::Device;
use super::kinds::ResultCallback;
use super::with_device;
use crate::errors::{FTLIB_BT_INVALID_CONIDX, FTLIB_ERR_INVALID_PARAM};
use crate::ffi::guarded;
use crate::results::{BtReceived, BtResult, BT_MESSAGE_MAX};
use ft_transfer_area::transfer_area::BtStatus;

/// `BT_INQUIRY_SCAN_NOT_POSSIBLE`: among the statuses of a scan, 3 means something else.
const SCAN_NOT_POSSIBLE: u16 = 0;
/// `BT_SCAN_STATUS`.
#[repr(C)]
pub(crate) struct BtScan {
    status: u16,
    address: [u8; 6],
    dummy_1: [u8; 2],
    name: [u8; 17],
    dummy_2: [u8; 3],
}

const _: () = assert!(size_of::<BtScan>() == 30);

/// A callback as the functions of ftMscLib get it.
type Callback<T> = Option<unsafe extern "system-unwind" fn(*mut T)>;

/// Has a callback called.
fn call_back<T: 'static>(
    device: &Arc<Device>,
    callback: Option<ResultCallback<T>>,
    result: impl FnOnce() -> T + Send + 'static,
) -> Result<(), u32> {
    let callback = callback.ok_or(FTLIB_ERR_INVALID_PARAM)?;
    device.call_back(move |context| callback.call(result(), context));
    Ok(())
}

fn channel(given: u32) -> Result<u16, u32> {
    match given {
        1..=8 => Ok(given as u16),
        _ => Err(FTLIB_BT_INVALID_CONIDX),
    }
}

/// Answers a call for one channel.
pub(super) fn switched_off(
    handle: Handle,
    given: u32,
    callback: Option<ResultCallback<BtResult>>,
) -> u32 {
    with_device(handle, |device| {
        let channel = channel(given)?;
        call_back(device, callback, move || BtResult::off(channel))
    })
}

/// Answers a call for one channel, after a check of the bytes that come with it.
pub(super) fn switched_off_with(
    handle: Handle,
    given: u32,
    bytes: Bytes,
    callback: Option<ResultCallback<BtResult>>,
) -> u32 {
    with_device(handle, |device| {
        let channel = channel(given)?;
        bytes.check()?;
        call_back(device, callback, move || BtResult::off(channel))
    })
}

/// Answers a search for controllers.
pub(super) fn scan(handle: Handle, callback: Option<ResultCallback<BtScan>>) -> u32 {
    with_device(handle, |device| {
        call_back(device, callback, || BtScan {
            status: SCAN_NOT_POSSIBLE,
            address: [0; 6],
            dummy_1: [0; 2],
            name: [0; 17],
            dummy_2: [0; 3],
        })
    })
}

/// Answers a message, after a check of its length.
pub(super) fn send(
    handle: Handle,
    given: u32,
    size: u32,
    message: Bytes,
    callback: Option<ResultCallback<BtResult>>,
) -> u32 {
    if size as usize > BT_MESSAGE_MAX {
        return with_device(handle, |_| Err(FTLIB_ERR_INVALID_PARAM));
    }
    switched_off_with(handle, given, message, callback)
}

/// Answers a call that waits for messages.
pub(super) fn read(
    handle: Handle,
    given: u32,
    callback: Option<ResultCallback<BtReceived>>,
) -> u32 {
    with_device(handle, |device| {
        let channel = channel(given)?;
        call_back(device, callback, move || BtReceived::off(channel))
    })
}

/// Looks for controllers: the callback says that it is not possible.
#[no_mangle]
pub(crate) extern "C" fn StartScanBtDevice(handle: Handle, callback: Callback<BtScan>) -> u32 {
    scan(handle, callback.map(ResultCallback::Alone))
}

/// Ends the search. None is running.
#[no_mangle]
pub(crate) extern "C" fn CancelScanBtDevice(handle: Handle) -> u32 {
    with_device(handle, |_| Ok(()))
}

/// Connects to another controller.
#[no_mangle]
pub(crate) extern "C" fn ConnectBtAddress(
    handle: Handle,
    channel: u32,
    address: Bytes,
    callback: Callback<BtResult>,
) -> u32 {
    switched_off_with(handle, channel, address, callback.map(ResultCallback::Alone))
}

/// Ends a connection.
#[no_mangle]
pub(crate) extern "C" fn DisconnectBt(
    handle: Handle,
    channel: u32,
    callback: Callback<BtResult>,
) -> u32 {
    switched_off(handle, channel, callback.map(ResultCallback::Alone))
}

/// Sends a message.
#[no_mangle]
pub(crate) extern "C" fn SendBtMessage(
    handle: Handle,
    channel: u32,
    size: u32,
    message: Bytes,
    callback: Callback<BtResult>,
) -> u32 {
    send(handle, channel, size, message, callback.map(ResultCallback::Alone))
}

/// Waits for a connection.
#[no_mangle]
pub(crate) extern "C" fn BtListenConOn(
    handle: Handle,
    channel: u32,
    address: Bytes,
    callback: Callback<BtResult>,
) -> u32 {
    switched_off_with(handle, channel, address, callback.map(ResultCallback::Alone))
}

/// Stops waiting for a connection.
#[no_mangle]
pub(crate) extern "C" fn BtListenConOff(
    handle: Handle,
    channel: u32,
    callback: Callback<BtResult>,
) -> u32 {
    switched_off(handle, channel, callback.map(ResultCallback::Alone))
}

/// Waits for messages.
#[no_mangle]
pub(crate) extern "C" fn BtReadMsgOn(
    handle: Handle,
    channel: u32,
    callback: Callback<BtReceived>,
) -> u32 {
    read(handle, channel, callback.map(ResultCallback::Alone))
}

/// Stops waiting for messages.
#[no_mangle]
pub(crate) extern "C" fn BtReadMsgOff(
    handle: Handle,
    channel: u32,
    callback: Callback<BtResult>,
) -> u32 {
    switched_off(handle, channel, callback.map(ResultCallback::Alone))
}

/// The state of a channel: idle.
#[no_mangle]
pub(crate) extern "C" fn StatusBtConnection(_channel: u32, status: Out<BtStatus>) {
    guarded((), || {
        // There is no answer to give for a null pointer.
        let _ = status.put(BtStatus::default());
    });
}

/// The state of Bluetooth: idle.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxBtStatus(handle: Handle, status: Out<BtStatus>) -> u32 {
    with_device(handle, |_| status.put(BtStatus::default()))
}
