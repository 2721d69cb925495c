//! The library's and the controllers' texts and numbers.

use std::ffi::c_int;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

use super::arguments::{Handle, Out, TextOut};
use super::device::Device;
use super::library::LIBRARY;
use super::{index, with_area, with_device};
use crate::errors::{
    CODES, FTLIB_ERR_FAILED, FTLIB_ERR_INVALID_PARAM, FTLIB_ERR_THREAD_NOT_RUNNING,
};
use crate::ffi::guarded;
use crate::memory::AREAS;
use crate::mirror::{ta_firmware, ROBOLIB_DLL};

/// The longest name of a controller.
const NAME_MAX: usize = 16;

/// A version of the interface.
struct Version {
    number: [u8; 3],
    date: &'static str,
}

const VERSION: Version = Version { number: [1, 5, 11], date: "2012/02/19" };
/// Programs for ftMscLibEx want 1.5.13 or later.
const VERSION_OF_EX: Version = Version { number: [1, 5, 14], date: "2014/05/16" };

/// Whether the program has loaded ftMscLibEx.
static IS_EX: AtomicBool = AtomicBool::new(false);

/// Has this library report the version of ftMscLibEx. That one calls it when it is loaded.
pub fn report_version_of_ex() {
    IS_EX.store(true, Ordering::Relaxed);
}

impl Version {
    fn reported() -> &'static Self {
        if IS_EX.load(Ordering::Relaxed) {
            &VERSION_OF_EX
        } else {
            &VERSION
        }
    }

    fn code(&self) -> u32 {
        let [major, minor, patch] = self.number;
        u32::from_be_bytes([0, major, minor, patch])
    }

    fn text(&self) -> String {
        let [major, minor, patch] = self.number;
        format!("{major:02}.{minor:02}.{patch:02}  ({})", self.date)
    }
}

/// Gives the program a text; none is an empty one.
fn text(to: TextOut, size: u32, text: impl FnOnce() -> Option<String>) -> u32 {
    guarded(0, || to.put(&text().unwrap_or_default(), size))
}

/// Gives the program a text about a device.
fn device_text(
    handle: Handle,
    to: TextOut,
    size: u32,
    of: impl FnOnce(&Arc<Device>) -> String,
) -> u32 {
    text(to, size, || LIBRARY.device(handle).ok().map(|device| of(&device)))
}

/// Gives the program a text about the master. A TXT online sends nothing about extensions.
fn master_text(
    handle: Handle,
    controller: c_int,
    to: TextOut,
    size: u32,
    of: impl FnOnce(&Arc<Device>) -> String,
) -> u32 {
    text(to, size, || {
        let device = LIBRARY.device(handle).ok().filter(|_| controller == 0);
        device.map(|device| of(&device))
    })
}

/// `V 04.06` for 4.6.6.
fn firmware_text(device: &Arc<Device>) -> String {
    let [.., major, minor] = ta_firmware(device.firmware());
    format!("V {major:02}.{minor:02}")
}

/// The library's version as a number: 00 01 05 0B for 1.5.11.
#[no_mangle]
pub(crate) extern "C" fn ftxGetLibVersion() -> u32 {
    Version::reported().code()
}

/// The library's version: `01.05.11  (2012/02/19)`, as programs compare it.
#[no_mangle]
pub(crate) extern "C" fn ftxGetLibVersionStr(to: TextOut, size: u32) -> u32 {
    text(to, size, || Some(Version::reported().text()))
}

/// The version of ftMscLibEx, under the name that its header gives `ftxGetLibVersion`.
#[no_mangle]
pub(crate) extern "C" fn ftxGetLibVersionEx() -> u32 {
    VERSION_OF_EX.code()
}

/// The version of ftMscLibEx, under the name that its header gives `ftxGetLibVersionStr`.
#[no_mangle]
pub(crate) extern "C" fn ftxGetLibVersionStrEx(to: TextOut, size: u32) -> u32 {
    text(to, size, || Some(VERSION_OF_EX.text()))
}

/// The name of an error code (kind 0), or what it means (kind 1).
#[no_mangle]
pub(crate) extern "C" fn ftxGetLibErrorString(
    error: u32,
    kind: u32,
    to: TextOut,
    size: u32,
) -> u32 {
    text(to, size, || {
        let code = CODES.iter().find(|code| code.value == error)?;
        match kind {
            0 => Some(code.name.to_owned()),
            1 => Some(code.text.to_owned()),
            _ => None,
        }
    })
}

/// The serial number, which a TXT does not send.
#[no_mangle]
pub(crate) extern "C" fn ftxGetSerialNrStrg(_handle: Handle, to: TextOut, size: u32) -> u32 {
    text(to, size, || None)
}

/// The firmware of the device.
#[no_mangle]
pub(crate) extern "C" fn ftxGetFirmwareStrg(handle: Handle, to: TextOut, size: u32) -> u32 {
    device_text(handle, to, size, firmware_text)
}

/// The maker of the device. As its manual says, the original does not read this and the next two from the device, and
/// programs may compare them.
#[no_mangle]
pub(crate) extern "C" fn ftxGetManufacturerStrg(handle: Handle, to: TextOut, size: u32) -> u32 {
    device_text(handle, to, size, |_| "MSC Vertriebs GmbH".to_owned())
}

/// The kind of the device.
#[no_mangle]
pub(crate) extern "C" fn ftxGetShortNameStrg(handle: Handle, to: TextOut, size: u32) -> u32 {
    device_text(handle, to, size, |_| "ROBO TX Controller".to_owned())
}

