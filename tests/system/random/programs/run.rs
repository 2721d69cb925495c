//! Carries out a random program against its controllers, and judges it.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::{EventKind, Events, TransferAreas};

use super::machine::{Gate, Slot, IDLE_LIMIT};
use super::plan::{Op, Plan};
use super::program::{call_without_areas, Program};
use super::record::{Record, Who};
use super::spec;
use super::timeline;

/// What is reported about the transfer.
const TOLD: &[EventKind] = &[
    EventKind::ConnectionLost,
    EventKind::ConnectionRestored,
    EventKind::WatchdogExpired,
    EventKind::TransferEnded,
    EventKind::MotorReached,
    EventKind::CounterReset,
];

/// How long the motors may be on after the end of a program whose handlers are dropped.
const OFF_LIMIT: Duration = Duration::from_secs(2);

/// A run that was begun.
pub(crate) struct Run {
    pub(crate) record: Arc<Record>,
    plan: Plan,
    seed: u64,
    blocks: bool,
}

impl Run {
    pub(crate) fn new(plan: Plan, seed: u64, blocks: bool) -> Self {
        let record = Arc::new(Record::new(plan.setups.len(), plan.threads.len() + 1));
        Self { record, plan, seed, blocks }
    }

    /// Carries it out; returns what was wrong.
    pub(crate) fn carry_out(&self) -> Vec<String> {
        let (plan, record) = (&self.plan, &self.record);
        let slot = |(which, setup)| Arc::new(Slot::new(setup, self.seed, which, record));
        let slots: Vec<Arc<Slot>> = plan.setups.iter().enumerate().map(slot).collect();
        let gate = Arc::new(Gate::default());
        let listeners: Vec<Option<Events>> = plan
            .setups
            .iter()
            .zip(&slots)
            .map(|(setup, slot)| setup.listens.then(|| slot.shared.events(TOLD, 4000).ok())?)
            .collect();
        let main = plan.threads.len();
        for (which, _) in plan.setups.iter().enumerate().filter(|(_, setup)| setup.begun) {
            record.set_doing(main, Some("the first begin_transfer".to_owned()));
            call_without_areas(&Op::Begin(which), Who::Handler, &slots, record, &gate);
        }
        record.set_doing(main, None);
        self.run_threads(&slots, &gate);
        let mut breaches = self.end(&slots, &gate);
        for (which, listener) in listeners.into_iter().enumerate() {
            let reported = listener
                .into_iter()
                .flat_map(|events| std::iter::from_fn(move || events.try_recv().ok()));
            record.trace(which).events.extend(reported);
        }
        drop(slots);
        for (which, setup) in plan.setups.iter().enumerate() {
            let trace = &mut *record.trace(which);
            trace.holds.sort_by_key(|hold| hold.order);
            trace.settle_hooks();
            trace.calls.sort_by_key(|call| call.start);
            let found = spec::judge(&spec::Case { setup, trace, blocks: self.blocks });
            breaches.extend(found.into_iter().map(|text| format!("controller {which}: {text}")));
        }
        breaches
    }

    /// All that happened, for each handler.
    pub(crate) fn timeline(&self) -> String {
        let of =
            |which| format!("controller {which}:\n{}", timeline::of(&self.record.trace(which)));
        (0..self.plan.setups.len()).map(of).collect()
    }

    fn run_threads(&self, slots: &[Arc<Slot>], gate: &Arc<Gate>) {
        thread::scope(|scope| {
            for (index, groups) in self.plan.threads.iter().enumerate() {
                let own: Vec<TransferAreas> =
                    slots.iter().map(|slot| slot.shared.clone()).collect();
                let body = move || {
                    let mut program = Program {
                        thread: index,
                        slots,
                        own: &own,
                        record: &self.record,
                        gate,
                        events: slots.iter().map(|_| None).collect(),
                        recordings: slots.iter().map(|_| None).collect(),
                        kept: Vec::new(),
                    };
                    program.run(&groups.concat());
                };
                let name = format!("program {index}");
                thread::Builder::new().name(name).spawn_scoped(scope, body).expect("a thread");
            }
        });
    }

    /// Drops the handlers, and checks that nothing is left of them.
    fn end(&self, slots: &[Arc<Slot>], gate: &Arc<Gate>) -> Vec<String> {
        let (record, main) = (&self.record, self.plan.threads.len());
        let mut breaches = Vec::new();
        record.set_doing(main, Some("the last drop of the handlers".to_owned()));
        let mut left = Vec::new();
        for (which, slot) in slots.iter().enumerate() {
            let start = Instant::now();
            left.extend(slot.drop_handler());
            super::program::note_drop(record, which, start);
        }
        // Only now, so nothing may wait for a hook that hangs.
        gate.open();
        record.set_doing(main, Some("waiting for a hook to drop the handler".to_owned()));
        for handler in left {
            while handler.strong_count() > 0 {
                thread::sleep(Duration::from_millis(1));
            }
        }
        for (which, slot) in slots.iter().enumerate() {
            record.set_doing(main, Some("the lock at the end".to_owned()));
            let locked = catch_unwind(AssertUnwindSafe(|| drop(slot.shared.lock())));
            if locked.is_err() {
                breaches.push(format!("controller {which}: the lock at the end panics"));
            }
            // A hook may have dropped it last, and its drop may still be at work.
            let end = Instant::now() + OFF_LIMIT;
            while slot.shared.is_running() && Instant::now() < end {
                thread::sleep(Duration::from_millis(1));
            }
            if slot.shared.is_running() {
                breaches.push(format!("controller {which}: runs after its handler was dropped"));
            }
            record.set_doing(main, Some("a wait at the end".to_owned()));
            if slot.shared.wait_cycle().is_ok() {
                breaches.push(format!("controller {which}: a response after the drop"));
            }
            record.set_doing(main, Some("waiting until the motors are off".to_owned()));
            // The network may have lost the last requests.
            let setup = &self.plan.setups[which];
            let network = setup.network.map_or(Duration::ZERO, |_| IDLE_LIMIT);
            // In lock-step the controller has no limit.
            if setup.network.is_some() && setup.lock_step {
                continue;
            }
            if !slot.wait_until_off(OFF_LIMIT + network) {
                breaches.push(format!("controller {which}: its motors are on at the end"));
            }
        }
        record.set_doing(main, None);
        breaches
    }
}
