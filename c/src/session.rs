//! A program's areas kept in step with one controller, by a thread of this library.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::{
    Error, FirmwareVersion, FishX1Transfer, TransferAreaComHandler, TransferAreaGuard,
    TransferAreas, TransferMode,
};
use parking_lot::Mutex;

use crate::calling::{self, Thread};
use crate::exit;
use crate::host;
use crate::inside::Programs;
use crate::memory::{Area, AreaArray, AREAS};
use crate::mirror::{AreaEvent, Mirror, DEV_MODE_LOCAL};
use crate::online::Online;
use crate::process;
use crate::report;

/// How long after a response the program's outputs are taken. A program that polls every millisecond so
/// answers in the same cycle. The controller waits for 10 ms after a response, so nothing gets slower.
pub(crate) const TIME_TO_ANSWER: Duration = Duration::from_millis(3);
/// A callback in the library's thread that takes longer than this stops the motors.
const CALLBACK_LIMIT: Duration = Duration::from_millis(500);
/// How long the end of a transfer waits for a callback that does not return.
const END_LIMIT: Duration = Duration::from_secs(2);

/// How long one thread waits for another one that ends the same transfer, when all outputs are off.
const NOTE_LIMIT: Duration = Duration::from_millis(400);

/// `TA_STATUS_STOP`.
pub(crate) const STATUS_STOP: u8 = 0;
/// `TA_STATUS_RUN`.
pub(crate) const STATUS_RUN: u8 = 1;
/// `TA_STATUS_SYNC`.
pub(crate) const STATUS_SYNC: u8 = 2;
/// The outputs are off, and the transfer is about to end. Programs see `TA_STATUS_STOP`.
const STATUS_ENDING: u8 = 3;

/// What a program has done in the library's thread after each response. It may read and write its areas, and
/// what it writes goes out in the same cycle. `Break` stops the transfer, and has why, if a person is to know it.
pub(crate) type CycleCall = Box<dyn FnMut() -> ControlFlow<Option<String>> + Send>;

/// What is called when something has happened, in the library's thread: it must be quick.
pub(crate) type Listener = Box<dyn FnMut(AreaEvent) + Send>;

/// Settings of a session.
pub(crate) struct SessionSettings {
    /// `HOST`, `HOST:PORT` or `auto`.
    pub(crate) host: String,
    /// `DEV_MODE_LOCAL` for a program on the controller, `DEV_MODE_ONLINE` for one on a PC.
    pub(crate) dev_mode: u8,
    /// How many areas are exchanged.
    pub(crate) areas: usize,
    pub(crate) mode: TransferMode,
}

/// The areas of one device, and the transfer while it runs.
pub(crate) struct ProgramSession<A: Area> {
    shared: Arc<SessionParts<A>>,
    thread: Mutex<Option<Thread>>,
}

struct SessionParts<A: Area> {
    handler: TransferAreaComHandler,
    host: String,
    time_to_answer: Duration,
    /// While motors may be on.
    online: Mutex<Option<Online>>,
    /// Held by the thread that ends the transfer until nothing is noted of it any more.
    note_ends: Mutex<()>,
    array: Arc<AreaArray<A>>,
    mirror: Mutex<Mirror<A>>,
    /// How many transfers were begun, or could not begin.
    transfers: AtomicU32,
    /// Held while the outputs are taken, and by calls that write several of them.
    outputs: Mutex<()>,
    cycle_call: Mutex<Option<CycleCall>>,
    /// Whether the newest cycle call took longer than it may.
    took_long: AtomicBool,
    /// Set when the program ends, perhaps in the middle of anything.
    asked_to_end: AtomicBool,
    listener: Mutex<Option<Listener>>,
    /// One of `STATUS_…`; the program may overwrite the one in its areas.
    status: AtomicU8,
}

impl<A: Area> ProgramSession<A> {
    /// Makes the areas. Nothing is connected yet.
    pub(crate) fn new(
        settings: &SessionSettings,
        listener: Option<Listener>,
    ) -> Result<Self, Error> {
        let array = Arc::new(AreaArray::new());
        let mirror = Mirror::new(Arc::clone(&array), settings.dev_mode);
        Self::over(mirror, array, settings, listener)
    }

