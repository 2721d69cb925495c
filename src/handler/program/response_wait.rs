//! Waits for a response: of one thread for one transfer, or for the first of several.

use std::time::Instant;

use crate::error::Error;
use crate::handler::events::Step;
use crate::handler::parts::area_lock::Waiter;
use crate::handler::program::lease::{Known, Lease};
use crate::handler::shared::{Shared, State};
use crate::handler::sync::{current_thread, wait_until, MutexGuard};

/// A wait for a response that is newer than the last one that the handle has returned.
#[derive(Debug)]
pub(crate) enum Wait {
    /// It began when the window of this number was the newest, in the transfer of this number.
    For { window: u64, transfer: u64 },
    /// The thread was woken for this window and is expected to answer in it.
    Told(u64),
}

/// The state of a wait.
enum Progress {
    Waits,
    Told(u64),
    /// The transfer has ended, or there is an error to return.
    Over,
}

impl Shared {
    /// Waits for a response that is newer than the last one that the handle has returned; `None` when the
    /// deadline comes first.
    pub(crate) fn wait_for_response(
        &self,
        state: &mut MutexGuard<'_, State>,
        known: &mut Known,
        deadline: Option<Instant>,
    ) -> Result<Option<u64>, Error> {
        let (window, transfer) = match self.begin_wait(state, known)? {
            Wait::Told(window) => return Ok(Some(window)),
            Wait::For { window, transfer } => (window, transfer),
        };
        // In lock-step only responses move the time.
        let by_clock = deadline.filter(|_| !self.is_lock_step());
        let mut timed_out = false;
        loop {
            match state.progress(known, window, transfer) {
                Progress::Told(window) if !state.is_too_late(deadline) => {
                    return Ok(Some(window));
                }
                Progress::Waits if !timed_out => {
                    timed_out = wait_until(&self.arrived, state, by_clock);
                }
                Progress::Told(_) | Progress::Waits | Progress::Over => break,
            }
        }
        self.give_up(state, window);
        state.check_wait(known, transfer)?;
        Ok(None)
    }

    /// Begins a wait, unless there is already a response for the handle to return.
    fn begin_wait(&self, state: &mut State, known: &mut Known) -> Result<Wait, Error> {
        state.tell_news(known)?;
        state.check_running(known)?;
        if state.window.number() > known.returned {
            if let Some(window) = state.join_window() {
                return Ok(Wait::Told(window));
            }
        }
        state.window.expect();
        if self.is_lock_step() {
            self.attended.notify_one();
        }
        Ok(Wait::For { window: state.window.number(), transfer: state.transfer.number() })
    }

    /// A thread ends its wait that began when `window` was the newest, without an answer.
    fn give_up(&self, state: &mut State, window: u64) {
        if state.window.is_open_for(window + 1) {
            let next = state.area_lock.arrive(Waiter::Reacting);
            self.wake_next(next);
        }
        state.window.give_up(window);
        if state.next_may_leave() {
            self.attended.notify_one();
        }
    }

    /// In lock-step: waits for the next response, or for an error, and does not answer it.
    ///
    /// # Panics
    ///
    /// In lock-step, when the thread has the areas.
    pub(crate) fn step(&self) -> Step {
        if !self.is_lock_step() {
            return Step::ByClock;
        }
        let mut state = self.state_of_others();
        if !state.transfer.is_running() {
            return Step::NoTransfer;
        }
        let window = state.window.number();
        let known = &mut Known {
            returned: window,
            shown: window,
            interruptions: state.interruptions.count(),
        };
        if let Ok(Some(_)) = self.wait_for_response(&mut state, known, None) {
            self.give_up(&mut state, window);
        }
        Step::Done
    }

    // For a thread that waits for the first of several transfers; each of them wakes it.

    /// Panics when this thread has the areas.
    #[track_caller]
    pub(crate) fn check_free(&self) {
        drop(self.state_of_others());
    }

    /// Begins such a wait.
    pub(crate) fn begin_shared_wait(&self, known: &mut Known) -> Result<Wait, Error> {
        let mut state = self.state();
        let wait = self.begin_wait(&mut state, known)?;
        state.wakened.push(current_thread());
        Ok(wait)
    }

    /// When the response came in for which the thread waits; `None` when it has not come in yet.
    ///
    /// After an error the wait is over.
    pub(crate) fn look_after(
        &self,
        wait: &mut Wait,
        known: &mut Known,
    ) -> Result<Option<Instant>, Error> {
        let mut state = self.state();
        if let Wait::For { window, transfer } = *wait {
            match state.progress(known, window, transfer) {
                Progress::Waits => return Ok(None),
                Progress::Told(window) => *wait = Wait::Told(window),
                Progress::Over => {
                    state.forget_waker();
                    self.give_up(&mut state, window);
                    state.check_wait(known, transfer)?;
                }
            }
        }
        Ok(Some(state.arrived))
    }

    /// The thread has a response of another transfer. If it was woken for a response of this one, it comes back
    /// for it, so the window stays open.
    pub(crate) fn put_off(&self, wait: &Wait) {
        let mut state = self.state();
        state.forget_waker();
        let told = match *wait {
            Wait::Told(window) => window,
            Wait::For { window, .. } => window + 1,
        };
        if !self.is_lock_step() && state.window.is_open_for(told) {
            let next = state.area_lock.arrive(Waiter::Reacting);
            self.wake_next(next);
            return state.window.put_off();
        }
        self.give_up(&mut state, told - 1);
    }

    /// Takes the areas for a response for which the thread was woken.
    pub(crate) fn take_after(&self, wait: &Wait, known: Known) -> Lease {
        let mut state = self.state_of_others();
        state.forget_waker();
        let window = match *wait {
            Wait::Told(window) => window,
            Wait::For { window, .. } => window + 1,
        };
        let lease = self.take(&mut state, known, Some(window));
        MutexGuard::unlock_fair(state);
        lease
    }
}

impl State {
    /// The state of a wait that began when `window` was the newest.
    fn progress(&self, known: &Known, window: u64, transfer: u64) -> Progress {
        let goes_on = self.transfer.is_running() && self.transfer.number() == transfer;
        if !goes_on || self.interruptions.has_after(known.interruptions) {
            Progress::Over
        } else if self.window.number() != window {
            Progress::Told(window + 1)
        } else {
            Progress::Waits
        }
    }

    /// Returns the error for which a wait is over.
    fn check_wait(&mut self, known: &mut Known, transfer: u64) -> Result<(), Error> {
        self.tell_news(known)?;
        self.check_running(known)?;
        // Another transfer may have begun meanwhile.
        if self.transfer.number() == transfer {
            Ok(())
        } else {
            Err(Error::NotStarted)
        }
    }

    /// Whether the newest response has moved the time beyond a deadline, in lock-step.
    fn is_too_late(&self, deadline: Option<Instant>) -> bool {
        self.clock.is_lock_step() && deadline.is_some_and(|deadline| deadline < self.clock.now())
    }

    /// This thread does not wait for several transfers any more.
    fn forget_waker(&mut self) {
        let me = current_thread().id();
        self.wakened.retain(|thread| thread.id() != me);
    }
}
