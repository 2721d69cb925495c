//! FtTxtLib's handler: areas of its own, exchanged by a thread.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::ffi::{c_char, c_void, CStr};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

use ft_transfer_area::channel::Receiver;
use ft_transfer_area::transfer_area::FishX1Transfer;
use ft_transfer_area::{CameraFrame, Error, I2cClient, TimeLimits, TransferMode, TxtClient};
use parking_lot::Mutex;

use crate::exit;
use crate::host;
use crate::inside;
use crate::jpeg::{self, Buffer};
use crate::memory::{AreaArray, AREAS};
use crate::mirror::{Mirror, DEV_MODE_ONLINE};
use crate::report;
use crate::session::{ProgramSession, SessionSettings};

/// It returns 0 to end the transfer, and may write why, as a text that ends with 0, into the bytes that it gets.
pub(super) type CycleFunction = extern "C-unwind" fn(*mut c_void, *mut c_char, usize) -> i32;

/// The function that is called after each response.
#[derive(Clone)]
pub(super) struct Cycle {
    function: CycleFunction,
    context: *mut c_void,
    /// Whether the handler was freed, perhaps by the function itself.
    freed: Arc<AtomicBool>,
}

// SAFETY: the program promises that the function may be called with the context in another thread.
unsafe impl Send for Cycle {}
// SAFETY: as above.
unsafe impl Sync for Cycle {}

impl Cycle {
    pub(super) fn new(function: CycleFunction, context: *mut c_void) -> Self {
        Self { function, context, freed: Arc::default() }
    }

    fn call(&self) -> ControlFlow<Option<String>> {
        let mut why = [0; 512];
        let (bytes, size) = (why.as_mut_ptr(), why.len());
        let goes_on = !self.freed.load(Ordering::Acquire)
            && inside::leave(|| (self.function)(self.context, bytes.cast(), size)) != 0;
        if goes_on && !self.freed.load(Ordering::Acquire) {
            return ControlFlow::Continue(());
        }
        let why = CStr::from_bytes_until_nul(&why).ok().filter(|why| !why.is_empty());
        ControlFlow::Break(why.map(|why| why.to_string_lossy().into_owned()))
    }
}

/// A handler. All calls may be made from any thread, also from the cycle's function.
pub struct Ex2 {
    pub(super) array: Arc<AreaArray<FishX1Transfer>>,
    count: usize,
    host: String,
    is_compressed: AtomicBool,
    cycle: Cycle,
    /// That of the last start.
    session: Mutex<Option<Arc<ProgramSession<FishX1Transfer>>>>,
    i2c: Mutex<Option<I2cClient>>,
    frames: Mutex<Option<Receiver<CameraFrame>>>,
    picture: Mutex<Buffer>,
    /// What was reported last, so that a loop that ignores errors does not fill the terminal.
    reported: Mutex<Option<Error>>,
}

impl Ex2 {
    pub(super) fn new(
        areas: i32,
        name: Option<&str>,
        port: Option<&str>,
        cycle: Cycle,
    ) -> Option<Self> {
        let count = usize::try_from(areas).ok().filter(|count| (1..=AREAS).contains(count))?;
        let host = host::from_environment().unwrap_or_else(|| host::of_kit(name, port));
        Some(Self {
            array: Arc::new(AreaArray::new()),
            count,
            host,
            is_compressed: AtomicBool::new(true),
            cycle,
            session: Mutex::default(),
            i2c: Mutex::default(),
            frames: Mutex::default(),
            picture: Mutex::default(),
            reported: Mutex::default(),
        })
    }

    /// Reports an error unless it is the one that was reported last.
    pub(super) fn report(&self, error: &Error) {
        let before = self.reported.lock().replace(error.clone());
        if before.as_ref() != Some(error) {
            report::failure(format_args!("{}: {error}", self.host));
        }
    }

