//! The thread that calls the program back.
//!
//! The threads of the transfers only leave here what has happened. So a callback may take its time, call the
//! library, close its device or never return: the transfers go on.

use std::collections::VecDeque;
use std::sync::{Arc, Weak};
use std::thread::{self, JoinHandle, ThreadId};
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use crate::inside::{self, Programs};
use crate::process;

/// How long is waited for a running callback when it is taken away, or its device closed.
const WAIT_LIMIT: Duration = Duration::from_secs(1);
/// How many calls may wait for a callback that does not return.
const WAITING: usize = 10_000;

/// What a call is made for, and what stays until the call has returned: an open device.
pub(super) trait Owner: Send + Sync {
    /// No call is made for one that is closed.
    fn is_open(&self) -> bool;
}

/// A callback of the program for one kind of event.
pub(super) type EventCallback = unsafe extern "system" fn(u32, u32);

/// The kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// `SetCBCounterResetted`.
    CounterResetted,
    /// `SetCBMotorExReached`.
    MotorExReached,
    /// `SetCBRoboExtState`.
    RoboExtState,
}

/// What the program has set; a library has one of each kind.
static SET: Mutex<[Option<EventCallback>; 3]> = Mutex::new([None; 3]);

/// The callback for a kind of event.
fn set_for(event: Event) -> Option<EventCallback> {
    SET.lock()[event as usize]
}

enum Call {
    /// For the callback that is set when its turn comes.
    Event(Event, u32, u32),
    /// One that was given with a request.
    Once(Box<dyn FnOnce() + Send>),
}

impl Call {
    fn event(&self) -> Option<Event> {
        match self {
            Self::Event(event, ..) => Some(*event),
            Self::Once(_) => None,
        }
    }
}

/// The thread while a library is initialized, and what waits for it.
pub(super) struct Callbacks {
    queue: Mutex<Queue>,
    /// Something to do.
    wake: Condvar,
    /// A call has returned.
    returned: Condvar,
    thread: Mutex<Option<JoinHandle<()>>>,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<(Weak<dyn Owner>, Call)>,
    running: Option<Running>,
    ended: bool,
    /// The thread has left its loop.
    left: bool,
}

struct Running {
    event: Option<Event>,
    owner: Weak<dyn Owner>,
    thread: ThreadId,
}

impl Callbacks {
    /// Starts the thread.
    pub(super) fn start() -> std::io::Result<Arc<Self>> {
        process::begin();
        let callbacks = Arc::new(Self {
            queue: Mutex::default(),
            wake: Condvar::new(),
            returned: Condvar::new(),
            thread: Mutex::default(),
        });
        let own = Arc::clone(&callbacks);
        let thread = thread::Builder::new().name("callbacks of C".into());
        let programs = Programs::of_this_thread();
        let run = move || {
            programs.begin();
            own.run();
        };
        *callbacks.thread.lock() = Some(thread.spawn(run)?);
        Ok(callbacks)
    }

    /// Tells the program of an event, if it wants to know.
    pub(super) fn event(&self, owner: Weak<dyn Owner>, event: Event, area: usize, what: u32) {
        if set_for(event).is_some() {
            self.push(owner, Call::Event(event, area as u32, what));
        }
    }

    /// Makes a call, unless its owner is closed before its turn comes.
    pub(super) fn once(&self, owner: Weak<dyn Owner>, call: impl FnOnce() + Send + 'static) {
        self.push(owner, Call::Once(Box::new(call)));
    }

    fn push(&self, owner: Weak<dyn Owner>, call: Call) {
        let mut queue = self.queue.lock();
        if queue.ended {
            return;
        }
        if queue.waiting.len() >= WAITING {
            log::error!("a callback does not return, so the program is not notified of an event");
            return;
        }
        queue.waiting.push_back((owner, call));
        self.wake.notify_one();
    }

    fn run(&self) {
        while let Some((owner, call)) = self.next() {
            match call {
                Call::Event(event, area, what) => {
                    // Under no lock: the callback may set callbacks. `next` has seen one, and a thread that has
                    // removed it since then waits for this call.
                    if let Some(callback) = set_for(event) {
                        // SAFETY: the program has set it as a function of this kind.
                        inside::leave(|| unsafe { callback(area, what) });
                    }
                }
                Call::Once(call) => inside::leave(call),
            }
            self.queue.lock().running = None;
            self.returned.notify_all();
            // It may be the last one that has the device.
            drop(owner);
        }
        self.queue.lock().left = true;
        self.returned.notify_all();
    }

    /// Waits for the next call; `None` at the end.
    fn next(&self) -> Option<(Arc<dyn Owner>, Call)> {
        let mut queue = self.queue.lock();
        loop {
            if queue.ended {
                return None;
            }
            let Some((owner, call)) = queue.waiting.pop_front() else {
                self.wake.wait(&mut queue);
                continue;
            };
            let Some(owner) = owner.upgrade().filter(|owner| owner.is_open()) else { continue };
            queue.running = Some(Running {
                event: call.event(),
                owner: Arc::downgrade(&owner),
                thread: thread::current().id(),
            });
            return Some((owner, call));
        }
    }

    /// Waits until no callback for this kind of event is running.
    fn settle_event(&self, event: Event) {
        self.settle(|running| running.event == Some(event));
    }

    /// Waits until no callback for this owner is running. It must be closed before.
    pub(super) fn settle_owner(&self, owner: &Weak<dyn Owner>) {
        self.settle(|running| running.owner.ptr_eq(owner));
    }

    /// Waits until no such callback is running, but not forever, and not in the callback itself.
    fn settle(&self, is_meant: impl Fn(&Running) -> bool) {
        let is_over = |queue: &Queue| {
            let running = queue.running.as_ref().filter(|running| is_meant(running));
            running.is_none_or(|running| running.thread == thread::current().id())
        };
        if !self.wait_until(&mut self.queue.lock(), is_over) {
            log::error!("a callback has not returned within {WAIT_LIMIT:?}; it is not waited for");
        }
    }

    fn wait_until(
        &self,
        queue: &mut MutexGuard<'_, Queue>,
        mut is_over: impl FnMut(&Queue) -> bool,
    ) -> bool {
        let deadline = Instant::now() + WAIT_LIMIT;
        while !is_over(queue) {
            if self.returned.wait_until(queue, deadline).timed_out() {
                return is_over(queue);
            }
        }
        true
    }

    /// Ends the thread. A callback that does not return keeps it until then.
    pub(super) fn end(&self) {
        let mut queue = self.queue.lock();
        queue.ended = true;
        let given_up = std::mem::take(&mut queue.waiting);
        self.wake.notify_one();
        let is_own = queue.running.as_ref().is_some_and(|it| it.thread == thread::current().id());
        let has_ended = !is_own && self.wait_until(&mut queue, |queue| queue.left);
        drop(queue);
        drop(given_up);
        if let Some(thread) = self.thread.lock().take().filter(|_| has_ended) {
            if thread.join().is_err() {
                log::error!("the thread for callbacks panicked");
            }
        }
    }
}

/// Sets the callback for a kind of event; none with `None`. Then waits, when a library is initialized, until
/// no call of the one before is running.
pub(super) fn set(
    event: Event,
    callback: Option<EventCallback>,
    callbacks: impl FnOnce() -> Option<Arc<Callbacks>>,
) {
    let before = std::mem::replace(&mut SET.lock()[event as usize], callback);
    if before.is_some() {
        if let Some(callbacks) = callbacks() {
            callbacks.settle_event(event);
        }
    }
}

/// Takes all callbacks away.
pub(super) fn forget() {
    *SET.lock() = [None; 3];
}
