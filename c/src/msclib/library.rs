//! The state of the library.

use std::ffi::c_void;
use std::sync::Arc;
use std::time::Duration;

use ft_transfer_area::{
    controller_address, find_controllers, Error, FoundController, SearchOptions,
};
use parking_lot::Mutex;

use super::arguments::Handle;
use super::callbacks::{self, Callbacks, Owner};
use super::device::Device;
use crate::errors::{
    FTLIB_ERR_DEVICE_IS_OPEN, FTLIB_ERR_DEVICE_NOT_OPEN, FTLIB_ERR_LIB_IS_INITIALIZED,
    FTLIB_ERR_LIB_IS_NOT_INITIALIZED, FTLIB_ERR_OPEN_COM, FTLIB_ERR_THREAD_NOT_STARTABLE,
    FTLIB_ERR_UNKNOWN_DEVICE_HANDLE, FTLIB_ERR_WRONG_HOSTNAME_LEN,
};
use crate::exit::{self, side_by_side, Transfer};
use crate::host;
use crate::ports::{number_of, Ports};
use crate::report;

/// How long opening a device waits for its controller.
const OPEN_LIMIT: Duration = Duration::from_secs(3);
/// The longest name of a host.
const HOST_MAX: usize = 253;
/// The first handle. It fits into 32 bits, and nobody passes it by mistake.
const FIRST_HANDLE: usize = 0x4654_0004;
/// Between two handles.
const STEP: usize = 4;

/// The library that the exported functions belong to.
pub(super) static LIBRARY: Library = Library { state: Mutex::new(State::new()) };

/// What all threads share. The lock is held for a moment only, and not while anything else is waited for.
pub(super) struct Library {
    state: Mutex<State>,
}

struct State {
    /// There while the library is initialized.
    callbacks: Option<Arc<Callbacks>>,
    /// Those that are open or being closed.
    devices: Vec<Arc<Device>>,
    /// The hosts of those that are being opened.
    opening: Vec<String>,
    /// How many handles were given.
    handles: usize,
    /// The host that the program has named, in place of which another one was chosen.
    replaced: Option<String>,
    /// How many transfers were begun.
    sessions: u32,
}

impl State {
    const fn new() -> Self {
        Self {
            callbacks: None,
            devices: Vec::new(),
            opening: Vec::new(),
            handles: 0,
            replaced: None,
            sessions: 0,
        }
    }

    fn callbacks(&self) -> Result<Arc<Callbacks>, u32> {
        self.callbacks.clone().ok_or(FTLIB_ERR_LIB_IS_NOT_INITIALIZED)
    }

    fn find(&self, handle: Handle) -> Result<Arc<Device>, u32> {
        let handle = handle as usize;
        let is_it = |device: &&Arc<Device>| device.handle() == handle && device.is_open();
        self.devices.iter().find(is_it).cloned().ok_or_else(|| self.why_not_open(handle))
    }

    fn why_not_open(&self, handle: usize) -> u32 {
        let number = handle.checked_sub(FIRST_HANDLE).filter(|number| number % STEP == 0);
        match number {
            Some(number) if number / STEP < self.handles => FTLIB_ERR_DEVICE_NOT_OPEN,
            _ => FTLIB_ERR_UNKNOWN_DEVICE_HANDLE,
        }
    }
}

impl Library {
    /// Starts the library.
    pub(super) fn initialize(&self) -> Result<(), u32> {
        report::start();
        let mut state = self.state.lock();
        if state.callbacks.is_some() {
            return Err(FTLIB_ERR_LIB_IS_INITIALIZED);
        }
        state.callbacks = Some(Callbacks::start().map_err(|error| {
            report::failure(format_args!("no thread for callbacks could be started: {error}"));
            FTLIB_ERR_THREAD_NOT_STARTABLE
        })?);
        Ok(())
    }

    /// Closes all devices and ends the library. Threads that are in a call get its error.
    pub(super) fn close(&self) -> Result<(), u32> {
        let callbacks =
            self.state.lock().callbacks.take().ok_or(FTLIB_ERR_LIB_IS_NOT_INITIALIZED)?;
        self.close_devices();
        callbacks::forget();
        callbacks.end();
        Ok(())
    }

    pub(super) fn is_initialized(&self) -> bool {
        self.state.lock().callbacks.is_some()
    }

    /// The callbacks while the library is initialized.
    pub(super) fn callbacks(&self) -> Option<Arc<Callbacks>> {
        self.state.lock().callbacks.clone()
    }

    /// The open device of a handle.
    pub(super) fn device(&self, handle: Handle) -> Result<Arc<Device>, u32> {
        let state = self.state.lock();
        state.callbacks()?;
        state.find(handle)
    }

    /// Whether a handle is one of an open device, also when the library is not initialized.
    pub(super) fn check_handle(&self, handle: Handle) -> Result<(), u32> {
        self.state.lock().find(handle).map(drop)
    }

