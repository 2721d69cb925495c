//! What a TXT online does not have: files, programs, a remote shell, new firmware, a display, another name. Each
//! call checks what it is given, changes nothing and says so.

use std::ffi::{c_int, c_ulong, c_void};

use super::arguments::{Bytes, Handle, Out, TextIn};
use super::{with_area, with_device};
use crate::errors::{
    FTLIB_ERR_FAILED, FTLIB_ERR_INVALID_PARAM, FTLIB_ERR_REM_CMD_NOT_SUPPORTED,
    FTLIB_ERR_UPLOAD_FAILED,
};

/// A callback that is never called.
type Unused = *const c_void;

/// An error for a null pointer.
fn check(text: TextIn) -> Result<(), u32> {
    if text.is_null() {
        return Err(FTLIB_ERR_INVALID_PARAM);
    }
    Ok(())
}

/// Gives a controller another name.
#[no_mangle]
pub(crate) extern "C" fn SetRoboTxDevName(handle: Handle, controller: c_int, name: TextIn) -> u32 {
    with_area(handle, controller, |_, _| check(name).and(Err(FTLIB_ERR_FAILED)))
}

/// Shows a text on the display; null removes it.
#[no_mangle]
pub(crate) extern "C" fn SetRoboTxMessage(
    handle: Handle,
    controller: c_int,
    _message: TextIn,
) -> u32 {
    with_area(handle, controller, |_, _| Err(FTLIB_ERR_FAILED))
}

/// Gives the controller's shell a command.
#[no_mangle]
pub(crate) extern "C" fn FtRemoteCmd(handle: Handle, command: TextIn, _told: Unused) -> u32 {
    with_device(handle, |_| check(command).and(Err(FTLIB_ERR_REM_CMD_NOT_SUPPORTED)))
}

/// Uploads a file.
#[no_mangle]
pub(crate) extern "C" fn FtFileUpload(
    handle: Handle,
    file: TextIn,
    _destination: u32,
    _told: Unused,
) -> u32 {
    with_device(handle, |_| check(file).and(Err(FTLIB_ERR_UPLOAD_FAILED)))
}

/// Uploads a file that is in memory.
#[no_mangle]
pub(crate) extern "C" fn FtRamFileUpload(
    handle: Handle,
    _destination: u32,
    bytes: Bytes,
    _size: u32,
    name: TextIn,
    _told: Unused,
) -> u32 {
    with_device(handle, |_| {
        bytes.check()?;
        check(name).and(Err(FTLIB_ERR_UPLOAD_FAILED))
    })
}

/// Removes all files of a disk.
#[no_mangle]
pub(crate) extern "C" fn RTxCleanDisk(handle: Handle, _disk: u32) -> u32 {
    with_device(handle, |_| Err(FTLIB_ERR_FAILED))
}

/// Runs an uploaded program.
#[no_mangle]
pub(crate) extern "C" fn FtProgramRun(handle: Handle, _program: c_int) -> u32 {
    with_device(handle, |_| Err(FTLIB_ERR_FAILED))
}

/// Stops an uploaded program.
#[no_mangle]
pub(crate) extern "C" fn FtProgramStop(handle: Handle, _program: c_int) -> u32 {
    with_device(handle, |_| Err(FTLIB_ERR_FAILED))
}

/// Uploads new firmware.
#[no_mangle]
pub(crate) extern "C" fn RoboTxFwUpdate(handle: Handle, file: TextIn, _told: Unused) -> u32 {
    with_device(handle, |_| check(file).and(Err(FTLIB_ERR_FAILED)))
}

/// Where the memory of a controller lies.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxMemLayout(
    handle: Handle,
    controller: c_int,
    array: Out<c_ulong>,
    program: Out<c_ulong>,
    size: Out<c_ulong>,
) -> u32 {
    with_area(handle, controller, |_, _| {
        [array, program, size].into_iter().try_for_each(Out::check)?;
        Err(FTLIB_ERR_FAILED)
    })
}
