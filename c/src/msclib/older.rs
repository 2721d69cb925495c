//! Functions of the library of 2009 that finished programs import. Only their names are known, so each does
//! what the function does that has taken its place, with the same parameters.

use std::ffi::c_int;

use super::arguments::Handle;
use super::devices::{GetTransferAreaStatusAddr, GetTransferAreasArrayAddr};
use super::outputs::{StartCounterReset, StartMotorExCmd, StopMotorExCmd};
use crate::memory::Ta;
use ft_transfer_area::transfer_area::Status;

/// `StartCounterReset`.
#[no_mangle]
pub(crate) extern "C" fn SetOutCounterReset(
    handle: Handle,
    controller: c_int,
    counter: c_int,
) -> u32 {
    StartCounterReset(handle, controller, counter)
}

/// `StartMotorExCmd`.
#[no_mangle]
pub(crate) extern "C" fn SetMotorExConfig(
    handle: Handle,
    controller: c_int,
    motor: c_int,
    duty: c_int,
    direction: c_int,
    slave: c_int,
    slave_direction: c_int,
    pulses: c_int,
) -> u32 {
    StartMotorExCmd(handle, controller, motor, duty, direction, slave, slave_direction, pulses)
}

/// `StopMotorExCmd`.
#[no_mangle]
pub(crate) extern "C" fn ResetMotorExConfig(
    handle: Handle,
    controller: c_int,
    motor: c_int,
) -> u32 {
    StopMotorExCmd(handle, controller, motor)
}

/// `StopMotorExCmd`.
#[no_mangle]
pub(crate) extern "C" fn StopMotorExConfig(handle: Handle, controller: c_int, motor: c_int) -> u32 {
    StopMotorExCmd(handle, controller, motor)
}

/// `GetTransferAreaStatusAddr`.
#[no_mangle]
pub(crate) extern "C" fn GetFtX1TransferStatusAddr(
    handle: Handle,
    controller: c_int,
) -> *mut Status {
    GetTransferAreaStatusAddr(handle, controller)
}

/// `GetTransferAreasArrayAddr`.
#[no_mangle]
pub(crate) extern "C" fn GetIF08TransferAddress(handle: Handle) -> *mut Ta {
    GetTransferAreasArrayAddr(handle)
}
