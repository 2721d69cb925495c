//! What the tests work with: simulated TXTs, an initialized library, areas of open devices.

use std::ffi::{c_char, c_int, CString};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{
    BtStatus, Change, Config, Info, InputValues, OutputValues, Status, Timer,
};
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

use super::api::*;

/// More than any wait takes.
pub(crate) const LIMIT: Duration = Duration::from_secs(20);
/// The variables that the library reads, one set at a time.
const VARIABLES: [&str; 3] = ["FT_TXT_HOST", "FT_TXT_PORTS", "FT_TXT_MODE"];

/// There is one library in a process, so one test has it at a time.
static IN_USE: Mutex<()> = Mutex::new(());

/// The initialized library, for one test.
pub(crate) struct Initialized {
    _in_use: MutexGuard<'static, ()>,
}

pub(crate) fn initialized() -> Initialized {
    let library = not_initialized();
    assert_eq!(ftxInitLib(), SUCCESS);
    library
}

/// The library for a test that initializes it itself.
pub(crate) fn not_initialized() -> Initialized {
    let in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
    VARIABLES.iter().for_each(|name| std::env::remove_var(name));
    Initialized { _in_use: in_use }
}

impl Initialized {
    /// Sets a variable for this test. Nothing else of the process reads variables meanwhile.
    pub(crate) fn set(&self, name: &str, value: &str) {
        assert!(VARIABLES.contains(&name));
        std::env::set_var(name, value);
    }

    /// Does this in both exchanges, with a device that has begun its transfer.
    pub(crate) fn in_both_exchanges(&self, test: impl Fn(&SimulatedTxt, Device)) {
        for mode in ["compressed", "simple"] {
            self.set("FT_TXT_MODE", mode);
            let txt = txt();
            let device = Device::open(&txt);
            device.start();
            test(&txt, device);
            assert_eq!(ftxCloseDevice(device.0), SUCCESS, "{mode}");
        }
    }
}

impl Drop for Initialized {
    fn drop(&mut self) {
        ftxCloseLib();
    }
}

pub(crate) fn txt() -> SimulatedTxt {
    start(SimulatedTxt::builder())
}

pub(crate) fn start(builder: SimulatedTxtBuilder) -> SimulatedTxt {
    builder.start().expect("three free ports")
}

/// Waits until something is true.
pub(crate) fn wait(what: &str, mut condition: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(begin.elapsed() < LIMIT, "{what} does not happen");
        thread::sleep(Duration::from_millis(1));
    }
}

/// Waits until the machine is so.
pub(crate) fn machine(txt: &SimulatedTxt, what: &str, condition: impl FnMut(&Machine) -> bool) {
    assert!(txt.wait_until(condition, LIMIT), "{what} does not happen");
}

/// The machine stands still, and its client has left.
pub(crate) fn stands(txt: &SimulatedTxt) {
    machine(txt, "the end", |machine| {
        let off =
            |controller: &ft_transfer_area_simulator::Controller| controller.outputs.duty == [0; 8];
        !machine.online() && machine.controllers.iter().all(off)
    });
}

/// The text that a function writes, and what it returns.
pub(crate) fn text(get: impl Fn(*mut c_char, u32) -> u32) -> (String, u32) {
    let mut buffer = [1_u8; 100];
    let length = get(buffer.as_mut_ptr().cast(), buffer.len() as u32);
    let end = buffer.iter().position(|byte| *byte == 0).expect("a text ends with 0");
    (String::from_utf8(buffer[..end].to_vec()).expect("UTF-8"), length)
}

/// Opens a port, and returns the handle and the error.
pub(crate) fn open(port: &str) -> (Handle, u32) {
    let (port, mut error) = (CString::new(port).expect("no 0 within"), u32::MAX);
    (ftxOpenComDevice(port.as_ptr(), 38_400, &mut error), error)
}

/// An open device.
#[derive(Clone, Copy)]
pub(crate) struct Device(pub(crate) Handle);

// SAFETY: a handle is a number.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    pub(crate) fn open(txt: &SimulatedTxt) -> Self {
        let (handle, error) = open(&txt.address().to_string());
        assert_eq!(error, SUCCESS);
        assert!(!handle.is_null());
        Self(handle)
    }

    /// By a method, so that a closure has the whole device and may go to another thread.
    pub(crate) fn handle(&self) -> Handle {
        self.0
    }

    pub(crate) fn start(&self) {
        assert_eq!(ftxStartTransferArea(self.0), SUCCESS);
    }

    pub(crate) fn area(&self, controller: usize) -> *mut Ta {
        let first = GetTransferAreasArrayAddr(self.0).cast::<Ta>();
        assert!(!first.is_null());
        first.wrapping_add(controller)
    }

    pub(crate) fn input(&self, controller: usize) -> InputValues {
        // SAFETY: the device is open; a program reads its areas so.
        unsafe { (&raw const (*self.area(controller)).input).read_volatile() }
    }

    /// Waits until a response has come in and all that it says was reported.
    pub(crate) fn pass(&self) {
        // SAFETY: the device is open; a program reads its areas so.
        let time = || unsafe { (&raw const (*self.area(0)).timer.timer_1ms).read_volatile() };
        for _ in 0..2 {
            let before = time();
            wait("a response", || time() != before);
        }
    }

    pub(crate) fn output(&self, controller: usize) -> OutputValues {
        // SAFETY: the device is open; a program reads its areas so.
        unsafe { (&raw const (*self.area(controller)).output).read_volatile() }
    }

    /// Writes fields of the outputs without a call of the library.
    pub(crate) fn change_output(&self, controller: usize, change: impl FnOnce(&mut OutputValues)) {
        let mut output = self.output(controller);
        change(&mut output);
        // SAFETY: the device is open; a program writes its areas so.
        unsafe { (&raw mut (*self.area(controller)).output).write_volatile(output) };
    }

    pub(crate) fn set_duty(&self, controller: usize, output: usize, duty: i16) {
        assert!(output < 8);
        // SAFETY: the device is open; a program writes its areas so.
        unsafe {
            let duties = &raw mut (*self.area(controller)).output.duty;
            duties.cast::<i16>().add(output).write_volatile(duty);
        }
    }

    pub(crate) fn status(&self, controller: c_int) -> u8 {
        let status = GetTransferAreaStatusAddr(self.0, controller);
        // SAFETY: the device is open; a program reads its areas so.
        unsafe { status.read_volatile() }
    }
}

/// `TA` as a C compiler lays it out for this machine, as far as the tests look at it.
#[repr(C)]
pub(crate) struct Ta {
    pub(crate) info: Info,
    pub(crate) state: State,
    pub(crate) config: Config,
    pub(crate) input: InputValues,
    pub(crate) output: OutputValues,
    display_message: [u8; 100],
    display_frame: (*mut u8, [u16; 2]),
    pub(crate) status: Status,
    pub(crate) change: Change,
    pub(crate) timer: Timer,
    reserved_1: [u8; 28],
    hooks: [*const u8; 36],
    reserved_2: [u8; 356],
}

#[repr(C)]
pub(crate) struct State {
    pgm_initialized: u8,
    reserved_1: [u8; 7],
    pub(crate) dev_mode: u8,
    pub(crate) id: u8,
    pub(crate) info_id: u8,
    pub(crate) config_id: u8,
    pub(crate) ext_dev_connect_state: [u8; 8],
    btstatus: [BtStatus; 8],
    reserved_2: [u8; 8],
    program: *mut u8,
    program_state: [u8; 4],
}
