//! What the transfer thread, and the thread that begins a transfer, do with the state that they share with the
//! program.

use std::time::{Duration, Instant};

use crate::camera::CameraServer;
use crate::client::Endpoint;
use crate::error::Error;
use crate::events::{Event, KindSet, Logged, LoggedCycle};
use crate::exchange::{Inputs, Outgoing, SentConfigs};
use crate::handler::long_guard::{warn_of, GUARD_IS_LONG};
use crate::handler::parts::phase::Stop;
use crate::handler::shared::Shared;
use crate::handler::state::{Delivered, State};
use crate::handler::sync::{now, wait_on_time, wait_until, MutexGuard};
use crate::notices::notice;

/// A response that was delivered, and who wants to learn of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Delivery {
    pub(crate) response: Delivered,
    /// The events that have listeners.
    pub(crate) listened: KindSet,
    /// Whether there are logs of all cycles.
    pub(crate) logged: bool,
    /// Whether the window is still closed: in lock-step the events and logs come first.
    pub(crate) opens_later: bool,
}

impl Shared {
    /// The areas as the last guard left them.
    pub(crate) fn outgoing(&self) -> Vec<Outgoing> {
        self.state().outgoing().to_vec()
    }

    /// Why the transfer is to stop although the connection works.
    pub(crate) fn stop(&self) -> Option<Stop> {
        self.state().transfer.stop()
    }

    // The beginning.

    /// Begins a transfer for which this number of configurations was sent; returns an error when it was
    /// stopped meanwhile.
    pub(crate) fn run(&self, config_updates: u64) -> Result<(), Stop> {
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        state.run(config_updates)?;
        if let Some(beginning) = state.beginning().filter(|_| !listeners.logs.is_empty()) {
            listeners.logs.note(&Logged::Began(beginning));
        }
        drop(state);
        self.changed.notify_all();
        Ok(())
    }

    /// Stores why a transfer could not begin. One that runs, but has no thread, ends.
    pub(crate) fn fail(&self, error: Error) {
        let is_running = self.state().transfer.is_running();
        if is_running {
            return self.finish(Some(error));
        }
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        let at = state.clock.now();
        // A transfer that another thread has ended is not a failure.
        let error = Some(error).filter(|error| *error != Error::NotStarted);
        state.transfer.end(at, error.clone());
        drop(state);
        self.changed.notify_all();
        if let Some(error) = error {
            listeners.logs.note(&Logged::Failed { at, error });
        }
    }

    // A cycle.

    /// Delivers a response, and opens its window, unless somebody else is to learn of it first.
    ///
    /// If there are listeners, the inputs as the program sees them are put into `now`, and those of the
    /// previous response into `before`.
    ///
    /// If nobody has to learn of it before the program's outputs are taken, the state stays locked for
    /// [`hold_window`](Self::hold_window): otherwise the threads that were woken meet the transfer thread at the
    /// lock.
    pub(crate) fn deliver(
        &self,
        inputs: &Inputs,
        before: &mut Inputs,
        now: &mut Inputs,
    ) -> (Delivery, Option<MutexGuard<'_, State>>) {
        let listeners = self.listeners.lock();
        let mut state = self.state_soon();
        let (listened, logged) = (listeners.kinds(), !listeners.logs.is_empty());
        drop(listeners);
        if !listened.is_empty() {
            before.clone_from(state.incoming());
        }
        let response = state.deliver(inputs);
        if !listened.is_empty() {
            now.clone_from(state.incoming());
        }
        let has_audience = logged || !listened.is_empty();
        let opens_later = has_audience && self.lock_step;
        if !opens_later {
            state.open_window(|ticket| self.wake(ticket));
        }
        let locked = Some(state).filter(|_| !has_audience);
        (Delivery { response, listened, logged, opens_later }, locked)
    }

    /// Opens the window for reactions to the last response.
    pub(crate) fn open_window(&self) {
        self.state().open_window(|ticket| self.wake(ticket));
    }

    /// Logs a response that was delivered, with the areas of its request and the configurations that were sent.
    pub(crate) fn log(
        &self,
        response: &Delivered,
        sent: (&[Outgoing], &SentConfigs),
        inputs: &Inputs,
    ) {
        let Delivered { cycle, arrived, first, .. } = *response;
        let statistics = self.state().statistics;
        let cycle = LoggedCycle::exchanged(cycle, arrived, first, statistics, sent, inputs);
        self.listeners.lock().logs.note_cycle(&cycle);
    }

    /// Holds the window open until all threads have reacted, it has lasted `length`, or a stop is requested;
    /// then takes the outputs for the next request into `areas`. The state may be `locked` since its delivery.
    ///
    /// When the watchdog expires, stops the outputs and informs the program.
    pub(crate) fn hold_window(
        &self,
        locked: Option<MutexGuard<'_, State>>,
        length: Duration,
        areas: &mut [Outgoing],
    ) -> Option<Stop> {
        let mut state = locked.unwrap_or_else(|| self.state_soon());
        let end = state.window_end(length);
        while state.transfer.stop().is_none() && !state.next_may_leave() {
            let deadline = state.next_deadline(end);
            if wait_on_time(&self.attended, &mut state, deadline) {
                // That of the watchdog may have moved meanwhile.
                if state.next_deadline(end).is_some_and(|next| Some(next) <= deadline) {
                    break;
                }
            }
        }
        let expired = state.check_watchdog(|ticket| self.wake(ticket));
        let stop = self.take_outputs(&mut state, areas);
        let event = expired.map(|limit| state.happens_now(Event::WatchdogExpired { limit }));
        let held = state.guard_to_warn_of(GUARD_IS_LONG, expired.is_some());
        let peer = (expired.is_some() || held.is_some()).then(|| state.peer());
        drop(state);
        let peer = peer.unwrap_or_default();
        if let (Some(limit), Some(event)) = (expired, event) {
            notice!(Warn, "{peer}{}", Error::WatchdogExpired { limit });
            self.listeners.lock().send_all(&event);
        }
        if let Some(held) = held {
            warn_of(&held, &peer, expired.is_some());
        }
        stop
    }

