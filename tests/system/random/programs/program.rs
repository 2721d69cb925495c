//! Carries out the calls of one thread of a random program.

use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::{
    CameraOptions, Error, EventKind, Events, TransferAreaComHandler, TransferAreaGuard,
    TransferAreas,
};
use ft_transfer_area_simulator::FaultKind;

use super::areas::{self, act, hold};
use super::hook;
use super::logger;
use super::machine::{Gate, Slot};
use super::plan::{By, Disk, EndRecording, Get, Leave, Op, Under};
use super::record::{Call, Hold, Orders, Record, What, Who};
use crate::still::Recording;

/// A thread of a program.
pub(crate) struct Program<'a> {
    pub(crate) thread: usize,
    pub(crate) slots: &'a [Arc<Slot>],
    pub(crate) own: &'a [TransferAreas],
    pub(crate) record: &'a Arc<Record>,
    pub(crate) gate: &'a Arc<Gate>,
    pub(crate) events: Vec<Option<Events>>,
    pub(crate) recordings: Vec<Option<Recording>>,
    pub(crate) kept: Vec<Kept<'a>>,
}

/// A guard that is held, and what is known of it.
pub(crate) struct Kept<'a> {
    which: usize,
    guard: TransferAreaGuard<'a>,
    hold: Hold,
}

impl<'a> Program<'a> {
    pub(crate) fn run(&mut self, ops: &[Op]) {
        for op in ops {
            self.record.set_doing(self.thread, Some(format!("{op:?}")));
            self.carry_out(op);
        }
        self.record.set_doing(self.thread, Some("dropping its guards".to_owned()));
        self.drop_kept(|_| true);
        for which in 0..self.slots.len() {
            self.record.set_doing(self.thread, Some(format!("dropping recorder {which}")));
            self.end_recording(which, EndRecording::Drop);
        }
        self.record.set_doing(self.thread, None);
    }

    fn carry_out(&mut self, op: &Op) {
        match *op {
            Op::Guard(which, by, get, ref under) => self.guard(which, by, get, under),
            Op::DropKept { newest } => {
                let index = if newest { self.kept.len().checked_sub(1) } else { Some(0) };
                if let Some(index) = index.filter(|index| *index < self.kept.len()) {
                    let kept = self.kept.remove(index);
                    self.drop_guard(kept);
                }
            }
            Op::UpdateConfig(which, by) => {
                self.make_way(which);
                self.with(which, by, What::Wait, |areas| areas.update_config());
            }
            Op::Feed(which, by) => self.with(which, by, What::Feed, |areas| areas.feed_watchdog()),
            Op::IsRunning(which, by) => self.with(which, by, What::Look, |areas| {
                areas.is_running().then_some(()).ok_or(Error::NotStarted)
            }),
            Op::Error(which, by) => {
                self.with(which, by, What::Look, |areas| areas.error().map_or(Ok(()), Err))
            }
            Op::Subscribe(which) => {
                self.events[which] = self.own[which].events(EventKind::ALL, 20).ok();
            }
            Op::Receive(which, limit) => {
                // In lock-step it waits for a response, which does not come while a guard is held.
                self.drop_kept(|_| true);
                if let Some(events) = &self.events[which] {
                    let _ = events.recv_timeout(Duration::from_millis(limit));
                }
            }
            Op::Unsubscribe(which) => self.events[which] = None,
            Op::Record(which, disk) => {
                self.end_recording(which, EndRecording::Finish);
                let Some(handler) = self.slots[which].handler() else { return };
                let still = (disk == Disk::StandsStill).then(|| Recording::still(&handler));
                let recording = still.flatten().unwrap_or_else(|| Recording::start(&handler));
                self.recordings[which] = Some(recording);
            }
            Op::EndRecording(which, how) => self.end_recording(which, how),
            Op::PanicAsOwner(which) => self.panic_as_owner(which),
            ref op => {
                call_without_areas(op, Who::Handler, self.slots, self.record, self.gate);
            }
        }
    }

    fn with(
        &mut self,
        which: usize,
        by: By,
        what: What,
        call: impl FnOnce(&TransferAreas) -> Result<(), Error>,
    ) {
        let who = Who::new(by, self.thread);
        let slot = &self.slots[which];
        let handler;
        let areas: &TransferAreas = match by {
            By::Own => &self.own[which],
            By::Shared => &slot.shared,
            By::Handler => {
                let Some(found) = slot.handler() else { return };
                handler = found;
                handler.areas()
            }
        };
        note(self.record, which, who, what, || call(areas));
    }