    /// Opens the device that the program calls `name`.
    pub(super) fn open(&self, name: &str) -> Result<Handle, u32> {
        if name.trim().is_empty() || name.len() > HOST_MAX {
            return Err(FTLIB_ERR_WRONG_HOSTNAME_LEN);
        }
        let ports = Ports::configured();
        if let Some(chosen) = ports.chosen_for(name) {
            self.replace(name.trim(), chosen)?;
        }
        let host = ports.host_of(name).ok_or_else(|| {
            report::failure(format_args!(
                "{name}: no controller is named for it; see FT_TXT_PORTS and FT_TXT_HOST"
            ));
            FTLIB_ERR_OPEN_COM
        })?;
        let port = number_of(name);
        self.begin_open(&host, port)?;
        exit::watch_signals();
        let controller = find(&host);
        let mut state = self.state.lock();
        state.opening.retain(|opening| *opening != host);
        let controller = controller.map_err(|error| {
            report::failure(format_args!("{name}: {error:#}"));
            FTLIB_ERR_OPEN_COM
        })?;
        // Also when the library was closed meanwhile.
        let callbacks = state.callbacks()?;
        let address = controller.address;
        if let Some(open) = state.devices.iter().find(|it| it.controller().address == address) {
            return Err(open.why_not_again(port));
        }
        let handle = FIRST_HANDLE + state.handles * STEP;
        let device = Device::new(handle, host, port, controller, callbacks)?;
        state.handles += 1;
        state.devices.push(device);
        Ok(handle as *mut c_void)
    }

    /// Takes note of a host in place of which another one was chosen. That is not done for two: a program with two
    /// controllers must not drive one of them as both.
    fn replace(&self, name: &str, chosen: &str) -> Result<(), u32> {
        let mut state = self.state.lock();
        let first = state.replaced.get_or_insert_with(|| name.to_owned());
        if host::is_same(first, name) {
            return Ok(());
        }
        report::failure(format_args!(
            "{name}: tx_run has given the program one controller, {chosen}, which is {first} for it; for several start \
             tx_run without --host, --world and --show, and with FT_TXT_PORTS=\"COM4={first}, COM5={name}\""
        ));
        Err(FTLIB_ERR_OPEN_COM)
    }

    /// Sees to it that a host is opened by one thread only.
    fn begin_open(&self, host: &str, port: Option<u32>) -> Result<(), u32> {
        let mut state = self.state.lock();
        state.callbacks()?;
        if state.opening.iter().any(|opening| opening.eq_ignore_ascii_case(host)) {
            return Err(FTLIB_ERR_DEVICE_IS_OPEN);
        }
        if let Some(open) = state.devices.iter().find(|device| device.is_at(host)) {
            return Err(open.why_not_again(port));
        }
        state.opening.push(host.to_owned());
        Ok(())
    }

    /// Begins a device's transfer.
    pub(super) fn start(&self, device: &Arc<Device>) -> Result<(), u32> {
        device.start()?;
        let mut state = self.state.lock();
        state.sessions = state.sessions.wrapping_add(1);
        Ok(())
    }

    /// How many transfers were begun.
    pub(super) fn sessions(&self) -> u32 {
        self.state.lock().sessions
    }

    /// Closes a device. Afterwards no callback is made for it.
    pub(super) fn close_device(&self, device: &Arc<Device>) -> Result<(), u32> {
        let was_open = device.close();
        device.settle();
        self.state.lock().devices.retain(|other| !Arc::ptr_eq(other, device));
        was_open.then_some(()).ok_or(FTLIB_ERR_DEVICE_NOT_OPEN)
    }

    /// Closes all devices, side by side: one that does not answer does not keep the others moving.
    pub(super) fn close_devices(&self) {
        let state = self.state.lock();
        // Before anything that allocates: a handler may have interrupted the program where it does.
        state.devices.iter().for_each(|device| device.ask());
        let devices = state.devices.clone();
        drop(state);
        side_by_side(&devices, |device| _ = device.close());
        for device in &devices {
            // One that another thread closes is not an error.
            let _ = self.close_device(device);
        }
    }
}

/// Asks the controller at a host for its name.
fn find(host: &str) -> Result<FoundController, Error> {
    // A name may have several addresses, of which the first one that answers counts.
    let address = if host::is_auto(host) {
        controller_address(host, OPEN_LIMIT)?.to_string()
    } else {
        host.to_owned()
    };
    let options = SearchOptions::default().addresses([address]).limit(OPEN_LIMIT);
    find_controllers(&options)?.controllers.pop().ok_or(Error::NoController { tried: Vec::new() })
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv6Addr, SocketAddr, ToSocketAddrs};

    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;

    #[test]
    fn a_host_is_found_however_it_is_written() {
        let txt = SimulatedTxt::builder().start().unwrap();
        for host in ["127.0.0.1", "localhost", "auto", "AUTO"] {
            let found = find(&format!("{host}:{}", txt.port())).unwrap();
            assert_eq!(found.address, txt.address(), "{host}");
        }
    }

    #[test]
    fn all_addresses_of_a_name_are_tried() {
        let known: Vec<_> = ("localhost", 1).to_socket_addrs().unwrap().collect();
        let txt = SimulatedTxt::builder().bind(Ipv6Addr::LOCALHOST.into()).start();
        let Some(txt) = txt.ok().filter(|_| known.iter().any(SocketAddr::is_ipv6)) else {
            return eprintln!("skipped: localhost has no address of IPv6 here");
        };
        let found = find(&format!("localhost:{}", txt.port())).unwrap();
        assert_eq!(found.address, txt.address());
    }
}
