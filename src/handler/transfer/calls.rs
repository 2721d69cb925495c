//! What the handler and the transfer thread do with the state that they share with the program's threads.

use std::time::{Duration, Instant};

use crate::camera::CameraServer;
use crate::client::Endpoint;
use crate::error::Error;
use crate::exchange::Inputs;
use crate::handler::events::{Event, KindSet, Logged, LoggedCycle};
use crate::handler::parts::area_lock::Waiter;
use crate::handler::parts::state::Stop;
use crate::handler::parts::unfinished::Cut;
use crate::handler::shared::CameraCommand;
use crate::handler::shared::{Controller, Shared, State};
use crate::handler::statistics::Statistics;
use crate::handler::sync::{earlier, now, wait_on_time, wait_until, MutexGuard};
use crate::handler::transfer::long_guard::GUARD_IS_LONG;
use crate::notices::notice;
use crate::transfer_area::FishX1Transfer;

/// What the transfer thread learns when it delivers a response.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Delivered {
    /// The response's number.
    pub(crate) number: u64,
    /// Its number in its transfer.
    pub(crate) cycle: u64,
    /// When it came in.
    pub(crate) arrived: Instant,
    /// Whether it is the first of its connection.
    pub(crate) first: bool,
    /// The events that have listeners.
    pub(crate) listened: KindSet,
    /// Whether there are logs of all cycles.
    pub(crate) logged: bool,
    /// Whether the waiting threads are told later: in lock-step after the events.
    pub(crate) opens_later: bool,
}

impl Shared {
    /// The areas as the last guard left them.
    pub(crate) fn outgoing(&self) -> Vec<FishX1Transfer> {
        self.state().hand_over.outgoing().to_vec()
    }

    /// A thread of the program begins to connect.
    pub(crate) fn begin(&self) -> Result<(), Error> {
        self.state().transfer.begin()
    }

    /// Sets the controller of the connection.
    pub(crate) fn set_controller(&self, controller: Controller) {
        self.state().controller = Some(controller);
    }

    /// Begins a transfer for which this number of configurations was sent; returns an error when it was
    /// stopped meanwhile.
    pub(crate) fn run(&self, config_updates: u64) -> Result<(), Stop> {
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        let now = state.clock.now();
        state.transfer.run(now)?;
        state.last_response = None;
        state.arrived = now;
        state.command = None;
        state.watchdog.start();
        state.statistics = Statistics { config_updates, ..Statistics::default() };
        if let Some(beginning) = state.beginning().filter(|_| !listeners.logs().is_empty()) {
            listeners.logs().note(&Logged::Began(beginning));
        }
        Ok(())
    }

    /// Delivers a response, and opens its window, unless the events come first.
    ///
    /// If there are listeners, the inputs as the program sees them are put into `now`, and those of the
    /// previous response into `before`.
    ///
    /// If there is nothing to tell before the program's outputs are taken, the state stays locked for
    /// [`hold_window`](Self::hold_window): otherwise the threads that were woken meet the transfer thread at the
    /// lock.
    pub(crate) fn deliver(
        &self,
        inputs: &Inputs,
        config_updates: u64,
        before: &mut Inputs,
        now: &mut Inputs,
    ) -> (Delivered, Option<MutexGuard<'_, State>>) {
        let mut listeners = self.listeners.lock();
        let mut locked = self.state_soon();
        let state = &mut *locked;
        state.delivered += 1;
        // What a thread writes that sees this response counts.
        state.transfer.resume();
        let listened = listeners.note_response(state.delivered);
        let logged = !listeners.logs().is_empty();
        drop(listeners);
        if !listened.is_empty() {
            before.clone_from(state.hand_over.incoming());
        }
        state.hand_over.put(inputs);
        if !listened.is_empty() {
            now.clone_from(state.hand_over.incoming());
        }
        state.clock.step();
        let arrived = state.clock.now();
        state.arrived = arrived;
        let previous = state.last_response.replace(arrived);
        state.statistics.count_response(previous, arrived);
        state.statistics.config_updates += config_updates;
        self.call_hook(state);
        let tells = logged || !listened.is_empty();
        let lock_step = state.clock.is_lock_step();
        let opens_later = lock_step && tells;
        if !opens_later {
            self.open(state);
        }
        let delivered = Delivered {
            number: state.delivered,
            cycle: state.statistics.cycles,
            arrived,
            first: previous.is_none(),
            listened,
            logged,
            opens_later,
        };
        (delivered, Some(locked).filter(|_| !tells && !lock_step))
    }

    /// Logs a response that was delivered, with the areas of its request.
    pub(crate) fn log(&self, delivered: &Delivered, sent: &[FishX1Transfer], inputs: &Inputs) {
        let Delivered { cycle, arrived, first, .. } = *delivered;
        let statistics = self.statistics();
        let cycle = LoggedCycle::exchanged(cycle, arrived, first, statistics, sent, inputs);
        self.listeners.lock().logs().note_cycle(&cycle);
    }

