//! What the program's threads and the transfer thread share.
//!
//! There are two locks. The areas' lock belongs to the program, and a guard may hold it as long as
//! it likes. The mail's lock is held for moments only, by either side: it covers the outputs as
//! the last guard left them, the inputs that have come in since, and who waits for what. So the
//! transfer thread never waits for the program: the program's threads carry outputs into the mail
//! when they drop a guard, and inputs out of it when they lock. Whoever takes both locks takes the
//! areas first.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use super::Statistics;
use crate::camera::CameraControl;
use crate::error::Error;
use crate::exchange::Inputs;
use crate::transfer_area::FishX1Transfer;
use crate::wire::StartCameraOnline;

/// Why a transfer stops that nothing is wrong with on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The program asks for it.
    Asked,
    /// A thread of the program panicked.
    ProgramPanicked,
}

/// A command that the transfer thread sends between two exchanges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Errand {
    StartCamera(StartCameraOnline),
    StopCamera,
}

#[derive(Debug)]
pub(super) struct Shared {
    areas: Mutex<Vec<FishX1Transfer>>,
    mail: Mutex<Mail>,
    /// A response has come in, an errand is done, or the transfer has ended.
    arrived: Condvar,
    /// All who waited for the response have reacted, or a stop is asked for.
    attended: Condvar,
}

#[derive(Debug)]
struct Mail {
    running: bool,
    /// The error that ended the last transfer, unless that ended well.
    last_error: Option<Error>,
    /// Counts the transfers, so that a thread that waits knows its own.
    transfer: u64,
    /// When the transfer began; the timers go on after its end.
    began: Option<Instant>,
    stop: Option<Stop>,
    /// The areas as the last guard left them.
    outgoing: Vec<FishX1Transfer>,
    incoming: Inputs,
    /// Whether `incoming` has something that is not yet in the areas.
    inputs_due: bool,
    /// Whether the motors were stopped, and that is not yet in the areas.
    outputs_due: bool,
    /// Counts the responses of all transfers.
    cycle: u64,
    last_response: Option<Instant>,
    window: Window,
    /// While a guard is held: the response that it waited for, if it did.
    held: Option<Option<u64>>,
    errand: Option<Errand>,
    /// The stream of frames that ends with the transfer.
    camera: Option<Arc<CameraControl>>,
    statistics: Statistics,
}

/// The time after a response in which the program may answer it.
#[derive(Debug, Default)]
struct Window {
    open: bool,
    /// Threads that wait for the next response.
    waiting: usize,
    /// Threads that have waited for this one and have not dropped their guards.
    reacting: usize,
    /// Whether there was any such thread.
    used: bool,
}

impl Shared {
    /// Areas in the kit's default configuration.
    pub(super) fn new(count: usize) -> Self {
        let mut areas = vec![FishX1Transfer::default(); count];
        for (id, area) in (0..).zip(&mut areas) {
            area.state.id = id;
        }
        let mail = Mail {
            running: false,
            last_error: None,
            transfer: 0,
            began: None,
            stop: None,
            outgoing: areas.clone(),
            incoming: Inputs::default(),
            inputs_due: false,
            outputs_due: false,
            cycle: 0,
            last_response: None,
            window: Window::default(),
            held: None,
            errand: None,
            camera: None,
            statistics: Statistics::default(),
        };
        Self {
            areas: Mutex::new(areas),
            mail: Mutex::new(mail),
            arrived: Condvar::new(),
            attended: Condvar::new(),
        }
    }

    // What the program's threads call.

    /// Locks the areas and brings them up to date; tells the newest response in them. The thread
    /// may have waited for one.
    pub(super) fn lock(
        &self,
        reacts_to: Option<u64>,
    ) -> (MutexGuard<'_, Vec<FishX1Transfer>>, u64) {
        let mut areas = self.areas.lock();
        let mut mail = self.mail.lock();
        mail.bring_up_to_date(&mut areas);
        mail.held = Some(reacts_to);
        (areas, mail.cycle)
    }