    /// In lock-step: waits until the program asks for the next response or a stop is requested, and takes the outputs as
    /// [`hold_window`](Self::hold_window). `None` when a command is to be sent before that.
    pub(crate) fn wait_for_step(&self, areas: &mut [Outgoing]) -> Option<Option<Stop>> {
        let mut state = self.state();
        loop {
            let stop = state.transfer.stop();
            if stop.is_none() && state.command_comes_first() {
                return None;
            }
            if stop.is_some() || state.next_may_leave() {
                return Some(self.take_outputs(&mut state, areas));
            }
            wait_until(&self.attended, &mut state, Some(now() + GUARD_IS_LONG));
            if let Some(held) = state.guard_to_warn_of(GUARD_IS_LONG, false) {
                let peer = state.peer();
                MutexGuard::unlocked(&mut state, || warn_of(&held, &peer, false));
            }
        }
    }

    /// Closes the window and takes the outputs for the next request. Returns a stop if the transfer is to stop.
    fn take_outputs(&self, state: &mut State, areas: &mut [Outgoing]) -> Option<Stop> {
        state.close_window();
        self.wake_first(state);
        assert_eq!(areas.len(), state.outgoing().len(), "areas of the transfer and of the program");
        areas.copy_from_slice(state.outgoing());
        state.transfer.stop()
    }

    // The camera.

    /// The program's command was sent.
    pub(crate) fn command_is_done(&self) {
        self.state().camera.command_is_done();
        self.changed.notify_all();
    }

    /// The camera server to start again, when the stream is ready for that.
    pub(crate) fn prepare_camera(&self, server: &Endpoint) -> Option<CameraServer> {
        let stream = self.state().camera.stream.clone();
        match stream {
            Some(stream) => stream.prepare(server),
            None => Some(CameraServer::not_connected(server.clone())),
        }
    }

    /// The controller's camera server was started again.
    pub(crate) fn resume_camera(&self, server: CameraServer) {
        let mut state = self.state();
        state.camera.restart_at = None;
        if let Some(stream) = &state.camera.stream {
            stream.resume(server);
        }
    }

    /// Stops the stream of frames, which ends with the transfer.
    pub(crate) fn stop_camera(&self) {
        if let Some(stream) = self.state().camera.stream.clone() {
            stream.stop();
        }
    }

    // Gaps.

    /// The connection was lost, and another one is to be made: stops the outputs, takes them for the last
    /// request on this connection, and informs the program.
    pub(crate) fn lose_connection(&self, error: &Error, areas: &mut [Outgoing]) {
        // Locked until the event is sent: in lock-step a listener that is woken finds it.
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        state.lose_connection(error, |ticket| self.wake(ticket));
        self.wake_first(&state);
        areas.copy_from_slice(state.outgoing());
        if let Some(stream) = &state.camera.stream {
            stream.pause();
        }
        let event = state.happens_now(Event::ConnectionLost { error: error.clone() });
        listeners.send_all(&event);
    }

    /// The connection that was lost at this time is re-established, and its first response has come in.
    pub(crate) fn resume(&self, lost_at: Instant) {
        let mut state = self.state();
        // In the gap the program could not show that it is alive.
        state.watchdog.feed(now());
        let after = state.clock.now() - lost_at;
        let (device_name, firmware, address) = state.answering();
        let restored = Event::ConnectionRestored { after, device_name, firmware, address };
        let event = state.happens_now(restored);
        drop(state);
        self.listeners.lock().send_all(&event);
    }

    /// Waits until a stop is requested, but not beyond the deadline.
    pub(crate) fn wait_for_stop(&self, deadline: Instant) {
        let mut state = self.state();
        while state.transfer.stop().is_none() && now() < deadline {
            wait_until(&self.attended, &mut state, Some(deadline));
        }
    }

    // The end.

    /// The transfer is about to end: stops the outputs, and takes them for the last request.
    pub(crate) fn leave(&self, areas: &mut [Outgoing]) {
        let mut state = self.state();
        state.leave();
        // After a panic of the transfer thread even the number of areas may be wrong.
        for (area, outgoing) in areas.iter_mut().zip(state.outgoing()) {
            *area = *outgoing;
        }
    }

    /// Ends the transfer.
    pub(crate) fn finish(&self, error: Option<Error>) {
        // Locked until the listeners are informed, so that later ones do not get this end.
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        state.finish(error.clone(), |ticket| self.wake(ticket));
        self.wake_first(&state);
        let event = state.happens_now(Event::TransferEnded { error });
        drop(state);
        self.changed.notify_all();
        listeners.send_end(&event);
        drop(listeners);
        // Again, for a stream that was started at the last moment.
        self.stop_camera();
    }
}

#[cfg(all(test, not(shuttle)))]
#[path = "side_tests.rs"]
mod tests;
