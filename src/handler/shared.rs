//! What the program's threads and the transfer thread share.
//!
//! There are two locks. The areas' lock belongs to the program, and a guard may hold it as long as
//! it likes. The mail's lock is held for moments only, by either side: it covers the outputs as
//! the last guard left them, the inputs that have come in since, and who waits for what. So the
//! transfer thread never waits for the program: the program's threads carry outputs into the mail
//! when they drop a guard, and inputs out of it when they lock. For a cycle hook alone it takes the
//! areas, and waits for them as long as it waits for reactions anyway.
//!
//! Whoever takes several locks takes them in this order: areas, hook, listeners, mail.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use super::events::Listeners;
use super::hook::HookSlot;
use super::mail::{Delivery, Errand, Mail, Stop, Window};
use super::Statistics;
use crate::camera::CameraControl;
use crate::error::Error;
use crate::exchange::Inputs;
use crate::transfer_area::FishX1Transfer;

pub(super) struct Shared {
    pub(super) areas: Mutex<Vec<FishX1Transfer>>,
    pub(super) mail: Mutex<Mail>,
    pub(super) listeners: Mutex<Listeners>,
    pub(super) hook: HookSlot,
    /// A response has come in, an errand is done, or the transfer has ended.
    arrived: Condvar,
    /// All who waited for the response have reacted, or a stop is asked for.
    attended: Condvar,
}

impl Shared {
    /// Areas in the kit's default configuration.
    pub(super) fn new(count: usize) -> Self {
        let mut areas = vec![FishX1Transfer::default(); count];
        for (id, area) in (0..).zip(&mut areas) {
            area.state.id = id;
        }
        let mail = Mail::new(areas.clone());
        Self {
            areas: Mutex::new(areas),
            mail: Mutex::new(mail),
            listeners: Mutex::default(),
            hook: HookSlot::default(),
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
            None => mail.stop_half_written(),
        }
        if mail.window.open && reacts_to == Some(mail.cycle) {
            mail.window.reacting -= 1;
        }
        if mail.stop.is_some() || mail.window.is_attended() {
            self.attended.notify_one();
        }
    }

    /// Waits for a response newer than `seen`, and tells which one it is; `None` when the deadline
    /// comes first.
    pub(super) fn wait_cycle(
        &self,
        seen: u64,
        deadline: Option<Instant>,
    ) -> Result<Option<u64>, Error> {
        let mut mail = self.mail.lock();
        mail.check_running()?;
        if mail.cycle > seen {
            if let Some(cycle) = mail.join_window() {
                return Ok(Some(cycle));
            }
        }
        let (transfer, cycle) = (mail.transfer, mail.cycle);
        mail.window.waiting += 1;
        let goes_on = |mail: &Mail| mail.running && mail.transfer == transfer;
        while mail.cycle == cycle && goes_on(&mail) {
            let timed_out = wait_until(&self.arrived, &mut mail, deadline);
            if timed_out && mail.cycle == cycle && goes_on(&mail) {
                mail.window.waiting -= 1;
                return Ok(None);
            }
        }
        if mail.cycle == cycle || mail.transfer != transfer {
            // Another transfer may have begun meanwhile, so look at the end of the last one.
            return Err(mail.last_error.clone().unwrap_or(Error::NotStarted));
        }
        Ok(Some(cycle + 1))
    }

    /// Whether the present transfer has brought inputs yet; errs without one.
    pub(super) fn has_inputs(&self) -> Result<bool, Error> {
        let mail = self.mail.lock();
        mail.check_running()?;
        Ok(mail.last_response.is_some())
    }

    /// Has the next request wait for the calling thread, if it has not left yet; tells for which
    /// response.
    pub(super) fn join_window(&self) -> Option<u64> {
        self.mail.lock().join_window()
    }

    pub(super) fn area_count(&self) -> usize {
        self.mail.lock().outgoing.len()
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
        mail.half_written = false;
        mail.last_response = None;
        mail.window = Window::default();
        mail.statistics = Statistics { config_updates, ..Statistics::default() };
    }

    /// Hands in a response, of which nobody is told yet.
    ///
    /// When somebody listens for events, the response before it comes into `before`.
    pub(super) fn deliver(
        &self,
        inputs: &Inputs,
        config_updates: u64,
        before: &mut Inputs,
    ) -> Delivery {
        let now = Instant::now();
        let mut mail = self.mail.lock();
        if !mail.listened.is_empty() {
            std::mem::swap(before, &mut mail.incoming);
        }
        mail.incoming.clone_from(inputs);
        mail.inputs_due = true;
        mail.delivered += 1;
        let previous = mail.last_response.replace(now);
        mail.statistics.count_response(previous, now);
        mail.statistics.config_updates += config_updates;
        Delivery { number: mail.delivered, first: previous.is_none(), listened: mail.listened }
    }

    /// Opens the window for reactions to the last response, and wakes all who wait for it.
    pub(super) fn open_window(&self) {
        let mut mail = self.mail.lock();
        mail.cycle = mail.delivered;
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
        let end = mail.window_end(length);
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
        let error = result.err();
        // Before the mail, so that nobody who listens from now on hears of this end.
        let listeners = self.listeners.lock();
        let mut mail = self.mail.lock();
        for (outgoing, area) in mail.outgoing.iter_mut().zip(areas) {
            outgoing.output = area.output;
        }
        mail.outputs_due = true;
        mail.end(error.clone());
        drop(mail);
        self.arrived.notify_all();
        listeners.tell_end(error);
        drop(listeners);
        // Once more for one that was started at the last moment.
        self.stop_camera();
    }

    /// Notes why a transfer could not begin.
    pub(super) fn fail(&self, error: Error) {
        self.mail.lock().end(Some(error));
        self.arrived.notify_all();
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