    /// The same areas with other settings, after a transfer with the old ones.
    pub(crate) fn again(&self, settings: &SessionSettings) -> Result<Self, Error> {
        let mirror = self.shared.mirror.lock().for_other_handler();
        Self::over(mirror, Arc::clone(&self.shared.array), settings, None)
    }

    /// A session for areas that are there already. Their mirror is none of another running session.
    pub(crate) fn over(
        mirror: Mirror<A>,
        array: Arc<AreaArray<A>>,
        settings: &SessionSettings,
        listener: Option<Listener>,
    ) -> Result<Self, Error> {
        let builder = host::handler(&settings.host)
            .areas(settings.areas)
            .mode(settings.mode)
            .watchdog(CALLBACK_LIMIT);
        let handler = match mirror.is_on_txt() {
            // A program on a TXT never has an answer when it ends a sound while none plays.
            true => builder.silence_as_reported(),
            false => builder,
        }
        .build()?;
        let is_local = settings.dev_mode == DEV_MODE_LOCAL;
        let shared = SessionParts {
            handler,
            // A controller itself takes the outputs right after the callback. So the answer to a command comes after a
            // whole cycle, and programs that wait for 10 ms between two commands rely on it.
            time_to_answer: if is_local { Duration::ZERO } else { TIME_TO_ANSWER },
            host: settings.host.clone(),
            online: Mutex::new(None),
            note_ends: Mutex::new(()),
            mirror: Mutex::new(mirror),
            array,
            transfers: AtomicU32::new(0),
            outputs: Mutex::new(()),
            cycle_call: Mutex::new(None),
            took_long: AtomicBool::new(false),
            asked_to_end: AtomicBool::new(false),
            listener: Mutex::new(listener),
            status: AtomicU8::new(STATUS_STOP),
        };
        Ok(Self { shared: Arc::new(shared), thread: Mutex::new(None) })
    }

    /// The areas that the program reads and writes.
    pub(crate) fn array(&self) -> &AreaArray<A> {
        &self.shared.array
    }

    /// Sets what is notified of events from now on; nothing with `None`.
    pub(crate) fn set_listener(&self, listener: Option<Listener>) {
        *self.shared.listener.lock() = listener;
    }

    /// Writes what is known of the controller into the areas, before a transfer does.
    pub(crate) fn introduce(&self, name: &str, firmware: FirmwareVersion) {
        self.shared.mirror.lock().introduce(name, firmware);
    }

    /// The handler, for what does not go through the areas.
    pub(crate) fn handler(&self) -> &TransferAreaComHandler {
        &self.shared.handler
    }

    /// Has this done after each response from now on; nothing with `None`. Returns when a call that is
    /// running has returned, so it must not be made from the call itself.
    pub(crate) fn set_cycle_call(&self, call: Option<CycleCall>) {
        *self.shared.cycle_call.lock() = call;
    }

    /// Runs `write` while no outputs are taken: what it writes goes out whole.
    pub(crate) fn write_whole<R>(&self, write: impl FnOnce(&AreaArray<A>) -> R) -> R {
        let _outputs = self.shared.outputs.lock();
        write(&self.shared.array)
    }

    /// Makes all areas 0, as if no transfer had been before. Not while one runs.
    pub(crate) fn clear(&self) {
        if let Some(ended) = self.thread.lock().take() {
            join(ended, &self.shared.host);
        }
        let _outputs = self.shared.outputs.lock();
        self.shared.array.clear();
        self.shared.mirror.lock().forget();
    }

    /// The same while a transfer runs, which goes on. From a cycle call, too.
    pub(crate) fn renew(&self) {
        let _outputs = self.shared.outputs.lock();
        self.shared.array.clear();
        self.shared.mirror.lock().renew();
    }

