//! The thread that calls the program back.
//!
//! The threads of the transfers only leave here what has happened. So a callback may take its time, call the
//! library, close its device or never return: the transfers go on.

use std::collections::VecDeque;
use std::sync::{Arc, Weak};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};

use super::kinds::{Context, Event, EventCallback, Told};
use crate::calling::{self, Thread};
use crate::inside::{self, Programs};
use crate::{process, report};

/// How long is waited for a running callback when it is taken away, or its device closed.
const WAIT_LIMIT: Duration = Duration::from_secs(1);
/// How many calls may wait for a callback that does not return.
const WAITING: usize = 10_000;

/// How many calls may wait before a change of an input takes the place of one of the same input. So a slow callback
/// gets the newest value, and other events find room.
const CHANGES: usize = 1000;

/// What a call is made for, and what stays until the call has returned: an open device.
pub(super) trait Owner: Send + Sync {
    /// No call is made for one that is closed.
    fn is_open(&self) -> bool;
    /// The number of its transfer.
    fn transfer(&self) -> u32;
    /// What a program is told in place of this, which has happened in an earlier transfer: of a change the state now,
    /// because no other call tells it; nothing of the end of a command.
    fn now(&self, event: Event, told: Told) -> Option<Told>;
    /// What callbacks with a context get.
    fn context(&self) -> Context;
}

/// What the program has set; a library has one of each kind.
static SET: Mutex<[Option<EventCallback>; Event::COUNT]> = Mutex::new([None; Event::COUNT]);

/// The callback for a kind of event.
fn set_for(event: Event) -> Option<EventCallback> {
    SET.lock()[event as usize]
}

enum Call {
    /// For the callback that is set when its turn comes, of a transfer.
    Event(Event, Told, u32),
    /// One that was given with a request.
    Once(Box<dyn FnOnce(Context) + Send>),
}

impl Call {
    fn event(&self) -> Option<Event> {
        match self {
            Self::Event(event, ..) => Some(*event),
            Self::Once(_) => None,
        }
    }

