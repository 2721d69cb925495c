//! The functions of programs for the TXT itself: KeLibTxt, MotorIOLib and what `KeLibTxtDl.h` declares.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::ops::ControlFlow;
use std::ptr;
use std::slice;
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::FishX1Transfer;
use ft_transfer_area::{Error, I2cClient, TransferMode};
use parking_lot::{Mutex, ReentrantMutex};

use crate::exit;
use crate::ffi::guarded;
use crate::host;
use crate::i2c::DEVICE_MAX as I2C_DEVICE_MAX;
use crate::inside;
use crate::memory::AREAS;
use crate::mirror::DEV_MODE_LOCAL;
use crate::report::{self, Repeated};
use crate::session::{ProgramSession, SessionSettings};

const NONE: u32 = 0;
const UNDEFINED: u32 = 0x0001;
const LIB_NOT_INIT: u32 = 0x0100;
const ZERO_POINTER: u32 = 0x1050;
const I2C_OPEN: u32 = 0x1701;
const I2C_ADDRESS: u32 = 0x1702;
const I2C_READ: u32 = 0x1703;
const I2C_WRITE: u32 = 0x1704;
const I2C_WRITE_READ: u32 = 0x1705;
const I2C_NO_WRITE_NO_READ: u32 = 0x170E;
const I2C_COMMUNICATION: u32 = 0x170F;
const TXT_BUSY: u32 = 0x1C03;
const THREAD_NOT_STARTABLE: u32 = 0x1C04;

/// The program's function, and how long taking it away waits for one that is running. It returns a C `bool`, which a
/// program in C may fill with any byte.
type Callback = extern "C" fn(*mut FishX1Transfer, i32) -> u8;
const CALLBACK_LIMIT: Duration = Duration::from_millis(500);

/// The areas stay from the first start to the end of the program, which keeps a pointer to them.
static SESSION: Mutex<Option<Arc<ProgramSession<FishX1Transfer>>>> = Mutex::new(None);
static CALLBACK: Mutex<Option<Callback>> = Mutex::new(None);
/// Held while the callback runs. The callback itself may set another one.
static CALLED: ReentrantMutex<()> = ReentrantMutex::new(());
static I2C: Mutex<Option<I2cClient>> = Mutex::new(None);
/// What was said of I2C.
static TOLD: LazyLock<Mutex<Repeated>> = LazyLock::new(Mutex::default);

