//! A run of a program: connect, `PrgInit`, tics, the end.

use std::ffi::{c_int, CString};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::{
    Error, FirmwareVersion, TransferAreaComHandler, TransferAreas, TransferMode,
};

use parking_lot::Mutex;

use super::callbacks::Callbacks;
use super::display::Display;
use super::draw::{Frame, FRAME_BYTES};
use super::pace::Pace;
use super::system::{self, System};
use super::watch::{Place, Watch};
use super::{hooks, keyboard, signals, words, PrgInit, PrgTic, FAILED};
use crate::host;
use crate::i2c::I2cThread;
use crate::memory::{AreaArray, Ta, AREAS};
use crate::mirror::{Mirror, DEV_MODE_LOCAL};
use crate::online::Online;
use crate::process;
use crate::sentences;
use crate::session::STATUS_RUN;

/// What `PrgTic` returns to be called again.
const RUNS_ON: c_int = 0x7FFF;
/// `PGM_STATE_RUN`.
const PGM_STATE_RUN: u8 = 1;

/// How long a program that was asked to end may still say something.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// Why a program has ended.
enum End {
    /// `PrgTic` has returned this.
    Returned(c_int),
    /// It was asked to.
    Asked(u32),
    /// The exchange has ended.
    Lost(Error),
}

/// Runs a program. Returns its exit status; what happened is said.
pub(super) fn run(init: PrgInit, tic: PrgTic) -> c_int {
    let host = host::or_auto();
    match connect(&host) {
        Ok(handler) => Program::run(handler, &host, init, tic).unwrap_or_else(|error| {
            words::say(&format!("{error:#}"));
            FAILED
        }),
        // This one says itself that there is none, and where it was looked for.
        Err(error @ Error::NoController { .. }) => {
            words::say(&format!("{error:#}"));
            FAILED
        }
        Err(error) => {
            words::say(&format!("no controller at {host}: {error:#}"));
            FAILED
        }
    }
}

fn connect(host: &str) -> Result<Arc<TransferAreaComHandler>, Error> {
    let builder = host::handler(host).areas(AREAS);
    let handler = builder.mode(host::mode_for(TransferMode::Compressed)).build()?;
    process::begin();
    sentences::begin();
    handler.begin_transfer()?;
    Ok(Arc::new(handler))
}

/// A program that runs.
struct Program {
    area: TransferAreas,
    mirror: Mirror<Ta>,
    system: Arc<System>,
    watch: Watch,
    tic: PrgTic,
    pace: Pace,
    /// What each display has shown last: a message's and a frame's id, and whether the program has it.
    shown: [(u8, u16, bool); AREAS],
}

impl Program {
    fn run(
        handler: Arc<TransferAreaComHandler>,
        host: &str,
        init: PrgInit,
        tic: PrgTic,
    ) -> Result<c_int, Box<dyn std::error::Error>> {
        let name = handler.device_name().unwrap_or_default();
        let array = Arc::new(AreaArray::new());
        write_program_parts(&array);
        let for_i2c = Arc::clone(&handler);
        let i2c = I2cThread::start(host, move || for_i2c.i2c()).map_err(|_| "no thread for I2C")?;
        let system = Arc::new(System {
            array: Arc::clone(&array),
            display: Display::new(&name)?,
            callbacks: Arc::new(Callbacks::default()),
            i2c: Mutex::new(i2c),
        });
        system::set(Some(Arc::clone(&system)));
        let online = Arc::new(Online::begin(handler.address(), host));
        let watch = Watch::new(Arc::clone(&handler), Arc::clone(&online))?;
        signals::take_up()?;
        let mirror = Mirror::new(array, DEV_MODE_LOCAL);
        mirror.introduce(&name, handler.version().unwrap_or(FirmwareVersion::OLDEST_SUPPORTED));
        let area = handler.areas().clone();
        let pace = Pace::new(Instant::now());
        let shown = Default::default();
        let mut program = Self { area, mirror, system, watch, tic, pace, shown };
        let end = program.init(init).and_then(|()| program.tics());
        let summary = program.pace.summary(Instant::now());
        let ended = handler.end_transfer();
        if ended.is_ok() {
            online.end();
        }
        program.watch.end();
        // What the program does at its end, such as destructors, may crash or hang as in any other program.
        keyboard::restore();
        signals::give_back();
        if system::stop_reason().is_some() {
            end_soon();
        }
        system::set(None);
        // Shows what is left, before the last word.
        drop(program.system);
        Ok(last_word(end.unwrap_or_else(End::Lost), ended.err(), &summary))
    }

    /// The first inputs, and `PrgInit`.
    fn init(&mut self, init: PrgInit) -> Result<(), Error> {
        let mut areas = self.area.wait_cycle()?;
        self.mirror.begin(&areas);
        self.mirror.take_in(&areas, |_| {});
        self.mirror.set_status(STATUS_RUN);
        let array = &self.system.array;
        self.watch.call(Place::Init, || {
            // SAFETY: the program's function, with the areas as it expects them.
            unsafe { init(array.as_ptr(), AREAS as c_int) };
        });
        for index in 0..AREAS {
            // SAFETY: computes an address within the area only.
            let at = unsafe { &raw mut (*array.as_ptr().add(index)).state.pgm_initialized };
            array.store(at, 1);
        }
        self.mirror.put_out_whole(&mut areas);
        drop(areas);
        self.pace = Pace::new(Instant::now());
        Ok(())
    }

