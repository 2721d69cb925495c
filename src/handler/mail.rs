//! The mail: what the program's threads and the transfer thread leave for each other.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::events::KindSet;
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

/// What the transfer thread learns when it hands in a response.
#[derive(Clone, Copy, Debug)]
pub(super) struct Delivery {
    /// The response's number.
    pub(super) number: u64,
    /// Whether it is the first of its transfer.
    pub(super) first: bool,
    /// The events that somebody listens for.
    pub(super) listened: KindSet,
}

#[derive(Debug)]
pub(super) struct Mail {
    pub(super) running: bool,
    /// The error that ended the last transfer, unless that ended well.
    pub(super) last_error: Option<Error>,
    /// Counts the transfers, so that a thread that waits knows its own.
    pub(super) transfer: u64,
    /// When the transfer began; the timers go on after its end.
    pub(super) began: Option<Instant>,
    pub(super) stop: Option<Stop>,
    /// Whether a panic has left the areas half written.
    pub(super) half_written: bool,
    /// The areas as the last guard left them.
    pub(super) outgoing: Vec<FishX1Transfer>,
    pub(super) incoming: Inputs,
    /// Whether `incoming` has something that is not yet in the areas.
    pub(super) inputs_due: bool,
    /// Whether the motors were stopped, and that is not yet in the areas.
    pub(super) outputs_due: bool,
    /// Counts the responses of all transfers.
    pub(super) delivered: u64,
    /// The last one for which a window was opened.
    pub(super) cycle: u64,
    /// When the last response of this transfer came in.
    pub(super) last_response: Option<Instant>,
    pub(super) window: Window,
    /// While a guard is held: the response that it waited for, if it did.
    pub(super) held: Option<Option<u64>>,
    pub(super) errand: Option<Errand>,
    /// The stream of frames that ends with the transfer.
    pub(super) camera: Option<Arc<CameraControl>>,
    /// The events that somebody listens for.
    pub(super) listened: KindSet,
    pub(super) statistics: Statistics,
}

/// The time after a response in which the program may answer it.
#[derive(Debug, Default)]
pub(super) struct Window {
    pub(super) open: bool,
    /// Threads that wait for the next response.
    pub(super) waiting: usize,
    /// Threads that have waited for this one and have not dropped their guards.
    pub(super) reacting: usize,
    /// Whether there was any such thread.
    pub(super) used: bool,
}

impl Mail {
    /// No transfer has begun yet.
    pub(super) fn new(areas: Vec<FishX1Transfer>) -> Self {
        Self {
            running: false,
            last_error: None,
            transfer: 0,
            began: None,
            stop: None,
            half_written: false,
            outgoing: areas,
            incoming: Inputs::default(),
            inputs_due: false,
            outputs_due: false,
            delivered: 0,
            cycle: 0,
            last_response: None,
            window: Window::default(),
            held: None,
            errand: None,
            camera: None,
            listened: KindSet::default(),
            statistics: Statistics::default(),
        }
    }

    pub(super) fn check_running(&self) -> Result<(), Error> {
        if self.running {
            return Ok(());
        }
        Err(self.last_error.clone().unwrap_or(Error::NotStarted))
    }

    /// Leaves nobody waiting.
    pub(super) fn end(&mut self, error: Option<Error>) {
        self.running = false;
        self.last_error = error;
        self.window = Window::default();
        self.errand = None;
    }

    /// The first reason is the one that counts.
    pub(super) fn ask_to_stop(&mut self, stop: Stop) {
        self.stop.get_or_insert(stop);
    }

    /// Ends the transfer because a panic has struck whoever was writing to the areas.
    pub(super) fn stop_half_written(&mut self) {
        self.half_written = true;
        self.ask_to_stop(Stop::ProgramPanicked);
    }

    /// When a window of this length ends.
    pub(super) fn window_end(&self, length: Duration) -> Option<Instant> {
        self.last_response.and_then(|response| response.checked_add(length))
    }

    /// Has the next request wait for the calling thread; tells for which response, unless its
    /// window has ended.
    pub(super) fn join_window(&mut self) -> Option<u64> {
        if !self.window.open {
            return None;
        }
        self.window.reacting += 1;
        self.window.used = true;
        Some(self.cycle)
    }

    /// Takes the areas as a guard leaves them.
    pub(super) fn take_out(&mut self, areas: &[FishX1Transfer]) {
        if self.running && self.half_written {
            return;
        }
        for (outgoing, area) in self.outgoing.iter_mut().zip(areas) {
            // A guard from before the motors were stopped has not seen that.
            let output = if self.outputs_due { outgoing.output } else { area.output };
            *outgoing = FishX1Transfer { output, ..*area };
        }
    }

    /// Carries what has come in into the areas.
    pub(super) fn bring_up_to_date(&mut self, areas: &mut [FishX1Transfer]) {
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
    pub(super) fn count_late(&mut self) {
        let waited = self.window.reacting as u64;
        // Another guard is one that did not wait, or waited for an older response.
        let another = self.held.is_some_and(|reacts_to| reacts_to != Some(self.cycle));
        self.statistics.late_reactions += waited + u64::from(another);
    }
}

impl Window {
    /// Whether threads have waited for this response and all have reacted.
    pub(super) fn is_attended(&self) -> bool {
        self.used && self.reacting == 0
    }
}
