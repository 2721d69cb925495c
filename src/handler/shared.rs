//! Where the program's threads and the transfer thread meet.
//!
//! Each thing has a room of its own: where the [transfer](super::state) stands, [who has the
//! areas](super::area_lock), the [hand-over](super::hand_over) of outputs and inputs, the [reaction
//! window](super::window), the [watchdog](super::watchdog), what has [stopped the
//! outputs](super::interruptions), and the [cycle hook](super::hook_slot). None of them knows another
//! or a lock. Here they are under one lock, which is held for moments only, and the threads wait on the
//! conditions beside it. What the program's threads do with them is in
//! [`program_side`](super::program_side), what the transfer thread does in
//! [`transfer_side`](super::transfer_side).
//!
//! The lock of the listeners is the only other one. It is taken first.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::Instant;

use super::area_lock::{AreaLock, Waiter};
use super::command::Command;
use super::events::Listeners;
use super::hand_over::HandOver;
use super::hook_slot::HookSlot;
use super::interruptions::Interruptions;
use super::state::Transfer;
use super::statistics::Statistics;
use super::sync::{lock_soon, Condvar, Mutex, MutexGuard};
use super::watchdog::Watchdog;
use super::window::Window;
use crate::camera::CameraControl;
use crate::transfer_area::FishX1Transfer;
use crate::wire::QueryStatusResponse;

pub(super) struct Shared {
    state: Mutex<State>,
    /// A response has come in, a command is done, or the transfer's state has changed.
    pub(super) arrived: Condvar,
    /// The transfer thread has something to do: all who waited for the response have reacted, the
    /// areas are free for the hook, the hook has returned, or a stop is asked for.
    pub(super) attended: Condvar,
    /// The areas were promised to one of those who wait for them, by their kind.
    areas_free: [Condvar; 2],
    /// The hook has a turn or is to end, or what it was doing is done.
    pub(super) hook_turn: Condvar,
    pub(super) listeners: Arc<Listeners>,
    area_count: usize,
}

#[derive(Debug)]
pub(super) struct State {
    pub(super) transfer: Transfer,
    pub(super) area_lock: AreaLock,
    pub(super) hand_over: HandOver,
    pub(super) window: Window,
    pub(super) watchdog: Watchdog,
    pub(super) interruptions: Interruptions,
    pub(super) hook: HookSlot,
    pub(super) statistics: Statistics,
    /// Counts the responses of all transfers.
    pub(super) delivered: u64,
    /// When the last response of this connection came in.
    pub(super) last_response: Option<Instant>,
    /// What the transfer thread is to send now.
    pub(super) command: Option<Command>,
    /// The stream of frames that ends with the transfer.
    pub(super) camera: Option<Arc<CameraControl>>,
    /// The controller that the last connection led to.
    pub(super) controller: Option<Controller>,
}

/// Whom a connection leads to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Controller {
    pub(super) status: QueryStatusResponse,
    pub(super) address: Option<IpAddr>,
}

impl Shared {
    /// Areas in the kit's default configuration.
    pub(super) fn new(count: usize, watchdog: Watchdog) -> Self {
        let mut areas = vec![FishX1Transfer::default(); count];
        for (id, area) in (0..).zip(&mut areas) {
            area.state.id = id;
        }
        let state = State {
            transfer: Transfer::new(),
            area_lock: AreaLock::new(areas.clone()),
            hand_over: HandOver::new(areas),
            window: Window::default(),
            watchdog,
            interruptions: Interruptions::default(),
            hook: HookSlot::default(),
            statistics: Statistics::default(),
            delivered: 0,
            last_response: None,
            command: None,
            camera: None,
            controller: None,
        };
        Self {
            state: Mutex::new(state),
            arrived: Condvar::new(),
            attended: Condvar::new(),
            areas_free: [Condvar::new(), Condvar::new()],
            hook_turn: Condvar::new(),
            listeners: Arc::default(),
            area_count: count,
        }
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }

    /// The same for the transfer thread, on which the controller waits: beside threads that lock all the
    /// time it does not give its core away at once.
    pub(super) fn state_soon(&self) -> MutexGuard<'_, State> {
        lock_soon(&self.state)
    }

    pub(super) fn area_count(&self) -> usize {
        self.area_count
    }

    /// Where the waiters of a kind wait for the areas.
    pub(super) fn areas_free(&self, waiter: Waiter) -> &Condvar {
        &self.areas_free[waiter as usize]
    }

    /// Wakes whoever may have the areas next.
    pub(super) fn wake_next(&self, state: &State, next: Option<Waiter>) {
        if let Some(waiter) = next {
            self.areas_free(waiter).notify_one();
        } else if state.area_lock.hook_waits() {
            self.attended.notify_one();
        }
    }

    pub(super) fn statistics(&self) -> Statistics {
        self.state().statistics
    }

    pub(super) fn controller(&self) -> Option<Controller> {
        self.state().controller
    }
}