    /// Tics until the program ends.
    fn tics(&mut self) -> Result<End, Error> {
        loop {
            let due = self.pace.next(Instant::now());
            thread::sleep(due.saturating_duration_since(Instant::now()));
            if let Some(reason) = system::stop_reason() {
                return Ok(End::Asked(reason));
            }
            let result = self.tic()?;
            if result != RUNS_ON {
                return Ok(End::Returned(result));
            }
        }
    }

    /// A tic. After a response the areas are held until the program has answered it, so the answer is in the
    /// next request.
    fn tic(&mut self) -> Result<c_int, Error> {
        let (watch, mirror, system) = (&self.watch, &mut self.mirror, &*self.system);
        let tic = self.tic;
        let call = || call_tic(watch, system, tic);
        let result = match self.area.wait_cycle_for(Duration::ZERO) {
            Ok(mut areas) => {
                mirror.take_in(&areas, |_| {});
                let result = call();
                mirror.put_out_whole(&mut areas);
                result
            }
            Err(Error::WaitTimedOut { .. }) => {
                mirror.count_time();
                let result = call();
                mirror.put_out_whole(&mut self.area.lock());
                result
            }
            Err(error) => return Err(error),
        };
        self.show();
        Ok(result)
    }

    /// Shows what the program has written into the areas of its displays.
    fn show(&mut self) {
        let (array, display) = (&self.system.array, &self.system.display);
        for (index, shown) in self.shown.iter_mut().enumerate() {
            // SAFETY: computes addresses within the area only.
            let (message, text, id, is_master, frame) = unsafe {
                let area = &raw mut (*array.as_ptr().add(index)).display;
                (
                    &raw mut (*area).display_msg.id,
                    &raw mut (*area).display_msg.text,
                    &raw mut (*area).display_frame.id,
                    &raw mut (*area).display_frame.is_pgm_master_of_display,
                    &raw const (*area).display_frame.frame,
                )
            };
            let (message, id, is_master) =
                (array.load(message), array.load(id), array.load(is_master) != 0);
            let before = std::mem::replace(shown, (message, id, is_master));
            if message != before.0 {
                let text = array.load(text.cast::<[u8; 99]>());
                let end = text.iter().position(|byte| *byte == 0).unwrap_or(text.len());
                display.show_message(index, Some(hooks::decode(&text[..end])));
            }
            if is_master && (id, is_master) != (before.1, before.2) {
                // SAFETY: the pointer is the program's to set; it leads to a frame, or is null.
                let frame = unsafe { frame.read().cast::<Frame>().as_ref() };
                display.show_frame(index, frame.map(|frame| Box::new(*frame)));
            } else if before.2 && !is_master {
                display.show_frame(index, None);
            }
        }
    }
}

/// Callbacks that wait, and `PrgTic`.
fn call_tic(watch: &Watch, system: &System, tic: PrgTic) -> c_int {
    for callback in system.callbacks.take() {
        watch.call(Place::Callback, callback);
    }
    // SAFETY: computes addresses within the inputs only.
    let (left, right) = unsafe {
        let input = system.array.places(0).input;
        (&raw mut (*input).display_button_left, &raw mut (*input).display_button_right)
    };
    system.array.store(left, system.display.button_held(0));
    system.array.store(right, system.display.button_held(1));
    // SAFETY: the program's function, with the areas as it expects them.
    watch.call(Place::Tic, || unsafe { tic(system.array.as_ptr(), AREAS as c_int) })
}

/// Writes what a program finds in its areas and no exchange brings: hooks, frames, its own name.
fn write_program_parts(array: &AreaArray<Ta>) {
    let name = CString::new(words::program_name()).unwrap_or_default().into_raw();
    let frames = Box::leak(Box::new([[0_u8; FRAME_BYTES]; AREAS]));
    for (index, frame) in frames.iter_mut().enumerate() {
        // SAFETY: the area lies within the array, and no program knows it yet. Frames and the name are never
        // freed, so that a thread that the program has left behind finds them.
        unsafe {
            let area = array.as_ptr().add(index);
            (&raw mut (*area).hook_table).write(hooks::table());
            (&raw mut (*area).display.display_frame.frame).write(frame.as_mut_ptr());
            (&raw mut (*area).state.local_pgm.name).write(name);
            (&raw mut (*area).state.local_pgm.state).write(PGM_STATE_RUN);
        }
    }
}

/// Ends a program that was asked to end, and has stopped its motors, also when nobody reads what it says.
fn end_soon() {
    let end = || {
        thread::sleep(LAST_WORDS);
        signals::exit(FAILED);
    };
    // Without a thread, as soon as somebody reads.
    let _ = thread::Builder::new().spawn(end);
}

/// Says how the program has ended, and returns its exit status.
fn last_word(end: End, error: Option<Error>, summary: &str) -> c_int {
    let outputs = match error {
        None => "all outputs are off".to_owned(),
        Some(error) => format!("the end of the exchange failed: {error:#}"),
    };
    let (what, status) = match end {
        End::Returned(0) => ("PrgTic has returned 0, the end".to_owned(), 0),
        End::Returned(code) => (format!("PrgTic has returned the error {code}"), FAILED),
        End::Asked(reason) => (format!("ended by {}", signals::end_name(reason)), FAILED),
        // The end has the same error.
        End::Lost(error) => {
            words::say(&format!("the exchange has ended: {error:#} ({summary})"));
            return FAILED;
        }
    };
    words::say(&format!("{what}; {outputs} ({summary})"));
    status
}
