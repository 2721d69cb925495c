//! The I2C calls.

use super::arguments::Handle;
use super::kinds::ResultCallback;
use super::with_device;
use crate::errors::FTLIB_ERR_INVALID_PARAM;
use crate::i2c::{Access, Request};
use crate::results::I2cResult;

/// A callback as the functions of ftMscLib get it.
type Callback = unsafe extern "system-unwind" fn(*mut I2cResult);

/// Reads a value from a device at the controller's I2C. Returns at once; the callback gets the value.
#[no_mangle]
pub(crate) extern "C" fn ftxI2cRead(
    handle: Handle,
    device: u8,
    offset: u32,
    protocol: u8,
    callback: Option<Callback>,
) -> u32 {
    read(handle, device, offset, protocol, callback.map(ResultCallback::Alone))
}

/// Writes a value to a device at the controller's I2C. Returns at once; the callback, if there is one, gets
/// the status.
#[no_mangle]
pub(crate) extern "C" fn ftxI2cWrite(
    handle: Handle,
    device: u8,
    offset: u32,
    data: u16,
    protocol: u8,
    callback: Option<Callback>,
) -> u32 {
    write(handle, device, offset, data, protocol, callback.map(ResultCallback::Alone))
}

/// Reads a value.
pub(super) fn read(
    handle: Handle,
    device: u8,
    offset: u32,
    protocol: u8,
    callback: Option<ResultCallback<I2cResult>>,
) -> u32 {
    if callback.is_none() {
        return with_device(handle, |_| Err(FTLIB_ERR_INVALID_PARAM));
    }
    request(handle, || Request::new(device, offset, protocol, Access::Read), callback)
}

/// Writes a value.
pub(super) fn write(
    handle: Handle,
    device: u8,
    offset: u32,
    data: u16,
    protocol: u8,
    callback: Option<ResultCallback<I2cResult>>,
) -> u32 {
    request(handle, || Request::new(device, offset, protocol, Access::Write(data)), callback)
}

fn request(
    handle: Handle,
    request: impl FnOnce() -> Result<Request, u32>,
    callback: Option<ResultCallback<I2cResult>>,
) -> u32 {
    with_device(handle, |device| {
        let request = request()?;
        let (own, callbacks) = (device.as_owner(), device.callbacks());
        let done = move |value, status| {
            let Some(callback) = callback else { return };
            let result = I2cResult { value, status };
            callbacks.once(own, move |context| callback.call(result, context));
        };
        device.i2c(request, Box::new(done))
    })
}