/// The same: the original's long name is its short one.
#[no_mangle]
pub(crate) extern "C" fn ftxGetLongNameStrg(handle: Handle, to: TextOut, size: u32) -> u32 {
    ftxGetShortNameStrg(handle, to, size)
}

/// The name that its owner gave the controller.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxDevName(
    handle: Handle,
    controller: c_int,
    to: TextOut,
    size: u32,
) -> u32 {
    master_text(handle, controller, to, size, |device| {
        device.name().chars().take(NAME_MAX).collect()
    })
}

/// The controller's Bluetooth address. A TXT does not send it, so it is 0, as in the area.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxBtAddr(
    handle: Handle,
    controller: c_int,
    to: TextOut,
    size: u32,
) -> u32 {
    master_text(handle, controller, to, size, |_| "00:00:00:00:00:00".to_owned())
}

/// The controller's firmware.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxFwStr(
    handle: Handle,
    controller: c_int,
    to: TextOut,
    size: u32,
) -> u32 {
    master_text(handle, controller, to, size, firmware_text)
}

/// The controller's firmware as a number, after that of the library that a TX has stored: 00 06 04 06 for 4.6.6.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxFwVal(handle: Handle, controller: c_int, to: Out<u32>) -> u32 {
    with_area(handle, controller, |device, _| match controller {
        0 => to.put(u32::from_be_bytes(ta_firmware(device.firmware()))),
        _ => Err(FTLIB_ERR_FAILED),
    })
}

/// The controller's hardware, which a TXT does not send.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxHwStr(
    _handle: Handle,
    _controller: c_int,
    to: TextOut,
    size: u32,
) -> u32 {
    text(to, size, || None)
}

/// The controller's serial number, which a TXT does not send.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxSerialStr(
    _handle: Handle,
    _controller: c_int,
    to: TextOut,
    size: u32,
) -> u32 {
    text(to, size, || None)
}

/// The number of the library that a TX has stored, in two digits.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxDllStr(
    handle: Handle,
    controller: c_int,
    to: TextOut,
    size: u32,
) -> u32 {
    master_text(handle, controller, to, size, |_| format!("{ROBOLIB_DLL:02}"))
}

/// Renews the information in an area. It is always what is known.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxInfo(handle: Handle, controller: c_int) -> u32 {
    with_area(handle, controller, |_, _| Ok(()))
}

/// Whether the master is online: `FTLIB_ERR_SUCCESS` or `FTLIB_ERR_THREAD_NOT_RUNNING`.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxMasterState(handle: Handle) -> u32 {
    with_device(handle, |device| {
        let is_running = device.session().is_running();
        is_running.then_some(()).ok_or(FTLIB_ERR_THREAD_NOT_RUNNING)
    })
}

/// Which extensions are online.
fn extensions(device: &Arc<Device>) -> [bool; AREAS - 1] {
    let alive = device.array().load(device.array().places(0).extensions);
    let is_running = device.session().is_running();
    alive.map(|alive| is_running && alive != 0)
}

/// Which extensions are online: bit 0 for the first one.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxSlaveState(handle: Handle, state: Out<u8>) -> u32 {
    with_device(handle, |device| {
        let bits = extensions(device).into_iter().enumerate();
        state.put(bits.fold(0, |bits, (index, online)| bits | u8::from(online) << index))
    })
}

/// Whether an extension is online, by the index of its area, from 1.
#[no_mangle]
pub(crate) extern "C" fn GetRoboTxSlaveAlive(
    handle: Handle,
    slave: c_int,
    alive: Out<c_int>,
) -> u32 {
    with_device(handle, |device| match index(slave, AREAS)? {
        0 => Err(FTLIB_ERR_INVALID_PARAM),
        area => alive.put(extensions(device)[area - 1].into()),
    })
}

/// How many transfers were begun.
#[no_mangle]
pub(crate) extern "C" fn GetSessionId() -> u32 {
    guarded(0, || LIBRARY.sessions())
}

/// Statistics of the transfer: exchanges, configurations sent, late reactions since the last reset; the last,
/// the shortest and the longest cycle in microseconds.
#[no_mangle]
pub(crate) extern "C" fn GetTrapStatistic(
    handle: Handle,
    exchanges: Out<u32>,
    configurations: Out<u32>,
    late: Out<u32>,
    last: Out<u32>,
    shortest: Out<u32>,
    longest: Out<u32>,
) -> u32 {
    with_device(handle, |device| {
        let places = [exchanges, configurations, late, last, shortest, longest];
        places.into_iter().try_for_each(Out::check)?;
        let (now, forgotten) = device.statistics();
        let values = [
            now.cycles.saturating_sub(forgotten.cycles),
            now.config_updates.saturating_sub(forgotten.config_updates),
            now.late_reactions.saturating_sub(forgotten.late_reactions),
            now.last_cycle.as_micros() as u64,
            now.shortest_cycle.as_micros() as u64,
            now.longest_cycle.as_micros() as u64,
        ];
        let limited = values.map(|value| u32::try_from(value).unwrap_or(u32::MAX));
        places.into_iter().zip(limited).try_for_each(|(place, value)| place.put(value))
    })
}

/// Counts exchanges, configurations and late reactions from 0 again.
#[no_mangle]
pub(crate) extern "C" fn ResetTrapStatistic(handle: Handle) {
    // There is no answer to give for a wrong handle.
    let _ = with_device(handle, |device| {
        device.reset_statistics();
        Ok(())
    });
}
