//! What the program's threads and the transfer thread share: the [state](crate::handler::state) under one lock, which
//! is held only for moments, and what threads wait on.
//!
//! The only other locks are that of the listeners, which is taken first, and those of the camera's stream and the I2C
//! connection, under which no other one is taken.

use std::time::Duration;

use crate::client::I2cLine;
use crate::handler::events::Listeners;
use crate::handler::parts::clock::TransferClock;
use crate::handler::parts::tickets::TicketId;
use crate::handler::state::State;
use crate::handler::sync::{lock_soon, Condvar, Mutex, MutexGuard};

/// How many condition variables there are for the program's threads. Two threads that share one wake each other.
const WAKERS: usize = 8;

pub(crate) struct Shared {
    state: Mutex<State>,
    /// For the threads that have tickets.
    wakers: [Condvar; WAKERS],
    /// A command is done, or the transfer's phase has changed.
    pub(crate) changed: Condvar,
    /// The transfer thread has something to do: all threads have answered the response, or a stop was requested.
    pub(crate) attended: Condvar,
    pub(crate) listeners: Mutex<Listeners>,
    /// For all I2C clients, in every transfer.
    pub(crate) i2c: I2cLine,
    /// Whether time moves only while the program waits.
    pub(crate) lock_step: bool,
}

impl Shared {
    pub(crate) fn new(areas: usize, watchdog: Option<Duration>, lock_step: bool) -> Self {
        let state = State::new(areas, watchdog, TransferClock::new(lock_step));
        Self {
            state: Mutex::new(state),
            wakers: Default::default(),
            changed: Condvar::new(),
            attended: Condvar::new(),
            listeners: Mutex::default(),
            i2c: I2cLine::default(),
            lock_step,
        }
    }

    /// One area, and a transfer that is running.
    #[cfg(test)]
    pub(crate) fn running(watchdog: Option<Duration>, lock_step: bool) -> Self {
        let shared = Self::new(1, watchdog, lock_step);
        shared.state().transfer.begin().unwrap();
        shared.state().run(0).unwrap();
        shared
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }

    /// The same for the transfer thread, because the controller waits for it: while other threads lock all
    /// the time, it does not yield its core immediately.
    pub(crate) fn state_soon(&self) -> MutexGuard<'_, State> {
        lock_soon(&self.state)
    }

    /// What the thread with this ticket waits on.
    pub(crate) fn waker(&self, ticket: TicketId) -> &Condvar {
        &self.wakers[ticket as usize % WAKERS]
    }

    /// Wakes the thread with this ticket.
    pub(crate) fn wake(&self, ticket: TicketId) {
        self.waker(ticket).notify_all();
    }

    /// Wakes the thread that may take the areas now: to be called when this may be another one.
    pub(crate) fn wake_first(&self, state: &State) {
        if let Some(ticket) = state.first() {
            self.wake(ticket);
        }
    }
}