    /// Opens the window for reactions to the last response, and wakes all threads that wait for it.
    pub(crate) fn open_window(&self) {
        self.open(&mut self.state());
    }

    fn open(&self, state: &mut State) {
        let told = state.window.open();
        state.area_lock.expect(Waiter::Reacting, told);
        if told > 0 {
            state.feed_for_waiting();
        }
        self.wake_waiting(state);
    }

    /// Holds the window open until all threads have reacted, it has lasted `length`, or a stop is requested;
    /// then takes the outputs for the next request into `areas`. In lock-step it lasts until the program
    /// asks for the next response. The state may be `locked` since its delivery.
    ///
    /// When the watchdog expires, stops the outputs and tells the program.
    pub(crate) fn hold_window(
        &self,
        locked: Option<MutexGuard<'_, State>>,
        length: Duration,
        areas: &mut [FishX1Transfer],
    ) -> Option<Stop> {
        let mut state = locked.unwrap_or_else(|| self.state_soon());
        let end = state.window_end(length);
        while state.transfer.stop().is_none() && !state.next_may_leave() {
            state.looks_again = state.next_deadline(end);
            let deadline = state.looks_again;
            if wait_on_time(&self.attended, &mut state, deadline) {
                // Those of the watchdog and the hook may have moved meanwhile.
                if state.next_deadline(end).is_some_and(|next| Some(next) <= deadline) {
                    break;
                }
            }
        }
        self.give_up_hook(&mut state);
        let expired = state.check_watchdog();
        let missed = self.close_window(&mut state);
        let stop = state.transfer.stop();
        state.statistics.missed_responses += u64::from(missed && stop.is_none());
        let outgoing = state.hand_over.outgoing();
        assert_eq!(areas.len(), outgoing.len(), "areas of the transfer and of the program");
        for (area, outgoing) in areas.iter_mut().zip(outgoing) {
            *area = *outgoing;
        }
        let expired =
            expired.map(|limit| (limit, state.happens_now(Event::WatchdogExpired { limit })));
        if expired.is_some() {
            self.wake_waiting(&state);
        }
        let held = state.guard_to_warn_of(expired.is_some());
        drop(state);
        if let Some((limit, event)) = expired {
            notice!(Warn, "{}", Error::WatchdogExpired { limit });
            self.listeners.tell_all(&event);
        }
        if let Some(held) = held {
            held.warn();
        }
        stop
    }

    /// In lock-step: waits until the program asks for the next response or a stop is requested; returns
    /// whether a command is to be sent first.
    pub(crate) fn wait_for_step(&self) -> bool {
        let mut state = self.state();
        if !state.clock.is_lock_step() {
            return false;
        }
        while state.transfer.stop().is_none() {
            if state.command.is_some() {
                return true;
            }
            if state.next_may_leave() {
                break;
            }
            // Nobody else looks at the limits of the hook and of guards.
            let look_again = now() + GUARD_IS_LONG;
            let deadline = earlier(Some(look_again), state.hook.deadline());
            state.looks_again = deadline;
            wait_until(&self.attended, &mut state, deadline);
            self.give_up_hook(&mut state);
            if let Some(held) = state.guard_to_warn_of(false) {
                MutexGuard::unlocked(&mut state, || held.warn());
            }
        }
        false
    }

    /// Closes the window, and releases the areas for all threads; returns whether the program has missed the
    /// response.
    fn close_window(&self, state: &mut State) -> bool {
        let next = state.area_lock.expect_nobody();
        self.wake_next(next);
        state.window.close(state.delivered)
    }

    /// The connection was lost, and another one is to be made: stops the outputs, takes them for the last
    /// request on this connection, and tells the program.
    pub(crate) fn lose_connection(&self, error: &Error, areas: &mut [FishX1Transfer]) {
        let mut state = self.state();
        let cause = Box::new(error.clone());
        state.interruptions.note(Error::ConnectionLost { cause });
        state.window.interrupt();
        // It would answer what came before the gap.
        let left_out = state.hook.stop();
        state.statistics.missed_hook_calls += u64::from(left_out);
        state.hand_over.stop(Cut::Connection);
        areas.copy_from_slice(state.hand_over.outgoing());
        state.transfer.reconnect();
        state.statistics.gaps += 1;
        state.last_response = None;
        self.close_window(&mut state);
        let camera = state.camera.clone();
        let event = state.happens_now(Event::ConnectionLost { error: error.clone() });
        self.wake_waiting(&state);
        drop(state);
        if let Some(camera) = camera {
            camera.pause();
        }
        self.listeners.tell_all(&event);
    }

    /// The connection is re-established, and its first response has come in.
    pub(crate) fn resume(&self, lost_for: Duration) {
        let mut state = self.state();
        state.watchdog.feed();
        let event = state.happens_now(Event::ConnectionRestored { after: lost_for });
        drop(state);
        self.listeners.tell_all(&event);
    }