    /// Connects, and begins to exchange. Returns after the first response. Call `exit::watch` before: an end of the
    /// program does not wait for the begin of a transfer.
    pub(crate) fn start(&self) -> Result<(), Error> {
        let mut thread = self.thread.lock();
        if self.is_running() {
            return Err(Error::AlreadyStarted);
        }
        if let Some(ended) = thread.take() {
            join(ended, &self.shared.host);
        }
        report::start();
        exit::watch_signals();
        self.shared.asked_to_end.store(false, Ordering::Release);
        exit::check_goes_on()?;
        process::begin();
        self.shared.set_status(STATUS_SYNC);
        let handler = &self.shared.handler;
        // The controller has the program's configurations from the first response on.
        self.shared.mirror.lock().put_out_configs(&mut handler.areas().lock());
        // Before it begins: what was asked for in an earlier one is not for the controller that answers now.
        self.shared.transfers.fetch_add(1, Ordering::AcqRel);
        let begun = handler.begin_transfer().and_then(|()| {
            *self.shared.online.lock() = Some(Online::begin(handler.address(), &self.shared.host));
            self.begin()?;
            self.spawn()
        });
        match begun {
            Ok(started) => *thread = Some(started),
            Err(error) => {
                // The first error says more than one of ending.
                let _ = self.shared.end_transfer();
                self.shared.set_status(STATUS_STOP);
                return Err(error);
            }
        }
        Ok(())
    }

    fn begin(&self) -> Result<(), Error> {
        let name = self.shared.handler.device_name().unwrap_or_default();
        let firmware = self.shared.handler.version().unwrap_or(FirmwareVersion::OLDEST_SUPPORTED);
        self.introduce(&name, firmware);
        let mut areas = self.shared.handler.areas().wait_cycle()?;
        self.shared.mirror.lock().begin(&areas);
        self.shared.take_in(&areas);
        // From here on, an end of the program ends this transfer. It may have come before: then no motor turns.
        self.shared.set_status(STATUS_RUN);
        exit::check_goes_on()?;
        self.shared.put_out(&mut areas);
        Ok(())
    }

    fn spawn(&self) -> Result<Thread, Error> {
        let shared = Arc::clone(&self.shared);
        let programs = Programs::of_this_thread();
        let run = move || {
            #[cfg(unix)]
            let _stack = crate::exit::Stack::give();
            programs.begin();
            shared.run();
        };
        calling::spawn("ft/session", 0, run)
            .map_err(|cause| Error::ThreadNotStarted { cause: cause.into() })
    }

    /// The number of the transfer that runs, or was the last one; 0 before the first.
    pub(crate) fn transfer(&self) -> u32 {
        self.shared.transfers.load(Ordering::Acquire)
    }

    /// Whether areas are exchanged.
    pub(crate) fn is_running(&self) -> bool {
        self.status() == STATUS_RUN
    }

    /// How the transfer stands: one of `STATUS_…` that programs see.
    pub(crate) fn status(&self) -> u8 {
        seen(self.shared.status.load(Ordering::Acquire))
    }

    /// Ends the exchange with all outputs off. From a cycle call it returns at once, and the exchange ends
    /// when the call has returned.
    pub(crate) fn stop(&self) -> Result<(), Error> {
        // Ends a start in another thread, which keeps the lock.
        let _ = self.shared.end_transfer();
        let mut running = self.thread.lock();
        // Another thread may have started it again.
        let result = self.shared.end_transfer();
        let thread = running.take();
        drop(running);
        if let Some(thread) = thread {
            join(thread, &self.shared.host);
        }
        result
    }
}

/// What a program sees of how a transfer stands.
fn seen(status: u8) -> u8 {
    if status == STATUS_ENDING {
        STATUS_STOP
    } else {
        status
    }
}

/// Waits for the end of a thread, unless it is this one, or a callback in it does not return.
fn join(thread: Thread, host: &str) {
    if thread.is_this() {
        return;
    }
    let limit = Instant::now() + END_LIMIT;
    while !thread.is_finished() {
        if Instant::now() >= limit {
            report::failure(format_args!("{host}: a callback of the program does not return"));
            return;
        }
        thread::sleep(Duration::from_millis(1));
    }
    thread.join();
}

impl<A: Area> exit::Transfer for ProgramSession<A> {
    fn end(&self) {
        if matches!(self.shared.status.load(Ordering::SeqCst), STATUS_RUN | STATUS_ENDING) {
            // There is nobody left to read it.
            let _ = self.stop();
        }
    }

    fn ask(&self) {
        self.shared.asked_to_end.store(true, Ordering::Release);
    }
}

impl<A: Area> Drop for ProgramSession<A> {
    fn drop(&mut self) {
        if let Err(error) = self.stop() {
            log::debug!("while a device is closed: {error:#}");
        }
    }
}

