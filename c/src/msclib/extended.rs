//! What ftMscLibEx has more than ftMscLib: callbacks with a context, callbacks for changes of inputs, up to three
//! motors that follow one. Both libraries export all of it.

use std::ffi::{c_int, c_void};

use super::absent::FtRemoteCmd;
use super::arguments::{Bool, Bytes, Handle, Out, TextIn};
use super::bluetooth::{self, BtScan};
use super::changes::Input;
use super::kinds::{
    CntInCallback, Context, CounterCallback, Event, EventCallback, EventCallback2, ResultCallback,
    UniCallback,
};
use super::library::LIBRARY;
use super::outputs::{set, start_motors};
use super::{i2c, index, with_device};
use crate::errors::FTLIB_ERR_THREAD_IS_RUNNING;
use crate::memory::AREAS;
use crate::results::{BtReceived, BtResult, I2cResult};
use crate::session::STATUS_STOP;

/// `CB_LEVEL2`. Its two switches mean nothing here: each function says itself whether its callback gets the context.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Level2 {
    context: Context,
    with_bluetooth: Bool,
    with_i2c: Bool,
    reserved: [u32; 2],
}

/// A callback with a context, for the result of a request.
type Callback2<T> = Option<unsafe extern "system-unwind" fn(*mut T, Context)>;

fn with_context<T>(callback: Callback2<T>) -> Option<ResultCallback<T>> {
    callback.map(ResultCallback::WithContext)
}

/// Begins to exchange the areas, as `ftxStartTransferArea`. All callbacks with a context get this one from now on.
#[no_mangle]
pub(crate) extern "C" fn ftxStartTransferArea2(handle: Handle, info: Level2) -> u32 {
    with_device(handle, |device| {
        if device.session().status() != STATUS_STOP {
            return Err(FTLIB_ERR_THREAD_IS_RUNNING);
        }
        device.set_context(info.context);
        LIBRARY.start(device)
    })
}

/// `SetCBCounterResetted` with a context.
#[no_mangle]
pub(crate) extern "C" fn SetCBCounterResetted2(callback: Option<EventCallback2>) {
    set(Event::CounterResetted2, callback.map(EventCallback::WithContext));
}

/// `SetCBMotorExReached` with a context.
#[no_mangle]
pub(crate) extern "C" fn SetCBMotorExReached2(callback: Option<EventCallback2>) {
    set(Event::MotorExReached2, callback.map(EventCallback::WithContext));
}

/// `SetCBRoboExtState` with a context.
#[no_mangle]
pub(crate) extern "C" fn SetCBRoboExtState2(callback: Option<EventCallback2>) {
    set(Event::RoboExtState2, callback.map(EventCallback::WithContext));
}

/// Has this called when a universal input has changed whose bit is in the mask; null takes it away.
#[no_mangle]
pub(crate) extern "C" fn SetCBUniChanged(callback: Option<UniCallback>) {
    set(Event::UniChanged, callback.map(EventCallback::Uni));
}

/// Has this called when the level of a counter's input has changed; null takes it away.
#[no_mangle]
pub(crate) extern "C" fn SetCBCntInChanged(callback: Option<CntInCallback>) {
    set(Event::CntInChanged, callback.map(EventCallback::CntIn));
}

/// Has this called when a counter has changed; null takes it away.
#[no_mangle]
pub(crate) extern "C" fn SetCBCounterChanged(callback: Option<CounterCallback>) {
    set(Event::CounterChanged, callback.map(EventCallback::Counter));
}

/// For the display's two buttons, which a TXT online does not have: it is never called.
#[no_mangle]
pub(crate) extern "C" fn SetCBButtonChanged(_callback: *const c_void) {}

fn set_mask(handle: Handle, controller: c_int, input: Input, mask: u32) -> u32 {
    with_device(handle, |device| {
        device.set_mask(index(controller, AREAS)?, input, mask);
        Ok(())
    })
}

fn get_mask(handle: Handle, controller: c_int, input: Input, mask: Out<u32>) -> u32 {
    with_device(handle, |device| mask.put(device.mask(index(controller, AREAS)?, input).into()))
}

/// Chooses the universal inputs that call back: bit 0 is I1.
#[no_mangle]
pub(crate) extern "C" fn SetCBMaskUniChanged(handle: Handle, controller: c_int, mask: u32) -> u32 {
    set_mask(handle, controller, Input::Uni, mask)
}

/// The universal inputs that call back.
#[no_mangle]
pub(crate) extern "C" fn GetCBMaskUniChanged(
    handle: Handle,
    controller: c_int,
    mask: Out<u32>,
) -> u32 {
    get_mask(handle, controller, Input::Uni, mask)
}

/// Chooses the counters whose levels call back: bit 0 is C1.
#[no_mangle]
pub(crate) extern "C" fn SetCBMaskCntInChanged(
    handle: Handle,
    controller: c_int,
    mask: u32,
) -> u32 {
    set_mask(handle, controller, Input::CntIn, mask)
}