    /// Waits until a stop is requested, also by a hook that hangs, but not beyond the deadline.
    pub(crate) fn wait_for_stop(&self, deadline: Instant) {
        let mut state = self.state();
        while state.transfer.stop().is_none() && now() < deadline {
            state.looks_again = earlier(Some(deadline), state.hook.deadline());
            let looks_again = state.looks_again;
            wait_until(&self.attended, &mut state, looks_again);
            self.give_up_hook(&mut state);
        }
    }

    /// Counts configurations that were sent outside an exchange.
    pub(crate) fn count_config_updates(&self, count: u64) {
        self.state().statistics.config_updates += count;
    }

    /// The camera server to start again, when the stream is ready for that.
    pub(crate) fn prepare_camera(&self, server: &Endpoint) -> Option<CameraServer> {
        let camera = self.state().camera.clone();
        match camera {
            Some(camera) => camera.prepare(server),
            None => Some(CameraServer::not_connected(server.clone())),
        }
    }

    /// The controller's camera server was started again.
    pub(crate) fn resume_camera(&self, server: CameraServer) {
        let camera = self.state().camera.clone();
        if let Some(camera) = camera {
            camera.resume(server);
        }
    }

    /// Why the transfer is to stop although the connection works.
    pub(crate) fn stop(&self) -> Option<Stop> {
        self.state().transfer.stop()
    }

    /// The command to send now.
    pub(crate) fn command(&self) -> Option<CameraCommand> {
        self.state().command
    }

    pub(crate) fn command_is_done(&self) {
        self.state().command = None;
        self.arrived.notify_all();
    }

    /// Stops the stream of frames that ends with the transfer.
    pub(crate) fn stop_camera(&self) {
        let camera = self.state().camera.take();
        if let Some(camera) = camera {
            camera.stop();
        }
    }

    /// The transfer is about to end: stops the outputs, and takes them for the last request.
    pub(crate) fn leave(&self, areas: &mut [FishX1Transfer]) {
        let mut state = self.state();
        state.interruptions.note_end();
        state.hand_over.stop(Cut::Connection);
        state.transfer.leave();
        // After a panic of the transfer thread even the number of areas may be wrong.
        for (area, outgoing) in areas.iter_mut().zip(state.hand_over.outgoing()) {
            *area = *outgoing;
        }
    }

    /// Ends the transfer.
    pub(crate) fn finish(&self, error: Option<Error>) {
        // Locked until the listeners are told, so that later ones do not get this end.
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        self.close_window(&mut state);
        state.hook.stop();
        state.command = None;
        let now = state.clock.now();
        state.transfer.end(now, error.clone());
        let event = state.happens_now(Event::TransferEnded { error });
        self.wake_waiting(&state);
        drop(state);
        listeners.tell_end(&event);
        drop(listeners);
        // Again, for a stream that was started at the last moment.
        self.stop_camera();
    }

    /// Stores why a transfer could not begin.
    pub(crate) fn fail(&self, error: Error) {
        let mut listeners = self.listeners.lock();
        let mut state = self.state();
        let at = state.clock.now();
        // A transfer that another thread has ended is not a failure.
        let error = Some(error).filter(|error| *error != Error::NotStarted);
        state.transfer.end(at, error.clone());
        self.wake_waiting(&state);
        drop(state);
        if let Some(error) = error {
            listeners.logs().note(&Logged::Failed { at, error });
        }
    }
}

impl State {
    /// When a window of this length ends; in lock-step the clock does not end it.
    pub(crate) fn window_end(&self, length: Duration) -> Option<Instant> {
        let last_response = self.last_response.filter(|_| !self.clock.is_lock_step());
        last_response.and_then(|response| response.checked_add(length))
    }

    /// When the window ends, the watchdog expires or the hook hangs, whichever is first.
    fn next_deadline(&self, end: Option<Instant>) -> Option<Instant> {
        earlier(end, earlier(self.watchdog.deadline(), self.hook.deadline()))
    }

    /// Whether the next request need not wait for the program any more.
    pub(crate) fn next_may_leave(&self) -> bool {
        if !self.clock.is_lock_step() {
            return self.window.is_attended() && !self.hook.is_answering();
        }
        let nobody_works = self.area_lock.holder().is_none() && !self.hook.is_busy();
        self.window.is_next_asked_for() && nobody_works || self.command.is_some()
    }

    /// A program that has waited for a late response does not hang. But while a thread has the areas, nobody
    /// can do anything: then only the time before that was a sign of life.
    pub(crate) fn feed_for_waiting(&mut self) {
        let since = self.area_lock.holder().map(|holder| holder.since);
        self.watchdog.feed_at(since.unwrap_or_else(now));
    }

    /// If the watchdog expires, stops the motors and returns its limit.
    fn check_watchdog(&mut self) -> Option<Duration> {
        let number = self.interruptions.count() + 1;
        let limit = self.watchdog.check(self.clock.now(), number)?;
        self.interruptions.note(Error::WatchdogExpired { limit });
        self.window.interrupt();
        self.hand_over.stop(Cut::Motors);
        Some(limit)
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests;
