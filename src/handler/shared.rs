//! What the program's threads and the transfer thread share.
//!
//! Each part has a module of its own: the state of the [transfer](crate::handler::parts::state), [who has the
//! areas](crate::handler::parts::area_lock), the [hand-over](crate::handler::parts::hand_over) of outputs and inputs, the [reaction
//! window](crate::handler::parts::window), the [watchdog](crate::handler::parts::watchdog), what has [stopped the
//! outputs](crate::handler::parts::interruptions), and the [cycle hook](crate::handler::parts::hook_slot). None of them uses
//! a lock, and only the hand-over uses another part. Here they are under one lock, which is held only for moments, and the threads wait on
//! the condition variables next to it. What the program's threads do with the parts is in
//! [`program::calls`](crate::handler::program::calls), what the transfer thread does in
//! [`transfer::calls`](crate::handler::transfer::calls).
//!
//! The only other locks are that of the listeners, which is taken first, and those of the I2C connection, under which
//! no other one is taken.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::camera::CameraControl;
use crate::client::I2cLine;
use crate::firmware::FirmwareVersion;
use crate::handler::events::{Event, Listeners, LoggedBeginning, TimedEvent};
use crate::handler::parts::area_lock::{AreaLock, Waiter};
use crate::handler::parts::clock::TransferClock;
use crate::handler::parts::hand_over::HandOver;
use crate::handler::parts::hook_slot::HookSlot;
use crate::handler::parts::interruptions::Interruptions;
use crate::handler::parts::state::Transfer;
use crate::handler::parts::watchdog::Watchdog;
use crate::handler::parts::window::Window;
use crate::handler::statistics::Statistics;
use crate::handler::sync::{lock_soon, Condvar, Mutex, MutexGuard, Thread};
use crate::transfer_area::FishX1Transfer;
use crate::wire::{QueryStatusResponse, StartCameraOnline};

pub(crate) struct Shared {
    state: Mutex<State>,
    /// A response has come in, a command is done, or the transfer's state has changed.
    pub(crate) arrived: Condvar,
    /// The transfer thread has something to do: all threads that waited for the response have reacted, or a
    /// stop was requested.
    pub(crate) attended: Condvar,
    /// The areas were promised to one of the threads that wait for them, by kind of thread. For the hook also:
    /// it may have to be called or to end, or has ended.
    areas_free: [Condvar; Waiter::COUNT],
    pub(crate) listeners: Arc<Listeners>,
    /// For all I2C clients, in every transfer.
    pub(crate) i2c: I2cLine,
    area_count: usize,
    lock_step: bool,
}

#[derive(Debug)]
pub(crate) struct State {
    pub(crate) transfer: Transfer,
    pub(crate) area_lock: AreaLock,
    pub(crate) hand_over: HandOver,
    pub(crate) window: Window,
    pub(crate) watchdog: Watchdog,
    pub(crate) interruptions: Interruptions,
    pub(crate) hook: HookSlot,
    pub(crate) statistics: Statistics,
    /// When the transfer thread, which waits, looks at the limits again.
    pub(crate) looks_again: Option<Instant>,
    /// The lease of whose length the program was last warned.
    pub(crate) warned_lease: u64,
    /// Counts the responses of all transfers.
    pub(crate) delivered: u64,
    /// When the last response of this connection came in.
    pub(crate) last_response: Option<Instant>,
    /// When the newest response came in; before the first of a transfer, when the transfer began.
    pub(crate) arrived: Instant,
    pub(crate) clock: TransferClock,
    /// What the transfer thread is to send now.
    pub(crate) command: Option<CameraCommand>,
    /// Threads that wait for the first of several transfers. They are woken along with those that wait on
    /// `arrived`.
    pub(crate) wakened: Vec<Thread>,
    /// The stream of frames that ends with the transfer.
    pub(crate) camera: Option<Arc<CameraControl>>,
    /// The controller of the last connection.
    pub(crate) controller: Option<Controller>,
}

/// A command that the transfer thread sends between two exchanges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CameraCommand {
    Start(StartCameraOnline),
    Stop,
}

/// The controller of a connection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Controller {
    pub(crate) status: QueryStatusResponse,
    pub(crate) address: Option<IpAddr>,
}

impl Shared {
    /// Areas in the kit's default configuration.
    pub(crate) fn new(
        count: usize,
        watchdog: Watchdog,
        hook_limit: Duration,
        clock: TransferClock,
    ) -> Self {
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
            hook: HookSlot::new(hook_limit),
            statistics: Statistics::default(),
            looks_again: None,
            warned_lease: 0,
            delivered: 0,
            last_response: None,
            arrived: clock.now(),
            clock,
            command: None,
            wakened: Vec::new(),
            camera: None,
            controller: None,
        };
        Self {
            state: Mutex::new(state),
            arrived: Condvar::new(),
            attended: Condvar::new(),
            areas_free: Default::default(),
            listeners: Arc::default(),
            i2c: I2cLine::default(),
            area_count: count,
            lock_step: clock.is_lock_step(),
        }
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }

    /// The same for the transfer thread, because the controller waits for it: while other threads lock all
    /// the time, it does not yield its core immediately.
    pub(crate) fn state_soon(&self) -> MutexGuard<'_, State> {
        lock_soon(&self.state)
    }

    pub(crate) fn area_count(&self) -> usize {
        self.area_count
    }

    /// Whether time moves only while the program waits.
    pub(crate) fn is_lock_step(&self) -> bool {
        self.lock_step
    }

    /// The condition variable on which the waiters of a kind wait for the areas.
    pub(crate) fn areas_free(&self, waiter: Waiter) -> &Condvar {
        &self.areas_free[waiter as usize]
    }

    /// Wakes the thread that may have the areas next.
    pub(crate) fn wake_next(&self, next: Option<Waiter>) {
        match next {
            // Those that wait for its end wait there, too.
            Some(Waiter::Hook) => self.wake_hook(),
            Some(waiter) => {
                self.areas_free(waiter).notify_one();
            }
            None => {}
        }
    }

    /// Wakes the hook's thread, and those that wait for its end.
    pub(crate) fn wake_hook(&self) {
        self.areas_free(Waiter::Hook).notify_all();
    }

    /// Wakes all threads that wait for a response, because it or something else has come.
    pub(crate) fn wake_waiting(&self, state: &State) {
        self.arrived.notify_all();
        self.wake_hook();
        state.wakened.iter().for_each(Thread::unpark);
    }

    pub(crate) fn statistics(&self) -> Statistics {
        self.state().statistics
    }

    pub(crate) fn controller(&self) -> Option<Controller> {
        self.state().controller
    }
}

impl State {
    /// For how long the transfer has been running, or was running when it ended.
    pub(crate) fn elapsed(&self) -> Duration {
        self.transfer.elapsed(self.clock.now())
    }

    /// The beginning of the transfer, while it is running, for a log.
    pub(crate) fn beginning(&self) -> Option<LoggedBeginning> {
        let at = self.transfer.began()?;
        let controller = self.controller.as_ref();
        let status = controller.map(|controller| &controller.status);
        Some(LoggedBeginning {
            at,
            device_name: status.map(QueryStatusResponse::name).unwrap_or_default(),
            firmware: status.map_or(FirmwareVersion::OLDEST_SUPPORTED, |status| status.version),
            address: controller.and_then(|controller| controller.address),
            areas: self.hand_over.outgoing().len(),
        })
    }

    /// An event that does not come with a response, with the current time.
    pub(crate) fn happens_now(&self, event: Event) -> TimedEvent {
        TimedEvent { event, cycle: self.statistics.cycles, arrived: self.clock.now() }
    }
}
