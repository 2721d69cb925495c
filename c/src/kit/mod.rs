//! The functions under the classes of the kits 4.1.6 and 4.6.6, `ftIF2013TransferAreaComHandler` and
//! `ftIF2013TransferAreaComHandlerEx`.
#![allow(unreachable_pub, reason = "the linker exports it")]

mod areas;
mod handler;
mod thread;

use std::ffi::c_char;

use ft_transfer_area::transfer_area::FishX1Transfer;
use ft_transfer_area::TransferMode;

use crate::ffi::{copy_text, guarded, text_of};
use crate::host;
use crate::report;
use areas::ProgramAreas;
use handler::{Failure, Kit};
use thread::Threaded;

/// A handler as C passes it: null, or from [`ft_kit_new`] and not freed.
type Handle<'a> = Option<&'a Threaded>;

/// Makes a handler, and sets the default configuration in the program's areas. Null when there are none, or
/// not 1 to 9.
///
/// # Safety
///
/// `areas` is null or points to `count` areas, which stay there until [`ft_kit_free`]. The texts are null or end
/// with 0.
#[no_mangle]
pub unsafe extern "C" fn ft_kit_new(
    areas: *mut FishX1Transfer,
    count: i32,
    host: *const c_char,
    port: *const c_char,
) -> *mut Threaded {
    guarded(std::ptr::null_mut(), || {
        // SAFETY: as the caller promises.
        let areas = unsafe { ProgramAreas::new(areas, count) };
        let Some(areas) = areas else {
            report::failure("a handler needs 1 to 9 transfer areas of the program");
            return std::ptr::null_mut();
        };
        // SAFETY: as the caller promises.
        let (host, port) = unsafe { (text_of(host), text_of(port)) };
        let kit = Kit::new(areas, host.as_deref(), port.as_deref());
        Box::into_raw(Box::new(Threaded::new(kit)))
    })
}

/// Ends the transfer and the camera, and the handler with them.
#[no_mangle]
pub extern "C" fn ft_kit_free(kit: Option<Box<Threaded>>) {
    guarded((), || drop(kit));
}

/// Runs a call; an error is reported and becomes 0.
fn call(kit: Handle<'_>, run: impl FnOnce(&Kit) -> Result<(), Failure>) -> i32 {
    guarded(0, || {
        let Some(kit) = kit.map(Threaded::kit) else { return 0 };
        i32::from(kit.report(run(kit)))
    })
}

/// The firmware's version, such as 0x04060600; 0 when the controller does not answer.
#[no_mangle]
pub extern "C" fn ft_kit_version(kit: Handle<'_>) -> u32 {
    let mut version = 0;
    call(kit, |kit| {
        version = kit.version()?;
        Ok(())
    });
    version
}

/// Connects and sends all configurations.
#[no_mangle]
pub extern "C" fn ft_kit_begin(kit: Handle<'_>) -> i32 {
    call(kit, Kit::begin)
}

/// Sends all configurations.
#[no_mangle]
pub extern "C" fn ft_kit_update_config(kit: Handle<'_>) -> i32 {
    call(kit, Kit::update_config)
}

/// Exchanges the areas once.
#[no_mangle]
pub extern "C" fn ft_kit_transfer(kit: Handle<'_>, compressed: i32) -> i32 {
    call(kit, |kit| kit.transfer(mode(compressed)))
}

/// The exchange that a program wants.
fn mode(compressed: i32) -> TransferMode {
    host::mode_for(if compressed == 0 { TransferMode::Simple } else { TransferMode::Compressed })
}

/// Ends the transfer with all motors off, and the thread if there is one.
#[no_mangle]
pub extern "C" fn ft_kit_end(kit: Handle<'_>) {
    guarded((), || {
        if kit.is_some_and(Threaded::stop) {
            return;
        }
        call(kit, Kit::end);
    });
}

/// Begins the transfer, and exchanges the areas in a thread. 0; 1 when it runs already; 2 when that fails.
#[no_mangle]
pub extern "C" fn ft_kit_start_thread(kit: Handle<'_>, compressed: i32) -> i32 {
    const RUNS: i32 = 1;
    const FAILED: i32 = 2;
    guarded(FAILED, || match kit.map(|kit| kit.start(mode(compressed))) {
        Some(Ok(true)) => 0,
        Some(Ok(false)) => RUNS,
        Some(Err(())) | None => FAILED,
    })
}

/// Ends both. 0; 1 when there is no thread.
#[no_mangle]
pub extern "C" fn ft_kit_stop_thread(kit: Handle<'_>) -> i32 {
    guarded(1, || i32::from(!kit.is_some_and(Threaded::stop)))
}

/// Whether the thread exchanges.
#[no_mangle]
pub extern "C" fn ft_kit_thread_runs(kit: Handle<'_>) -> i32 {
    guarded(0, || i32::from(kit.is_some_and(Threaded::runs)))
}

/// Starts the camera. Its frames come over a connection of their own.
///
/// # Safety
///
/// `port` is null or a text that ends with 0.
#[no_mangle]
pub unsafe extern "C" fn ft_kit_start_camera(
    kit: Handle<'_>,
    width: i32,
    height: i32,
    framerate: i32,
    power_line: i32,
    port: *const c_char,
) -> i32 {
    // SAFETY: as the caller promises.
    let port = unsafe { text_of(port) };
    call(kit, |kit| kit.start_camera([width, height, framerate, power_line], port.as_deref()))
}

/// Stops the camera.
#[no_mangle]
pub extern "C" fn ft_kit_stop_camera(kit: Handle<'_>) {
    call(kit, Kit::stop_camera);
}

/// Waits for the next frame. Its bytes are the handler's, and stay until the next call.
///
/// # Safety
///
/// `buffer` and `size` are null or lead to places of the program.
#[no_mangle]
pub unsafe extern "C" fn ft_kit_frame(
    kit: Handle<'_>,
    buffer: *mut *mut u8,
    size: *mut usize,
) -> i32 {
    if buffer.is_null() || size.is_null() {
        return 0;
    }
    call(kit, |kit| {
        let (bytes, length) = kit.frame()?;
        // SAFETY: not null, so places of the program, as the caller promises.
        unsafe {
            buffer.write(bytes);
            size.write(length);
        }
        Ok(())
    })
}

/// Writes the line that the kit's `PrintIO` prints. Returns its length; 0 without an area or a place.
///
/// # Safety
///
/// `area` is null or points to an area; `text` is null or has `size` bytes.
#[no_mangle]
pub unsafe extern "C" fn ft_kit_line(
    area: *const FishX1Transfer,
    text: *mut c_char,
    size: usize,
) -> usize {
    guarded(0, || {
        // SAFETY: as the caller promises.
        let Some(area) = (unsafe { ProgramAreas::new(area.cast_mut(), 1) }) else { return 0 };
        // SAFETY: as the caller promises.
        unsafe { copy_text(&area.read(0).to_string(), text, size) }
    })
}