impl<A: Area> SessionParts<A> {
    fn run(&self) {
        let area = self.handler.areas().clone();
        let why = loop {
            match self.cycle(&area) {
                Ok(ControlFlow::Continue(())) => {}
                Ok(ControlFlow::Break(why)) => break why,
                // The handler has logged it.
                Err(_) => break None,
            }
        };
        // The first error says more than one of ending.
        let _ = self.end_transfer();
        if let Some(why) = why {
            report::failure(format_args!("{}: {why}", self.host));
        }
        log::debug!("the transfer area has ended");
        self.stop_outputs();
        self.set_status(STATUS_STOP);
    }

    /// Ends the exchange with all outputs off.
    fn end_transfer(&self) -> Result<(), Error> {
        let note_ends = self.note_ends.try_lock();
        let online = note_ends.as_ref().and_then(|_| self.online.lock().take());
        let ended = self.handler.end_transfer();
        // After an error its drop leaves the controller to `tx_run`.
        if let (Ok(()), Some(online)) = (&ended, online) {
            online.end();
        }
        if note_ends.is_none() {
            // Two threads of the program end it at once, and it may be over when this one returns.
            drop(self.note_ends.try_lock_for(NOTE_LIMIT));
        }
        ended
    }

    fn set_status(&self, status: u8) {
        self.mirror.lock().set_status(seen(status));
        // In one order with the flag that the program ends: one of both threads sees what the other one has done.
        self.status.store(status, Ordering::SeqCst);
    }

    fn cycle(&self, area: &TransferAreas) -> Result<ControlFlow<Option<String>>, Error> {
        let mut areas = self.wait_cycle(area)?;
        if self.asked_to_end.load(Ordering::Acquire) {
            return Ok(ControlFlow::Break(None));
        }
        self.take_in(&areas);
        let begun = Instant::now();
        let (flow, since) = match &mut *self.cycle_call.lock() {
            Some(call) => (call(), begun),
            None => (ControlFlow::Continue(()), areas.arrived()),
        };
        self.took_long.store(begun.elapsed() >= CALLBACK_LIMIT, Ordering::Relaxed);
        if flow.is_continue() {
            // The program also answers from threads of its own.
            thread::sleep((since + self.time_to_answer).saturating_duration_since(Instant::now()));
        } else {
            // At once, also for the program: ending may take a second.
            self.set_status(STATUS_ENDING);
            self.stop_outputs();
        }
        self.put_out(&mut areas);
        Ok(flow)
    }

    /// Waits for a response. After a callback that took long, or when the computer was too busy, the program knows
    /// nothing of the outputs that were off, and wants them on again.
    fn wait_cycle<'a>(&self, area: &'a TransferAreas) -> Result<TransferAreaGuard<'a>, Error> {
        let limit = match area.wait_cycle() {
            Err(Error::WatchdogExpired { limit }) => limit,
            result => return result,
        };
        let areas = area.wait_cycle()?;
        let cause = if self.took_long.load(Ordering::Relaxed) {
            "a callback of the program took longer"
        } else {
            "this computer was too busy to exchange with the controller for longer"
        };
        log::warn!(
            "{}: {cause} than {limit:?}; all outputs were off meanwhile, and are on again as the program set them",
            self.host
        );
        self.mirror.lock().go_on(&areas);
        Ok(areas)
    }

    fn take_in(&self, areas: &[FishX1Transfer]) {
        let mut happened = Vec::new();
        // Not between the new id of a command and the flag that the same call sets back.
        let outputs = self.outputs.lock();
        self.mirror.lock().take_in(areas, |it| happened.push(it));
        drop(outputs);
        if let Some(listener) = &mut *self.listener.lock() {
            happened.into_iter().for_each(listener);
        }
    }

    fn put_out(&self, areas: &mut [FishX1Transfer]) {
        let _outputs = self.outputs.lock();
        self.mirror.lock().put_out(areas);
    }

    /// What a program finds in its outputs after the end is what the controller has: nothing moves, and
    /// nothing does when the transfer begins again.
    fn stop_outputs(&self) {
        let _outputs = self.outputs.lock();
        for index in 0..AREAS {
            let places = self.array.places(index);
            let mut output = self.array.load(places.output);
            (*output.duty, *output.distance, *output.master) = ([0; 8], [0; 4], [0; 4]);
            self.array.store(places.output, output);
        }
    }
}

#[cfg(test)]
mod tests;