    fn guard(&mut self, which: usize, by: By, get: Get, under: &Under) {
        // Guards of one thread are got in the order of the handlers, so threads don't wait for each other.
        let kept = self.kept.iter().position(|kept| kept.which == which);
        if let Some(index) = kept.filter(|_| by == By::Shared && matches!(get, Get::Lock)) {
            let kept = self.kept.remove(index);
            return self.lock_twice(kept);
        }
        self.make_way(which);
        let who = Who::new(by, self.thread);
        let slot = &self.slots[which];
        let keeps = under.leave == Leave::Keep && by != By::Handler;
        match by {
            By::Own if keeps => self.keep(which, who, &self.own[which], get, under),
            By::Shared if keeps => self.keep(which, who, &slot.shared, get, under),
            By::Own => use_guard(self.record, which, who, &self.own[which], get, under),
            By::Shared => use_guard(self.record, which, who, &slot.shared, get, under),
            By::Handler => {
                let Some(handler) = slot.handler() else { return };
                use_guard(self.record, which, who, handler.areas(), get, under);
            }
        }
    }

    /// A mistake, which the library says in a panic. It drops the guard, and stops the motors.
    fn lock_twice(&self, kept: Kept<'a>) {
        let Kept { which, guard, mut hold } = kept;
        hold.left = Instant::now();
        hold.panicked = true;
        note(self.record, which, hold.who, What::Panic, || {
            let _guard = guard;
            drop(self.slots[which].shared.lock());
            Ok(())
        });
        hold.gone = Instant::now();
        self.record.trace(which).holds.push(hold);
    }

    fn keep(&mut self, which: usize, who: Who, areas: &'a TransferAreas, get: Get, under: &Under) {
        if let Some((mut guard, mut hold)) = got(self.record, which, who, areas, get) {
            hold.orders = act(&mut guard, &under.acts, self.record);
            self.kept.push(Kept { which, guard, hold });
        }
    }

    /// Drops guards that are in the way of another guard of this handler.
    fn make_way(&mut self, which: usize) {
        self.drop_kept(|kept| kept.which >= which);
    }

    fn drop_kept(&mut self, condition: impl Fn(&Kept<'_>) -> bool) {
        while let Some(index) = self.kept.iter().position(&condition) {
            let kept = self.kept.remove(index);
            self.drop_guard(kept);
        }
    }

    fn drop_guard(&self, kept: Kept<'a>) {
        end_guard(self.record, kept.which, kept.guard, kept.hold, false);
    }

    fn end_recording(&mut self, which: usize, how: EndRecording) {
        // A busy disk may take longer to remove the file than a call may.
        let Some(Recording { recorder, place: _place }) = self.recordings[which].take() else {
            return;
        };
        let what = if how == EndRecording::Finish { What::Finish } else { What::Leave };
        note(self.record, which, Who::Own(self.thread), what, || {
            if how == EndRecording::Panic {
                let _owned = recorder;
                resume_unwind(Box::new("a thread that owns a recorder"));
            }
            if how == EndRecording::Finish {
                // A disk that stands still is an error.
                let _ = recorder.finish();
            }
            Ok(())
        });
    }

    fn panic_as_owner(&self, which: usize) {
        note(self.record, which, Who::Own(self.thread), What::Panic, || {
            let _owned = self.own[which].clone();
            resume_unwind(Box::new("a thread that owns a handle"));
        });
    }
}

/// Makes a call and notes it.
pub(crate) fn note(
    record: &Record,
    which: usize,
    who: Who,
    what: What,
    call: impl FnOnce() -> Result<(), Error>,
) {
    let start = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(call));
    let panicked = result.is_err();
    noted(record, which, who, what, start, result.unwrap_or(Ok(())), panicked);
}

fn noted(
    record: &Record,
    which: usize,
    who: Who,
    what: What,
    start: Instant,
    result: Result<(), Error>,
    panicked: bool,
) {
    let (thread, end) = (thread::current().id(), Instant::now());
    record.trace(which).calls.push(Call { who, thread, what, start, end, result, panicked });
}

/// Notes that the handler was dropped by the program's main thread.
pub(crate) fn note_drop(record: &Record, which: usize, start: Instant) {
    noted(record, which, Who::Handler, What::DropHandler, start, Ok(()), false);
}

/// A guard that was just got, by this call or by a hook.
pub(crate) fn begun(
    record: &Record,
    who: Who,
    get: Option<Get>,
    asked: Instant,
    guard: &TransferAreaGuard<'_>,
) -> Hold {
    let now = Instant::now();
    Hold {
        order: record.number(),
        who,
        thread: thread::current().id(),
        asked,
        got: now,
        left: now,
        gone: now,
        panicked: false,
        cycle: guard.cycle(),
        arrived: guard.arrived(),
        is_new: get.is_some_and(Get::is_new),
        awaited: get.and_then(Get::awaits),
        uni: *guard[0].input.uni,
        orders: Orders::default(),
    }
}