    /// Takes what a guard leaves behind while it still holds the areas; `None` after a panic.
    pub(super) fn release(&self, areas: Option<&[FishX1Transfer]>, reacts_to: Option<u64>) {
        let mut mail = self.mail.lock();
        mail.held = None;
        match areas {
            Some(areas) => mail.take_out(areas),
            None => mail.ask_to_stop(Stop::ProgramPanicked),
        }
        if mail.window.open && reacts_to == Some(mail.cycle) {
            mail.window.reacting -= 1;
        }
        if mail.stop.is_some() || mail.window.is_attended() {
            self.attended.notify_one();
        }
    }

    /// Waits for a response newer than `seen`, and tells which one it is.
    pub(super) fn wait_cycle(&self, seen: u64, limit: Option<Duration>) -> Result<u64, Error> {
        let deadline = limit.and_then(|limit| Instant::now().checked_add(limit));
        let mut mail = self.mail.lock();
        mail.check_running()?;
        if mail.window.open && mail.cycle > seen {
            mail.window.reacting += 1;
            mail.window.used = true;
            return Ok(mail.cycle);
        }
        let (transfer, cycle) = (mail.transfer, mail.cycle);
        mail.window.waiting += 1;
        let goes_on = |mail: &Mail| mail.running && mail.transfer == transfer;
        while mail.cycle == cycle && goes_on(&mail) {
            let timed_out = wait_until(&self.arrived, &mut mail, deadline);
            if timed_out && mail.cycle == cycle && goes_on(&mail) {
                mail.window.waiting -= 1;
                return Err(Error::WaitTimedOut { limit: limit.unwrap_or_default() });
            }
        }
        if mail.cycle == cycle || mail.transfer != transfer {
            // Another transfer may have begun meanwhile, so look at the end of the last one.
            return Err(mail.last_error.clone().unwrap_or(Error::NotStarted));
        }
        Ok(cycle + 1)
    }

    /// Has the transfer thread send a command, and waits until that is done.
    pub(super) fn run_errand(&self, errand: Errand) -> Result<(), Error> {
        let mut mail = self.mail.lock();
        mail.check_running()?;
        mail.errand = Some(errand);
        while mail.errand.is_some() && mail.running {
            self.arrived.wait(&mut mail);
        }
        mail.check_running()
    }

    /// Has this stream end with the transfer; at once, when that has ended already.
    pub(super) fn set_camera(&self, camera: Arc<CameraControl>) {
        let mut mail = self.mail.lock();
        mail.camera = Some(camera);
        if !mail.running {
            drop(mail);
            self.stop_camera();
        }
    }

    /// Stops the stream of frames that ends with the transfer.
    pub(super) fn stop_camera(&self) {
        let camera = self.mail.lock().camera.take();
        if let Some(camera) = camera {
            camera.stop();
        }
    }

    pub(super) fn ask_to_stop(&self, stop: Stop) {
        self.mail.lock().ask_to_stop(stop);
        self.attended.notify_one();
    }

    pub(super) fn is_running(&self) -> bool {
        self.mail.lock().running
    }

    /// Errs with why no transfer is running.
    pub(super) fn check_running(&self) -> Result<(), Error> {
        self.mail.lock().check_running()
    }

    pub(super) fn error(&self) -> Option<Error> {
        let mail = self.mail.lock();
        mail.last_error.clone().filter(|_| !mail.running)
    }

    pub(super) fn statistics(&self) -> Statistics {
        self.mail.lock().statistics
    }

    // What the handler and the transfer thread call.

    /// The areas as the last guard left them.
    pub(super) fn outgoing(&self) -> Vec<FishX1Transfer> {
        self.mail.lock().outgoing.clone()
    }

    /// Begins a transfer for which so many configurations were handed over.
    pub(super) fn begin(&self, config_updates: u64) {
        let mut mail = self.mail.lock();
        mail.running = true;
        mail.transfer += 1;
        mail.began = Some(Instant::now());
        mail.stop = None;
        mail.last_response = None;
        mail.window = Window::default();
        mail.statistics = Statistics { config_updates, ..Statistics::default() };
    }

    /// Hands in a response and opens the window for reactions to it.
    pub(super) fn deliver(&self, inputs: &Inputs, config_updates: u64) {
        let now = Instant::now();
        let mut mail = self.mail.lock();
        mail.incoming.clone_from(inputs);
        mail.inputs_due = true;
        mail.cycle += 1;
        let previous = mail.last_response.replace(now);
        mail.statistics.count_response(previous, now);
        mail.statistics.config_updates += config_updates;
        let reacting = std::mem::take(&mut mail.window.waiting);
        mail.window = Window { open: true, waiting: 0, reacting, used: reacting > 0 };
        drop(mail);
        self.arrived.notify_all();
    }