    /// The call when its turn has come; `None` when it is not made any more.
    fn for_now(self, owner: &dyn Owner) -> Option<Self> {
        let now = owner.transfer();
        match self {
            _ if !owner.is_open() => None,
            Self::Event(event, told, transfer) if transfer != now => {
                owner.now(event, told).map(|told| Self::Event(event, told, now))
            }
            call => Some(call),
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
    thread: Mutex<Option<Thread>>,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<(Weak<dyn Owner>, Call)>,
    running: Option<Running>,
    ended: bool,
    /// The thread has left its loop.
    left: bool,
}

impl Queue {
    /// Gives the new value of an input to the call that already waits for it, if this is one for an input.
    fn renew(&mut self, owner: &Weak<dyn Owner>, call: &Call) -> bool {
        let (event, newer, transfer) = match call {
            Call::Event(event, told, transfer) if event.is_change() => (*event, told, *transfer),
            Call::Event(..) | Call::Once(_) => return false,
        };
        let place = (newer.controller, newer.what);
        let mut waiting = self.waiting.iter_mut().rev().filter(|(it, _)| it.ptr_eq(owner));
        let same = waiting.find_map(|(_, call)| match call {
            Call::Event(it, told, of)
                if (*it, *of, told.controller, told.what)
                    == (event, transfer, place.0, place.1) =>
            {
                Some(told)
            }
            Call::Event(..) | Call::Once(_) => None,
        });
        same.map(|told| *told = *newer).is_some()
    }
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
        let programs = Programs::of_this_thread();
        let run = move || {
            #[cfg(unix)]
            let _stack = crate::exit::Stack::give();
            programs.begin();
            own.run();
        };
        *callbacks.thread.lock() = Some(calling::spawn("ft/callbacks", 0, run)?);
        Ok(callbacks)
    }

    /// Tells the program of an event, if it wants to know.
    pub(super) fn event(&self, owner: Weak<dyn Owner>, event: Event, told: Told) {
        let Some(transfer) = owner.upgrade().map(|owner| owner.transfer()) else { return };
        if set_for(event).is_some() {
            self.push(owner, Call::Event(event, told, transfer));
        }
    }

    /// Makes a call, unless its owner is closed before its turn comes.
    pub(super) fn once(&self, owner: Weak<dyn Owner>, call: impl FnOnce(Context) + Send + 'static) {
        self.push(owner, Call::Once(Box::new(call)));
    }

    fn push(&self, owner: Weak<dyn Owner>, call: Call) {
        let mut queue = self.queue.lock();
        if queue.ended {
            return;
        }
        if queue.waiting.len() >= CHANGES && queue.renew(&owner, &call) {
            return;
        }
        if queue.waiting.len() >= WAITING {
            report::failure(
                "a callback does not return, so the program is not notified of an event",
            );
            return;
        }
        queue.waiting.push_back((owner, call));
        self.wake.notify_one();
    }

    fn run(&self) {
        while let Some((owner, call)) = self.next() {
            let context = owner.context();
            match call {
                Call::Event(event, told, _) => {
                    // Under no lock: the callback may set callbacks. `next` has seen one, and a thread that has
                    // removed it since then waits for this call.
                    if let Some(callback) = set_for(event) {
                        inside::leave(|| callback.call(told, context));
                    }
                }
                Call::Once(call) => inside::leave(|| call(context)),
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
            let Some(owner) = owner.upgrade() else { continue };
            let Some(call) = call.for_now(&*owner) else { continue };
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
            report::failure(format_args!(
                "a callback has not returned within {WAIT_LIMIT:?}; it is not waited for"
            ));
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
            thread.join();
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
    *SET.lock() = [None; Event::COUNT];
}

#[cfg(test)]
mod tests {
    use std::ptr::null_mut;

    use super::super::kinds::InputNow;
    use super::*;

    struct Open;

    impl Owner for Open {
        fn is_open(&self) -> bool {
            true
        }

        fn transfer(&self) -> u32 {
            1
        }

        fn now(&self, _: Event, _: Told) -> Option<Told> {
            None
        }

        fn context(&self) -> Context {
            null_mut()
        }
    }

    #[test]
    fn a_slow_callback_gets_the_newest_value_of_each_input_and_other_events() {
        let callbacks = Callbacks {
            queue: Mutex::default(),
            wake: Condvar::new(),
            returned: Condvar::new(),
            thread: Mutex::default(),
        };
        let open: Arc<dyn Owner> = Arc::new(Open);
        let push = |event, what, value| {
            let input = InputNow { value, ..InputNow::default() };
            let told = Told { controller: 0, what, input };
            callbacks.push(Arc::downgrade(&open), Call::Event(event, told, 1));
        };
        for value in 0..3000 {
            push(Event::UniChanged, 5, value);
        }
        assert_eq!(callbacks.queue.lock().waiting.len(), CHANGES);
        // Another input, another kind and other events are not among those that wait.
        push(Event::UniChanged, 6, 1);
        push(Event::CounterChanged, 5, 2);
        push(Event::MotorExReached, 5, 0);
        push(Event::MotorExReached, 5, 0);
        push(Event::UniChanged, 5, 3000);
        let waiting = std::mem::take(&mut callbacks.queue.lock().waiting);
        assert_eq!(waiting.len(), CHANGES + 4);
        let values: Vec<_> = waiting
            .iter()
            .filter_map(|(_, call)| match call {
                Call::Event(Event::UniChanged, told, _) if told.what == 5 => Some(told.input.value),
                Call::Event(..) | Call::Once(_) => None,
            })
            .collect();
        let expected: Vec<_> = (0..CHANGES as u32 - 1).chain([3000]).collect();
        assert_eq!(values, expected);
    }
}