fn got<'g>(
    record: &Record,
    which: usize,
    who: Who,
    areas: &'g TransferAreas,
    get: Get,
) -> Option<(TransferAreaGuard<'g>, Hold)> {
    let asked = Instant::now();
    let check = || record.trace(which).checks.push(Instant::now());
    let result = catch_unwind(AssertUnwindSafe(|| areas::get(areas, get, &check)));
    let what = if matches!(get, Get::Lock) { What::Lock } else { What::Wait };
    let (result, guard) = match result {
        Ok(Ok(guard)) => (Ok(()), Some(guard)),
        Ok(Err(error)) => (Err(error), None),
        Err(_) => {
            noted(record, which, who, what, asked, Ok(()), true);
            return None;
        }
    };
    let guard = guard.map(|guard| {
        let hold = begun(record, who, Some(get), asked, &guard);
        (guard, hold)
    });
    noted(record, which, who, what, asked, result, false);
    guard
}

fn use_guard(
    record: &Record,
    which: usize,
    who: Who,
    areas: &TransferAreas,
    get: Get,
    under: &Under,
) {
    let Some((mut guard, mut held)) = got(record, which, who, areas, get) else { return };
    held.orders = act(&mut guard, &under.acts, record);
    hold(under.hold_ms);
    end_guard(record, which, guard, held, under.leave == Leave::Panic);
}

/// Drops a guard, or panics under it.
pub(crate) fn end_guard(
    record: &Record,
    which: usize,
    guard: TransferAreaGuard<'_>,
    mut hold: Hold,
    panics: bool,
) {
    hold.left = Instant::now();
    hold.panicked = panics;
    if panics {
        let _ = catch_unwind(AssertUnwindSafe(|| {
            // Made before the panic, as the guard was, but the check of a panic goes by the thread.
            let _held = guard;
            resume_unwind(Box::new("under a guard"));
        }));
    } else {
        drop(guard);
    }
    hold.gone = Instant::now();
    if panics {
        noted(record, which, hold.who, What::Panic, hold.left, Ok(()), true);
    }
    record.trace(which).holds.push(hold);
}

/// A call that needs no areas, so a hook makes it, too.
pub(crate) fn call_without_areas(
    op: &Op,
    who: Who,
    slots: &[Arc<Slot>],
    record: &Arc<Record>,
    gate: &Arc<Gate>,
) {
    let on_handler =
        |which: usize, what, call: &dyn Fn(&TransferAreaComHandler) -> Result<(), Error>| {
            if let Some(handler) = slots[which].handler() {
                note(record, which, who, what, || call(&handler));
            }
        };
    match *op {
        Op::Begin(which) => on_handler(which, What::Begin, &|handler| handler.begin_transfer()),
        Op::End(which) => on_handler(which, What::End, &|handler| handler.end_transfer()),
        Op::BeginPanicking(which) => on_handler(which, What::Begin, &|handler| {
            logger::panicking(|| handler.begin_transfer())
        }),
        Op::DropHandler(which) => {
            note(record, which, who, What::DropHandler, || {
                slots[which].drop_handler();
                Ok(())
            });
        }
        Op::Feed(which, _) => {
            on_handler(which, What::Feed, &|handler| handler.areas().feed_watchdog())
        }
        Op::Statistics(which) => on_handler(which, What::Ask, &|handler| {
            let _ = handler.areas().statistics();
            Ok(())
        }),
        Op::Subscribe(which) => on_handler(which, What::Other, &|handler| {
            handler.areas().events(EventKind::ALL, 5).map(drop)
        }),
        Op::StartCamera(which) => on_handler(which, What::Camera, &|handler| {
            let options = CameraOptions::default().size(64, 48).framerate(60);
            let limit = Duration::from_millis(300);
            let options = options.start_limit(limit).frame_limit(limit);
            handler.start_camera(options).map(drop)
        }),
        Op::StopCamera(which) => {
            on_handler(which, What::Camera, &|handler| handler.stop_camera());
        }
        Op::CameraState(which) => on_handler(which, What::Ask, &|handler| {
            let _ = (handler.camera_error(), handler.camera_statistics());
            Ok(())
        }),
        Op::I2c(which) => {
            on_handler(which, What::Other, &|handler| handler.i2c()?.read(0x20, 0, &mut [0; 4]))
        }
        Op::SetHook(which, ref plan) => on_handler(which, What::SetHook, &|handler| {
            hook::set(handler, which, plan, slots, record, gate)
        }),
        Op::ClearHook(which) => on_handler(which, What::SetHook, &|handler| {
            handler.clear_cycle_hook();
            Ok(())
        }),
        Op::Sleep(ms) => hold(ms),
        Op::Disturb(which, kind) => slots[which].with_machine(|machine| machine.disturb(kind)),
        Op::Absent(which, ms) => {
            slots[which].with_machine(|machine| {
                machine.set_absent(true);
                machine.disturb(FaultKind::Close { after: 0 });
            });
            hold(ms);
            slots[which].with_machine(|machine| machine.set_absent(false));
        }
        ref op => unreachable!("{op:?} needs areas"),
    }
}

/// A lock that a panic has not poisoned.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