    /// Holds the window open until all have reacted, it has lasted `length`, or a stop is asked
    /// for; then takes the outputs for the next request into `areas`.
    pub(super) fn hold_window(
        &self,
        length: Duration,
        areas: &mut [FishX1Transfer],
    ) -> Option<Stop> {
        let mut mail = self.mail.lock();
        let end = mail.last_response.and_then(|response| response.checked_add(length));
        while mail.stop.is_none() && !mail.window.is_attended() {
            if wait_until(&self.attended, &mut mail, end) {
                mail.count_late();
                break;
            }
        }
        mail.window.open = false;
        areas.copy_from_slice(&mail.outgoing);
        mail.stop
    }

    /// The command to send now.
    pub(super) fn errand(&self) -> Option<Errand> {
        self.mail.lock().errand
    }

    pub(super) fn errand_is_done(&self) {
        self.mail.lock().errand = None;
        self.arrived.notify_all();
    }

    /// Ends the transfer that left the machine with these outputs.
    pub(super) fn finish(&self, result: Result<(), Error>, areas: &[FishX1Transfer]) {
        let mut mail = self.mail.lock();
        for (outgoing, area) in mail.outgoing.iter_mut().zip(areas) {
            outgoing.output = area.output;
        }
        mail.outputs_due = true;
        mail.end(result.err());
        drop(mail);
        self.arrived.notify_all();
        // Once more for one that was started at the last moment.
        self.stop_camera();
    }

    /// Notes why a transfer could not begin.
    pub(super) fn fail(&self, error: Error) {
        self.mail.lock().end(Some(error));
        self.arrived.notify_all();
    }
}

impl Mail {
    fn check_running(&self) -> Result<(), Error> {
        if self.running {
            return Ok(());
        }
        Err(self.last_error.clone().unwrap_or(Error::NotStarted))
    }

    /// Leaves nobody waiting.
    fn end(&mut self, error: Option<Error>) {
        self.running = false;
        self.last_error = error;
        self.window = Window::default();
        self.errand = None;
    }

    /// The first reason is the one that counts.
    fn ask_to_stop(&mut self, stop: Stop) {
        self.stop.get_or_insert(stop);
    }

    /// Takes the areas as a guard leaves them.
    fn take_out(&mut self, areas: &[FishX1Transfer]) {
        for (outgoing, area) in self.outgoing.iter_mut().zip(areas) {
            // A guard from before the motors were stopped has not seen that.
            let output = if self.outputs_due { outgoing.output } else { area.output };
            *outgoing = FishX1Transfer { output, ..*area };
        }
    }

    /// Carries what has come in into the areas.
    fn bring_up_to_date(&mut self, areas: &mut [FishX1Transfer]) {
        if std::mem::take(&mut self.inputs_due) {
            self.incoming.apply(areas);
        }
        if std::mem::take(&mut self.outputs_due) {
            for (area, stopped) in areas.iter_mut().zip(&self.outgoing) {
                area.output = stopped.output;
            }
        }
        if let (Some(began), Some(master)) = (self.began, areas.first_mut()) {
            master.timer.set_elapsed(began.elapsed());
        }
    }

    /// Counts the guards that are still held at the window's end.
    fn count_late(&mut self) {
        let waited = self.window.reacting as u64;
        // Another guard is one that did not wait, or waited for an older response.
        let another = self.held.is_some_and(|reacts_to| reacts_to != Some(self.cycle));
        self.statistics.late_reactions += waited + u64::from(another);
    }
}

impl Window {
    /// Whether threads have waited for this response and all have reacted.
    fn is_attended(&self) -> bool {
        self.used && self.reacting == 0
    }
}

/// Waits for news, for ever without a deadline; tells whether the deadline came first.
fn wait_until(news: &Condvar, mail: &mut MutexGuard<'_, Mail>, deadline: Option<Instant>) -> bool {
    match deadline {
        Some(deadline) => news.wait_until(mail, deadline).timed_out(),
        None => {
            news.wait(mail);
            false
        }
    }
}