    pub(super) fn areas(&self) -> *mut FishX1Transfer {
        self.array.as_ptr()
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    pub(super) fn session(&self) -> Option<Arc<ProgramSession<FishX1Transfer>>> {
        self.session.lock().clone()
    }

    /// The session, if its transfer runs.
    fn running(&self) -> Result<Arc<ProgramSession<FishX1Transfer>>, Error> {
        self.session().filter(|session| session.is_running()).ok_or(Error::NotStarted)
    }

    pub(super) fn start(&self) -> Result<(), Error> {
        let mut session = self.session.lock();
        if session.as_ref().is_some_and(|session| session.is_running()) {
            return Err(Error::AlreadyStarted);
        }
        let settings = self.settings();
        let new = match &*session {
            Some(before) => {
                // Its thread may still be at its end.
                let _ = before.stop();
                before.again(&settings)?
            }
            None => {
                let mirror = Mirror::new(Arc::clone(&self.array), settings.dev_mode);
                ProgramSession::over(mirror, Arc::clone(&self.array), &settings, None)?
            }
        };
        let cycle = self.cycle.clone();
        new.set_cycle_call(Some(Box::new(move || cycle.call())));
        let new = Arc::new(new);
        // Another controller may answer now.
        *self.frames.lock() = None;
        // Before it starts: its first cycle may ask for it.
        *session = Some(Arc::clone(&new));
        drop(session);
        exit::watch(&new);
        new.start()?;
        *self.reported.lock() = None;
        Ok(())
    }

    fn settings(&self) -> SessionSettings {
        let mode = if self.is_compressed.load(Ordering::Relaxed) {
            TransferMode::Compressed
        } else {
            TransferMode::Simple
        };
        SessionSettings {
            host: self.host.clone(),
            dev_mode: DEV_MODE_ONLINE,
            areas: self.count,
            mode: host::mode_for(mode),
        }
    }

    pub(super) fn stop(&self) -> Result<(), Error> {
        let session = self.running()?;
        *self.frames.lock() = None;
        session.stop()
    }

    pub(super) fn is_active(&self) -> bool {
        self.running().is_ok()
    }

    pub(super) fn set_mode(&self, compressed: bool) {
        self.is_compressed.store(compressed, Ordering::Relaxed);
    }

    pub(super) fn version(&self) -> Result<u32, Error> {
        if let Some(version) = self.session().and_then(|session| session.handler().version()) {
            return Ok(version.code());
        }
        exit::watch_signals();
        let mut client = TxtClient::connect(&self.host, TimeLimits::default())?;
        Ok(client.query_status()?.version.code())
    }

    pub(super) fn start_i2c(&self) -> Result<(), Error> {
        let client = self.running()?.handler().i2c()?;
        *self.i2c.lock() = Some(client);
        Ok(())
    }

    pub(super) fn stop_i2c(&self) -> bool {
        self.i2c.lock().take().is_some()
    }

    /// `settings`: width, height, frames per second, frequency of the mains.
    pub(super) fn start_camera(&self, settings: [i32; 4]) -> Result<(), Error> {
        let options = jpeg::camera_options(settings)?;
        let frames = self.running()?.handler().start_camera(options)?;
        *self.frames.lock() = Some(frames);
        Ok(())
    }

    pub(super) fn stop_camera(&self) -> Result<(), Error> {
        *self.frames.lock() = None;
        match self.session() {
            Some(session) => session.handler().stop_camera(),
            None => Ok(()),
        }
    }

    /// Where the next frame is, and its size.
    pub(super) fn frame(&self) -> Result<(*mut u8, usize), Error> {
        let session = self.session().ok_or(Error::NotStarted)?;
        let frames = self.frames.lock().clone().ok_or(Error::NotStarted)?;
        let mut picture = self.picture.lock();
        picture.next(&self.host, &frames).ok_or_else(|| {
            let handler = session.handler();
            handler.camera_error().or_else(|| handler.areas().error()).unwrap_or(Error::NotStarted)
        })
    }
}

impl Drop for Ex2 {
    fn drop(&mut self) {
        self.cycle.freed.store(true, Ordering::Release);
        if let Some(session) = self.session() {
            // There is nobody left to read it.
            let _ = session.stop();
        }
    }
}
