//! What the handler and the transfer thread do with what they share with the program's threads.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use super::command::Command;
use super::events::{Event, KindSet};
use super::shared::{Controller, Shared, State};
use super::state::Stop;
use super::statistics::Statistics;
use super::sync::{earlier, wait_on_time, wait_until};
use super::unfinished::Cut;
use crate::error::Error;
use crate::exchange::Inputs;
use crate::transfer_area::FishX1Transfer;

/// What the transfer thread learns when it hands in a response.
#[derive(Clone, Copy, Debug)]
pub(super) struct Delivered {
    /// The response's number.
    pub(super) number: u64,
    /// Whether it is the first of its connection.
    pub(super) first: bool,
    /// The events that somebody listens for.
    pub(super) listened: KindSet,
    /// Whether nobody was told of it, because the hook comes first.
    pub(super) hook_first: bool,
}

impl Shared {
    /// The areas as the last guard left them.
    pub(super) fn outgoing(&self) -> Vec<FishX1Transfer> {
        self.state().hand_over.outgoing().to_vec()
    }

    /// A thread of the program begins to connect.
    pub(super) fn begin(&self) -> Result<(), Error> {
        self.state().transfer.begin()
    }

    /// A connection leads to this controller.
    pub(super) fn set_controller(&self, controller: Controller) {
        self.state().controller = Some(controller);
    }

    /// Begins a transfer for which so many configurations were handed over; errs when it was stopped
    /// meanwhile.
    pub(super) fn run(&self, config_updates: u64) -> Result<(), Stop> {
        let mut state = self.state();
        state.transfer.run()?;
        state.last_response = None;
        state.command = None;
        state.watchdog.start();
        state.statistics = Statistics { config_updates, ..Statistics::default() };
        Ok(())
    }

    /// Hands in a response, and opens its window, unless the hook comes first.
    ///
    /// When somebody listens for events, the inputs as the program sees them come into `now`, and those
    /// of the response before into `before`.
    pub(super) fn deliver(
        &self,
        inputs: &Inputs,
        config_updates: u64,
        before: &mut Inputs,
        now: &mut Inputs,
    ) -> Delivered {
        let mut listeners = self.listeners.lock();
        let mut locked = self.state_soon();
        let state = &mut *locked;
        state.delivered += 1;
        let listened = listeners.note_response(state.delivered);
        drop(listeners);
        if !listened.is_empty() {
            before.clone_from(state.hand_over.incoming());
        }
        state.hand_over.put(inputs);
        if !listened.is_empty() {
            now.clone_from(state.hand_over.incoming());
        }
        let arrived = Instant::now();
        let previous = state.last_response.replace(arrived);
        state.statistics.count_response(previous, arrived);
        state.statistics.config_updates += config_updates;
        let hook_first = state.hook.is_set();
        if !hook_first {
            self.open(state);
        }
        Delivered { number: state.delivered, first: previous.is_none(), listened, hook_first }
    }

    /// Opens the window for reactions to the last response, and wakes all who wait for it.
    pub(super) fn open_window(&self) {
        self.open(&mut self.state());
    }

    fn open(&self, state: &mut State) {
        let told = state.window.open(state.delivered);
        state.area_lock.expect(told);
        if told > 0 {
            // A program that waits for a late response does not hang.
            state.watchdog.feed();
        }
        self.arrived.notify_all();
    }

    /// Holds the window open until all have reacted, it has lasted `length`, or a stop is asked for;
    /// then takes the outputs for the next request into `areas`.
    ///
    /// Stops the outputs, and says so, when the watchdog expires.
    pub(super) fn hold_window(
        &self,
        length: Duration,
        areas: &mut [FishX1Transfer],
    ) -> Option<Stop> {
        let mut state = self.state_soon();
        let end = state.window_end(length);
        while state.transfer.stop().is_none() && !state.window.is_attended() {
            let deadline = earlier(end, state.watchdog.deadline());
            if wait_on_time(&self.attended, &mut state, deadline) {
                break;
            }
        }
        let expired = state.check_watchdog();
        self.close_window(&mut state);
        let stop = state.transfer.stop();
        areas.copy_from_slice(state.hand_over.outgoing());
        drop(state);
        if let Some(limit) = expired {
            log::warn!("{}", Error::WatchdogExpired { limit });
            self.arrived.notify_all();
            self.listeners.tell_all(&Event::WatchdogExpired { limit });
        }
        stop
    }

    /// Closes the window, and lets all who want them have the areas.
    fn close_window(&self, state: &mut State) {
        let next = state.area_lock.expect_nobody();
        self.wake_next(state, next);
        state.window.close(state.delivered);
    }