/// The counters whose levels call back.
#[no_mangle]
pub(crate) extern "C" fn GetCBMaskCntInChanged(
    handle: Handle,
    controller: c_int,
    mask: Out<u32>,
) -> u32 {
    get_mask(handle, controller, Input::CntIn, mask)
}

/// Chooses the counters that call back: bit 0 is C1.
#[no_mangle]
pub(crate) extern "C" fn SetCBMaskCounterChanged(
    handle: Handle,
    controller: c_int,
    mask: u32,
) -> u32 {
    set_mask(handle, controller, Input::Counter, mask)
}

/// The counters that call back.
#[no_mangle]
pub(crate) extern "C" fn GetCBMaskCounterChanged(
    handle: Handle,
    controller: c_int,
    mask: Out<u32>,
) -> u32 {
    get_mask(handle, controller, Input::Counter, mask)
}

/// Turns a motor, and up to three that follow it, as `StartMotorExCmd`.
#[no_mangle]
pub(crate) extern "C" fn StartMotorExCmd4(
    handle: Handle,
    controller: c_int,
    motor: c_int,
    duty: c_int,
    direction: c_int,
    slave_1: c_int,
    direction_1: c_int,
    slave_2: c_int,
    direction_2: c_int,
    slave_3: c_int,
    direction_3: c_int,
    pulses: c_int,
) -> u32 {
    let slaves = [(slave_1, direction_1), (slave_2, direction_2), (slave_3, direction_3)];
    start_motors(handle, controller, (motor, direction), &slaves, duty, pulses)
}

/// `FtRemoteCmd` with a context.
#[no_mangle]
pub(crate) extern "C" fn FtRemoteCmd2(handle: Handle, command: TextIn, told: *const c_void) -> u32 {
    FtRemoteCmd(handle, command, told)
}

/// `StartScanBtDevice` with a context.
#[no_mangle]
pub(crate) extern "C" fn StartScanBtDevice2(handle: Handle, callback: Callback2<BtScan>) -> u32 {
    bluetooth::scan(handle, with_context(callback))
}

/// `ConnectBtAddress` with a context.
#[no_mangle]
pub(crate) extern "C" fn ConnectBtAddress2(
    handle: Handle,
    channel: u32,
    address: Bytes,
    callback: Callback2<BtResult>,
) -> u32 {
    bluetooth::switched_off_with(handle, channel, address, with_context(callback))
}

/// `DisconnectBt` with a context.
#[no_mangle]
pub(crate) extern "C" fn DisconnectBt2(
    handle: Handle,
    channel: u32,
    callback: Callback2<BtResult>,
) -> u32 {
    bluetooth::switched_off(handle, channel, with_context(callback))
}

/// `SendBtMessage` with a context.
#[no_mangle]
pub(crate) extern "C" fn SendBtMessage2(
    handle: Handle,
    channel: u32,
    size: u32,
    message: Bytes,
    callback: Callback2<BtResult>,
) -> u32 {
    bluetooth::send(handle, channel, size, message, with_context(callback))
}

/// `BtListenConOn` with a context.
#[no_mangle]
pub(crate) extern "C" fn BtListenConOn2(
    handle: Handle,
    channel: u32,
    address: Bytes,
    callback: Callback2<BtResult>,
) -> u32 {
    bluetooth::switched_off_with(handle, channel, address, with_context(callback))
}

/// `BtListenConOff` with a context.
#[no_mangle]
pub(crate) extern "C" fn BtListenConOff2(
    handle: Handle,
    channel: u32,
    callback: Callback2<BtResult>,
) -> u32 {
    bluetooth::switched_off(handle, channel, with_context(callback))
}

/// `BtReadMsgOn` with a context.
#[no_mangle]
pub(crate) extern "C" fn BtReadMsgOn2(
    handle: Handle,
    channel: u32,
    callback: Callback2<BtReceived>,
) -> u32 {
    bluetooth::read(handle, channel, with_context(callback))
}

/// `BtReadMsgOff` with a context.
#[no_mangle]
pub(crate) extern "C" fn BtReadMsgOff2(
    handle: Handle,
    channel: u32,
    callback: Callback2<BtResult>,
) -> u32 {
    bluetooth::switched_off(handle, channel, with_context(callback))
}

/// `ftxI2cRead` with a context.
#[no_mangle]
pub(crate) extern "C" fn ftxI2cRead2(
    handle: Handle,
    device: u8,
    offset: u32,
    protocol: u8,
    callback: Callback2<I2cResult>,
) -> u32 {
    i2c::read(handle, device, offset, protocol, with_context(callback))
}

/// `ftxI2cWrite` with a context.
#[no_mangle]
pub(crate) extern "C" fn ftxI2cWrite2(
    handle: Handle,
    device: u8,
    offset: u32,
    data: u16,
    protocol: u8,
    callback: Callback2<I2cResult>,
) -> u32 {
    i2c::write(handle, device, offset, data, protocol, with_context(callback))
}
