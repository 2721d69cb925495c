//! The functions under FtTxtLib's classes, `ftIF2013TransferAreaComHandlerEx2` and what it derives from.
#![allow(unreachable_pub, reason = "the linker exports it")]

mod calls;
mod handler;

use std::ffi::{c_char, c_void};
use std::ptr;

use ft_transfer_area::transfer_area::FishX1Transfer;

use crate::errors::{code_of, FTLIB_ERR_FAILED, FTLIB_ERR_INVALID_PARAM, FTLIB_ERR_SUCCESS};
use crate::ffi::{guarded, text_of};
use crate::report;
use handler::{Cycle, CycleFunction, Ex2};

/// A handler as C passes it: null, or from [`ft_ex2_new`] and not freed.
type Handle<'a> = Option<&'a Ex2>;

/// Makes a handler and its areas. Nothing is connected yet. Null when there are not 1 to 9 areas.
///
/// # Safety
///
/// The texts are null or end with 0. `cycle` may be called with `context` in another thread until
/// [`ft_ex2_free`] has returned, and does not unwind.
#[no_mangle]
pub unsafe extern "C" fn ft_ex2_new(
    areas: i32,
    host: *const c_char,
    port: *const c_char,
    cycle: Option<CycleFunction>,
    context: *mut c_void,
) -> *mut Ex2 {
    guarded(ptr::null_mut(), || {
        // SAFETY: as the caller promises.
        let (host, port) = unsafe { (text_of(host), text_of(port)) };
        let Some(cycle) = cycle else { return ptr::null_mut() };
        let cycle = Cycle::new(cycle, context);
        match Ex2::new(areas, host.as_deref(), port.as_deref(), cycle) {
            Some(handler) => Box::into_raw(Box::new(handler)),
            None => {
                report::failure("a handler has 1 to 9 transfer areas");
                ptr::null_mut()
            }
        }
    })
}

/// Ends the transfer, and the handler with its areas. May be called from the cycle's function.
#[no_mangle]
pub extern "C" fn ft_ex2_free(handler: Option<Box<Ex2>>) {
    guarded((), || drop(handler));
}

/// Runs a call that returns one of FtTxtLib's codes.
fn call(handler: Handle<'_>, run: impl FnOnce(&Ex2) -> Result<(), ft_transfer_area::Error>) -> u32 {
    guarded(FTLIB_ERR_FAILED, || {
        let Some(handler) = handler else { return FTLIB_ERR_INVALID_PARAM };
        match run(handler) {
            Ok(()) => FTLIB_ERR_SUCCESS,
            Err(error) => {
                if !report::is_told_by_code(&error) {
                    handler.report(&error);
                }
                code_of(&error)
            }
        }
    })
}

/// The areas, which stay where they are until the handler is freed.
#[no_mangle]
pub extern "C" fn ft_ex2_areas(handler: Handle<'_>) -> *mut FishX1Transfer {
    handler.map_or(ptr::null_mut(), Ex2::areas)
}

/// Connects and begins to exchange. Returns after the first response.
#[no_mangle]
pub extern "C" fn ft_ex2_start(handler: Handle<'_>) -> u32 {
    call(handler, Ex2::start)
}

/// Ends the exchange with all outputs off.
#[no_mangle]
pub extern "C" fn ft_ex2_stop(handler: Handle<'_>) -> u32 {
    call(handler, Ex2::stop)
}

/// Whether areas are exchanged.
#[no_mangle]
pub extern "C" fn ft_ex2_is_active(handler: Handle<'_>) -> i32 {
    guarded(0, || i32::from(handler.is_some_and(Ex2::is_active)))
}

/// Chooses the exchange of the next start: 0 simple, else compressed.
#[no_mangle]
pub extern "C" fn ft_ex2_set_mode(handler: Handle<'_>, compressed: i32) {
    if let Some(handler) = handler {
        guarded((), || handler.set_mode(compressed != 0));
    }
}

/// The firmware's version, such as 0x04060600; 0 when it is not known.
#[no_mangle]
pub extern "C" fn ft_ex2_version(handler: Handle<'_>) -> u32 {
    let mut version = 0;
    call(handler, |handler| {
        version = handler.version()?;
        Ok(())
    });
    version
}

/// Connects to the controller's I2C port. 0 when that fails.
#[no_mangle]
pub extern "C" fn ft_ex2_start_i2c(handler: Handle<'_>) -> i32 {
    i32::from(call(handler, Ex2::start_i2c) == FTLIB_ERR_SUCCESS)
}

/// Closes that connection. 0 when there is none.
#[no_mangle]
pub extern "C" fn ft_ex2_stop_i2c(handler: Handle<'_>) -> i32 {
    guarded(0, || i32::from(handler.is_some_and(Ex2::stop_i2c)))
}

/// Starts the camera. 0 when that fails.
#[no_mangle]
pub extern "C" fn ft_ex2_start_camera(
    handler: Handle<'_>,
    width: i32,
    height: i32,
    framerate: i32,
    power_line: i32,
) -> i32 {
    // Its class lets the camera decide about anything else.
    let power_line = if matches!(power_line, 50 | 60) { power_line } else { 0 };
    let settings = [width, height, framerate, power_line];
    i32::from(call(handler, |handler| handler.start_camera(settings)) == FTLIB_ERR_SUCCESS)
}

/// Stops the camera.
#[no_mangle]
pub extern "C" fn ft_ex2_stop_camera(handler: Handle<'_>) {
    call(handler, Ex2::stop_camera);
}

/// Waits for the next frame. Its bytes are the handler's, and stay until the next call. 0 when none comes.
///
/// # Safety
///
/// `buffer` and `size` are null or lead to places of the program.
#[no_mangle]
pub unsafe extern "C" fn ft_ex2_frame(
    handler: Handle<'_>,
    buffer: *mut *mut u8,
    size: *mut usize,
) -> i32 {
    if buffer.is_null() || size.is_null() {
        return 0;
    }
    let result = call(handler, |handler| {
        let (bytes, length) = handler.frame()?;
        // SAFETY: not null, so places of the program, as the caller promises.
        unsafe {
            buffer.write(bytes);
            size.write(length);
        }
        Ok(())
    });
    i32::from(result == FTLIB_ERR_SUCCESS)
}