    /// The connection was lost, and another one is to be made: stops the outputs, takes them for the last
    /// words, and tells the program.
    pub(super) fn lose_connection(&self, error: &Error, areas: &mut [FishX1Transfer]) {
        let mut state = self.state();
        let cause = Box::new(error.clone());
        state.interruptions.note(Error::ConnectionLost { cause });
        state.hand_over.stop(Cut::Connection);
        areas.copy_from_slice(state.hand_over.outgoing());
        state.transfer.reconnect();
        state.statistics.gaps += 1;
        state.last_response = None;
        self.close_window(&mut state);
        let camera = state.camera.clone();
        drop(state);
        self.arrived.notify_all();
        if let Some(camera) = camera {
            camera.pause();
        }
        self.listeners.tell_all(&Event::ConnectionLost { error: error.clone() });
    }

    /// The connection stands again, and its first response has come in.
    pub(super) fn resume(&self, lost_for: Duration) {
        let mut state = self.state();
        state.transfer.resume();
        state.watchdog.feed();
        drop(state);
        self.listeners.tell_all(&Event::ConnectionRestored { after: lost_for });
    }

    /// Waits until a stop is asked for, but not beyond the deadline.
    pub(super) fn wait_for_stop(&self, deadline: Instant) {
        let mut state = self.state();
        while state.transfer.stop().is_none() {
            if wait_until(&self.attended, &mut state, Some(deadline)) {
                return;
            }
        }
    }

    /// Counts configurations that were handed over outside an exchange.
    pub(super) fn count_config_updates(&self, count: u64) {
        self.state().statistics.config_updates += count;
    }

    /// The controller's camera server was started again, at this address.
    pub(super) fn resume_camera(&self, address: SocketAddr) {
        let camera = self.state().camera.clone();
        if let Some(camera) = camera {
            camera.resume(address);
        }
    }

    /// Why the transfer is to stop, while nothing is wrong on the wire.
    pub(super) fn stop(&self) -> Option<Stop> {
        self.state().transfer.stop()
    }

    /// The command to send now.
    pub(super) fn command(&self) -> Option<Command> {
        self.state().command
    }

    pub(super) fn command_is_done(&self) {
        self.state().command = None;
        self.arrived.notify_all();
    }

    /// Stops the stream of frames that ends with the transfer.
    pub(super) fn stop_camera(&self) {
        let camera = self.state().camera.take();
        if let Some(camera) = camera {
            camera.stop();
        }
    }

    /// The transfer is about to end: stops the outputs, and takes them for the last request.
    pub(super) fn leave(&self, areas: &mut [FishX1Transfer]) {
        let mut state = self.state();
        state.interruptions.note_end();
        state.hand_over.stop(Cut::Connection);
        state.transfer.leave();
        // After a panic of the transfer thread nothing is taken for granted.
        for (area, outgoing) in areas.iter_mut().zip(state.hand_over.outgoing()) {
            *area = *outgoing;
        }
    }

    /// Ends the transfer.
    pub(super) fn finish(&self, error: Option<Error>) {
        // Held until they are told, so that nobody who listens from then on hears of this end.
        let listeners = self.listeners.lock();
        let mut state = self.state();
        self.close_window(&mut state);
        state.command = None;
        state.transfer.end(error.clone());
        drop(state);
        self.arrived.notify_all();
        listeners.tell_end(error);
        drop(listeners);
        // Once more for one that was started at the last moment.
        self.stop_camera();
    }

    /// Notes why a transfer could not begin.
    pub(super) fn fail(&self, error: Error) {
        // One that another thread has ended is no failure.
        self.state().transfer.end(Some(error).filter(|error| *error != Error::NotStarted));
        self.arrived.notify_all();
    }
}

impl State {
    /// When a window of this length ends.
    pub(super) fn window_end(&self, length: Duration) -> Option<Instant> {
        self.last_response.and_then(|response| response.checked_add(length))
    }

    /// Stops the motors when the watchdog expires, and then tells its limit.
    fn check_watchdog(&mut self) -> Option<Duration> {
        let number = self.interruptions.count() + 1;
        let limit = self.watchdog.check(Instant::now(), number)?;
        self.interruptions.note(Error::WatchdogExpired { limit });
        self.hand_over.stop(Cut::Motors);
        Some(limit)
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;
    use crate::handler::watchdog::Watchdog;

    #[test]
    fn a_program_that_waits_for_a_late_response_does_not_hang() {
        let limit = Duration::from_millis(20);
        for waits in [true, false] {
            let shared = Shared::new(1, Watchdog::new(Some(limit)));
            shared.begin().unwrap();
            shared.run(0).unwrap();
            if waits {
                shared.state().window.expect();
            }
            std::thread::sleep(limit);
            let nothing = &mut Inputs::default();
            let late = Instant::now();
            shared.deliver(&Inputs::default(), 0, nothing, &mut Inputs::default());
            assert_eq!(shared.state().watchdog.deadline().unwrap() >= late + limit, waits);
        }
    }
}
