//! The functions of programs for the TXT itself: KeLibTxt, MotorIOLib and what `KeLibTxtDl.h` declares.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::ops::ControlFlow;
use std::slice;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Duration;

use ft_transfer_area::transfer_area::FishX1Transfer;
use ft_transfer_area::{Error, I2cClient, TransferMode};
use parking_lot::{Mutex, ReentrantMutex};

use crate::exit;
use crate::ffi::guarded;
use crate::host;
use crate::i2c::DEVICE_MAX as I2C_DEVICE_MAX;
use crate::inside;
use crate::memory::{areas_of_program, AreaArray, AREAS};
use crate::mirror::{Mirror, DEV_MODE_LOCAL};
use crate::report;
use crate::session::{ProgramSession, SessionSettings};

const NONE: u32 = 0;
const UNDEFINED: u32 = 0x0001;
/// What stopping returns, well or not.
const STOPPED: u32 = 0x0001;
const ZERO_POINTER: u32 = 0x1050;
const I2C_OPEN: u32 = 0x1701;
const I2C_READ: u32 = 0x1703;
const I2C_WRITE: u32 = 0x1704;
const I2C_NO_WRITE_NO_READ: u32 = 0x170E;
const I2C_COMMUNICATION: u32 = 0x170F;
const THREAD_NOT_STARTABLE: u32 = 0x1C04;

/// The program's function, and how long taking it away waits for one that is running. It returns a C `bool`, which a
/// program in C may fill with any byte.
type Callback = extern "C-unwind" fn(*mut FishX1Transfer, i32) -> u8;
const CALLBACK_LIMIT: Duration = Duration::from_millis(500);

/// That of the first start, which is begun again by the next one.
static SESSION: Mutex<Option<Arc<ProgramSession<FishX1Transfer>>>> = Mutex::new(None);
static CALLBACK: Mutex<Option<Callback>> = Mutex::new(None);
/// Held while the callback runs. The callback itself may set another one.
static CALLED: ReentrantMutex<()> = ReentrantMutex::new(());
static I2C: Mutex<Option<I2c>> = Mutex::new(None);
/// Whether there has been I2C: the first start makes it, if `InitI2C` has not done so before.
static I2C_MADE: AtomicBool = AtomicBool::new(false);

/// What `InitI2C` or the first start has made, until the exchange ends.
struct I2c {
    /// `None` while it is to be taken from the program's exchange.
    client: Option<I2cClient>,
    /// An exchange for I2C alone.
    alone: Option<Arc<ProgramSession<FishX1Transfer>>>,
}

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
            Some(session) if session.is_running() => {
                session.renew();
                Ok(())
            }
            Some(session) => begin_again(session),
            None => begin().map(|begun| *session = Some(begun)),
        };
        match result {
            Ok(()) => NONE,
            Err(error) => {
                report::failure(&error);
                THREAD_NOT_STARTABLE
            }
        }
    })
}

fn begin() -> Result<Arc<ProgramSession<FishX1Transfer>>, Error> {
    let array = Arc::new(AreaArray::of_program());
    let mirror = Mirror::on_txt(Arc::clone(&array));
    let session = Arc::new(ProgramSession::over(mirror, array, &settings(), None)?);
    session.set_cycle_call(Some(Box::new(call)));
    exit::watch(&session);
    begin_again(&session)?;
    Ok(session)
}

fn settings() -> SessionSettings {
    SessionSettings {
        host: host::or_auto(),
        dev_mode: DEV_MODE_LOCAL,
        areas: AREAS,
        mode: host::mode_for(TransferMode::Compressed),
    }
}

/// Nothing of what was in the areas stays.
fn begin_again(session: &ProgramSession<FishX1Transfer>) -> Result<(), Error> {
    let mut i2c = I2C.lock();
    if let Some(i2c) = i2c.as_mut().filter(|i2c| i2c.alone.is_some()) {
        // The controller serves one exchange at a time. The next request goes over the program's: whether there is I2C
        // does not decide whether the exchange has begun.
        *i2c = I2c { client: None, alone: None };
    }
    session.clear();
    session.start()?;
    if !I2C_MADE.swap(true, Ordering::Relaxed) {
        *i2c = Some(I2c { client: None, alone: None });
    }
    Ok(())
}

