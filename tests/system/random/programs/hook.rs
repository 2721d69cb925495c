//! The cycle hook of a random program: the only place that knows how it is set.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::{Arc, Weak};
use std::time::Instant;

use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreaGuard};

use super::areas::{act, hold};
use super::machine::{Gate, Slot};
use super::plan::{Hook, Then};
use super::program::{begun, call_without_areas, note};
use super::record::{Record, What, Who};

/// What a hook needs for its calls.
struct Work {
    which: usize,
    plan: Hook,
    calls: u32,
    /// The handler owns the hook, and must not own itself.
    slots: Vec<Weak<Slot>>,
    record: Arc<Record>,
    gate: Arc<Gate>,
}

pub(crate) fn set(
    handler: &TransferAreaComHandler,
    which: usize,
    plan: &Hook,
    slots: &[Arc<Slot>],
    record: &Arc<Record>,
    gate: &Arc<Gate>,
) -> Result<(), Error> {
    let mut work = Work {
        which,
        plan: plan.clone(),
        calls: 0,
        slots: slots.iter().map(Arc::downgrade).collect(),
        record: Arc::clone(record),
        gate: Arc::clone(gate),
    };
    handler.set_cycle_hook(move |areas| {
        let index = work.record.trace(which).hook.begin();
        let flow = match areas {
            Ok(guard) => work.answer(guard),
            Err(error) => {
                note(&work.record, which, Who::Hook, What::Wait, || Err(error));
                work.go_on()
            }
        };
        work.record.trace(which).hook.end(index);
        flow
    })
}

impl Work {
    fn answer(&mut self, guard: &mut TransferAreaGuard<'_>) -> ControlFlow<()> {
        let mut held = begun(&self.record, Who::Hook, None, Instant::now(), guard);
        held.orders = act(guard, &self.plan.acts, &self.record);
        held.panicked = self.calls == self.plan.after && matches!(self.plan.then, Then::Panic);
        if held.panicked {
            self.record.trace(self.which).holds.push(held);
            return self.go_on();
        }
        let flow = self.go_on();
        held.left = Instant::now();
        held.gone = held.left;
        self.record.trace(self.which).holds.push(held);
        flow
    }

    /// What it does besides its answer.
    fn go_on(&mut self) -> ControlFlow<()> {
        let strikes = self.calls == self.plan.after;
        let is_later = self.calls >= self.plan.after;
        self.calls += 1;
        match &self.plan.then {
            Then::Slow(ms) if is_later => hold(*ms),
            Then::SlowOnce(ms) if strikes => hold(*ms),
            Then::Hang if strikes => self.gate.wait(),
            Then::Panic if strikes => {
                self.record.trace(self.which).hook.stop();
                resume_unwind(Box::new("in a hook"));
            }
            Then::Break if strikes => {
                self.record.trace(self.which).hook.stop();
                return ControlFlow::Break(());
            }
            Then::Call(op) if strikes => {
                let slots: Option<Vec<Arc<Slot>>> = self.slots.iter().map(Weak::upgrade).collect();
                if let Some(slots) = slots {
                    call_without_areas(op, Who::Hook, &slots, &self.record, &self.gate);
                }
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}