/// Declares a function under its name in C, and under the one that g++ and clang make of it in C++.
macro_rules! with_both_linkages {
    ($(#[doc = $doc:literal])+ $name:ident, $cpp:ident = $mangled:literal,
     ($($argument:ident: $type:ty)?) -> $result:ty, $run:expr) => {
        $(#[doc = $doc])+
        #[no_mangle]
        pub extern "C" fn $name($($argument: $type)?) -> $result {
            $run($($argument)?)
        }

        #[doc = concat!("`", stringify!($name), "` with C++ linkage.")]
        #[export_name = $mangled]
        pub extern "C" fn $cpp($($argument: $type)?) -> $result {
            $run($($argument)?)
        }
    };
}

with_both_linkages!(
    /// Connects and begins to exchange. Returns after the first response.
    StartTxtDownloadProg, start_cpp = "_Z20StartTxtDownloadProgv", () -> u32, start
);
with_both_linkages!(
    /// Ends the exchange with all motors off.
    StopTxtDownloadProg, stop_cpp = "_Z19StopTxtDownloadProgv", () -> u32, stop
);
with_both_linkages!(
    /// Whether areas are exchanged.
    MotorIOLib_ThreadIsRunning, is_running_cpp = "_Z26MotorIOLib_ThreadIsRunningv", () -> bool, is_running
);
with_both_linkages!(
    /// Has this function called after each exchange; null takes it away.
    SetTransferAreaCompleteCallback,
    set_callback_cpp = "_Z31SetTransferAreaCompleteCallbackPFbP8shm_if_siE",
    (callback: Option<Callback>) -> (), set_callback
);

fn start() -> u32 {
    guarded(UNDEFINED, || {
        let mut session = SESSION.lock();
        let result = match &*session {
            Some(session) => session.start(),
            None => begin().map(|begun| *session = Some(begun)),
        };
        match result {
            Ok(()) => NONE,
            Err(error) => {
                if !report::is_told_by_code(&error) {
                    report::failure(&error);
                }
                match error {
                    Error::AlreadyStarted => TXT_BUSY,
                    _ => THREAD_NOT_STARTABLE,
                }
            }
        }
    })
}

fn begin() -> Result<Arc<ProgramSession<FishX1Transfer>>, Error> {
    let settings = SessionSettings {
        host: host::or_auto(),
        dev_mode: DEV_MODE_LOCAL,
        areas: AREAS,
        mode: host::mode_for(TransferMode::Compressed),
    };
    let session = Arc::new(ProgramSession::new(&settings, None)?);
    let areas = session.array().as_ptr() as usize;
    session.set_cycle_call(Some(Box::new(move || call(areas as *mut FishX1Transfer))));
    session.start()?;
    exit::watch(&session);
    Ok(session)
}

/// Calls the program's function, if there is one.
fn call(areas: *mut FishX1Transfer) -> ControlFlow<()> {
    let _called = CALLED.lock();
    let callback = *CALLBACK.lock();
    match callback {
        Some(callback) if inside::leave(|| callback(areas, AREAS as i32)) == 0 => {
            ControlFlow::Break(())
        }
        _ => ControlFlow::Continue(()),
    }
}

fn stop() -> u32 {
    guarded(UNDEFINED, || {
        // Not locked while it ends: a callback may wait for the lock.
        let session = SESSION.lock().clone();
        let stopped = session.map(|session| session.stop());
        *I2C.lock() = None;
        match stopped {
            None => LIB_NOT_INIT,
            Some(Ok(()) | Err(Error::NotStarted)) => NONE,
            Some(Err(error)) => {
                report::failure(error);
                UNDEFINED
            }
        }
    })
}

fn is_running() -> bool {
    guarded(false, || SESSION.lock().as_ref().is_some_and(|session| session.is_running()))
}

fn set_callback(callback: Option<Callback>) {
    guarded((), || {
        // So one that was taken away is not called afterwards; but one that hangs is not waited for.
        let _called = CALLED.try_lock_for(CALLBACK_LIMIT);
        *CALLBACK.lock() = callback;
    });
}

/// The nine areas; null before the start. They stay where they are until the program ends.
#[no_mangle]
pub extern "C" fn GetKeLibTransferAreaMainAddress() -> *mut FishX1Transfer {
    guarded(ptr::null_mut(), || {
        SESSION.lock().as_ref().map_or(ptr::null_mut(), |session| session.array().as_ptr())
    })
}

/// Makes I2C requests possible, which on a TXT needs an exchange: begins it if the program has not.
#[no_mangle]
pub extern "C" fn InitI2C() -> u32 {
    guarded(UNDEFINED, || match connect_i2c() {
        Ok(client) => {
            *I2C.lock() = Some(client);
            NONE
        }
        Err(error) => {
            tell(&error);
            I2C_OPEN
        }
    })
}

fn connect_i2c() -> Result<I2cClient, Error> {
    let session = {
        let mut session = SESSION.lock();
        match &*session {
            Some(session) => Arc::clone(session),
            None => Arc::clone(session.insert(begin()?)),
        }
    };
    session.handler().i2c()
}

/// Writes to an I2C device, then reads from it. The clock is the TXT's.
///
/// # Safety
///
/// `write` has `n_write` bytes, and `read` has `n_read` bytes that the program gives to this call alone.
#[no_mangle]
pub unsafe extern "C" fn KeLibI2cTransfer(
    device: u8,
    n_write: u16,
    write: *const u8,
    n_read: u16,
    read: *mut u8,
    _clock_400khz: u16,
) -> u32 {
    guarded(UNDEFINED, || {
        let (n_write, n_read) = (usize::from(n_write), usize::from(n_read));
        if n_write == 0 && n_read == 0 {
            return I2C_NO_WRITE_NO_READ;
        }
        if (n_write != 0 && write.is_null()) || (n_read != 0 && read.is_null()) {
            return ZERO_POINTER;
        }
        let mut values = vec![0; n_read];
        let bytes = match n_write {
            0 => &[],
            // SAFETY: not null, and as long as the caller promises.
            _ => unsafe { slice::from_raw_parts(write, n_write) },
        };
        match transfer(device, bytes, &mut values) {
            Ok(()) => {
                // SAFETY: as long as the caller promises; a null pointer has length 0.
                unsafe { read.copy_from_nonoverlapping(values.as_ptr(), n_read) };
                NONE
            }
            Err(code) => code,
        }
    })
}

/// Makes the connection if the program did not, or it was lost.
fn transfer(device: u8, write: &[u8], read: &mut [u8]) -> Result<(), u32> {
    let mut client = I2C.lock();
    if client.is_none() {
        let connected = connect_i2c().map_err(|error| {
            tell(&error);
            I2C_OPEN
        })?;
        *client = Some(connected);
    }
    let Some(client) = &mut *client else { return Err(I2C_OPEN) };
    client.write_read(device, write, read).map_err(|error| code_of(&error, device, write, read))
}

/// Says what went wrong. A program may read a device in a loop.
fn tell(error: &Error) {
    if let Some(line) = TOLD.lock().line(&format!("{error:#}"), Instant::now()) {
        report::failure(line);
    }
}

fn code_of(error: &Error, device: u8, write: &[u8], read: &[u8]) -> u32 {
    let what_was_done = match (write, read) {
        (_, []) => I2C_WRITE,
        ([], _) => I2C_READ,
        _ => I2C_WRITE_READ,
    };
    match error {
        // Programs look for devices in this way.
        Error::I2cNoDevice { .. } => what_was_done,
        Error::OutOfRange { .. } => {
            tell(error);
            if device > I2C_DEVICE_MAX {
                I2C_ADDRESS
            } else {
                what_was_done
            }
        }
        _ => {
            tell(error);
            I2C_COMMUNICATION
        }
    }
}