/// Calls the program's function, if there is one.
fn call() -> ControlFlow<Option<String>> {
    let _called = CALLED.lock();
    let callback = *CALLBACK.lock();
    match callback {
        Some(callback) if inside::leave(|| callback(areas_of_program(), AREAS as i32)) == 0 => {
            *CALLBACK.lock() = None;
            ControlFlow::Break(None)
        }
        _ => ControlFlow::Continue(()),
    }
}

/// Takes the callback away, too, and ends I2C.
fn stop() -> u32 {
    guarded(STOPPED, || {
        // Not locked while it ends: a callback may wait for the lock.
        let session = SESSION.lock().clone();
        match session.map(|session| session.stop()) {
            None | Some(Ok(()) | Err(Error::NotStarted)) => {}
            Some(Err(error)) => report::failure(error),
        }
        *I2C.lock() = None;
        set_callback(None);
        STOPPED
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

/// The nine areas, which are where they are from the beginning of the program to its end.
#[no_mangle]
pub extern "C" fn GetKeLibTransferAreaMainAddress() -> *mut FishX1Transfer {
    areas_of_program()
}

/// Makes I2C requests possible, until the exchange ends. A TXT in online mode has no I2C without an exchange, so one
/// begins if there is none, with areas that the program does not see.
#[no_mangle]
pub extern "C" fn InitI2C() -> u32 {
    guarded(UNDEFINED, || {
        // Not locked during another request: ending the exchange needs it.
        let session = SESSION.lock().clone();
        let mut i2c = I2C.lock();
        let serving = i2c.as_ref().and_then(|i2c| i2c.alone.as_ref().or(session.as_ref()));
        if serving.is_some_and(|serving| serving.is_running()) {
            return NONE;
        }
        match connect_i2c(session.as_deref()) {
            Ok(connected) => {
                *i2c = Some(connected);
                I2C_MADE.store(true, Ordering::Relaxed);
                NONE
            }
            Err(error) => {
                report::failure(format_args!("{error:#}"));
                I2C_OPEN
            }
        }
    })
}

fn connect_i2c(session: Option<&ProgramSession<FishX1Transfer>>) -> Result<I2c, Error> {
    if let Some(session) = session.filter(|session| session.is_running()) {
        return Ok(I2c { client: Some(session.handler().i2c()?), alone: None });
    }
    let alone = Arc::new(ProgramSession::new(&settings(), None)?);
    exit::watch(&alone);
    alone.start()?;
    Ok(I2c { client: Some(alone.handler().i2c()?), alone: Some(alone) })
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

fn transfer(device: u8, write: &[u8], read: &mut [u8]) -> Result<(), u32> {
    let other = if read.is_empty() { I2C_WRITE } else { I2C_READ };
    // Not locked during another request: ending the exchange needs it.
    let session = SESSION.lock().clone();
    let mut i2c = I2C.lock();
    let session = session.filter(|session| session.is_running());
    let result = match (&mut *i2c, session) {
        (Some(I2c { client: Some(client), .. }), _) => client.write_read(device, write, read),
        (Some(I2c { client, .. }), Some(session)) => session
            .handler()
            .i2c()
            .and_then(|first| client.insert(first).write_read(device, write, read)),
        (Some(_), None) | (None, _) => {
            report::failure("I2C begins with InitI2C or the first start, and ends with StopTxtDownloadProg or a start that fails");
            return Err(other);
        }
    };
    match result {
        Ok(()) => Ok(()),
        // Programs look for devices in this way.
        Err(Error::I2cNoDevice { .. }) => Err(I2C_COMMUNICATION),
        Err(_) if device > I2C_DEVICE_MAX => Err(I2C_COMMUNICATION),
        Err(error) => {
            report::failure(format_args!("{error:#}"));
            Err(other)
        }
    }
}
