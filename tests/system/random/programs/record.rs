//! What happened in a run: the calls of the program, and what the controllers saw.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use ft_transfer_area::tx::{Counter, Motor, SILENCE};
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area::{Error, TimedEvent};
use ft_transfer_area_simulator::Machine;

use super::plan::By;

/// Who makes a call: a thread with one of its handles, or a hook.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Who {
    Own(usize),
    Shared,
    Handler,
    Hook,
}

impl Who {
    pub(crate) fn new(by: By, thread: usize) -> Self {
        match by {
            By::Own => Self::Own(thread),
            By::Shared => Self::Shared,
            By::Handler => Self::Handler,
        }
    }
}

/// What kind of call it is, for the specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum What {
    Begin,
    End,
    DropHandler,
    /// It waits for a response, or for several of them.
    Wait,
    Lock,
    Feed,
    /// `is_running` or `error`; it fails when there is no transfer.
    Look,
    /// It only asks for something, and does not wait.
    Ask,
    /// A panic that the library can see.
    Panic,
    /// The end of a recording, and one without `finish`.
    Finish,
    Leave,
    Camera,
    SetHook,
    Other,
}

/// A call that has returned.
#[derive(Clone, Debug)]
pub(crate) struct Call {
    pub(crate) who: Who,
    pub(crate) thread: ThreadId,
    pub(crate) what: What,
    pub(crate) start: Instant,
    pub(crate) end: Instant,
    pub(crate) result: Result<(), Error>,
    pub(crate) panicked: bool,
}

impl Call {
    /// Whether it has reported an end of a transfer, a gap or an expired watchdog. After an end without an error,
    /// `error` reports it by returning none.
    pub(crate) fn reported(&self) -> bool {
        match &self.result {
            Ok(()) => matches!(self.what, What::Begin | What::End | What::Look),
            Err(error) => !matches!(
                error,
                Error::WaitTimedOut { .. } | Error::OutOfRange { .. } | Error::AlreadyStarted
            ),
        }
    }
}

/// What a wait has found done.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Awaited {
    Motor(Motor),
    Counter(Counter),
    Sound,
}

/// What was ordered under a guard.
#[derive(Clone, Debug, Default)]
pub(crate) struct Orders {
    /// The duties: 0, or a number that no other guard has.
    pub(crate) tag: Option<u64>,
    /// For each motor, the pulses and the duty; 0 pulses end the mode.
    pub(crate) drives: [Option<(u16, i16)>; 4],
    pub(crate) resets: [bool; 4],
    /// How often the sound is played, which no other guard asks for.
    pub(crate) sound: Option<u16>,
}

/// A guard, from the call that got it until it was dropped.
#[derive(Clone, Debug)]
pub(crate) struct Hold {
    /// Guards of a handler exclude each other, so this order is the real one.
    pub(crate) order: u64,
    pub(crate) who: Who,
    pub(crate) thread: ThreadId,
    /// The call that got it began, it was got, it began to be dropped, and was dropped.
    pub(crate) asked: Instant,
    pub(crate) got: Instant,
    pub(crate) left: Instant,
    pub(crate) gone: Instant,
    pub(crate) panicked: bool,
    pub(crate) cycle: u64,
    pub(crate) arrived: Instant,
    /// Whether it is from a call that never gives a response twice.
    pub(crate) is_new: bool,
    pub(crate) awaited: Option<Awaited>,
    pub(crate) uni: [i16; 8],
    pub(crate) orders: Orders,
}

/// An exchange, as the controller saw it.
#[derive(Clone, Debug)]
pub(crate) struct Exchange {
    pub(crate) at: Instant,
    pub(crate) connection: u64,
    pub(crate) master: ExchangeData,
    pub(crate) extension: Option<ExchangeData>,
    pub(crate) report: ExchangeDataResponse,
}

impl Exchange {
    pub(crate) fn of(machine: &Machine) -> Self {
        Self {
            at: Instant::now(),
            connection: machine.connections(),
            master: machine.controllers[0].outputs,
            extension: machine.controllers.get(1).map(|extension| extension.outputs),
            report: machine.report(0).unwrap_or_default(),
        }
    }

    /// The outputs that are not 0, and what is reported as done.
    pub(crate) fn describe(&self) -> String {
        let extension = self.extension.map(|outputs| outputs.duty);
        let ExchangeData {
            duty,
            distance,
            motor_command_id,
            counter_reset_id,
            sound_command_id,
            sound_repeat,
            ..
        } = self.master;
        let done = self.report;
        format!(
            "request on {}: {duty:?} {extension:?} distance {distance:?} motors {motor_command_id:?} \
             resets {counter_reset_id:?} sound {sound_command_id} ×{sound_repeat}; done {:?} {:?} {}",
            self.connection, done.motor_command_id, done.counter_reset_id, done.sound_command_id,
        )
    }

    /// Whether the extension has got the same duties.
    pub(crate) fn agrees(&self) -> bool {
        self.extension.is_none_or(|other| other.duty[..4] == self.master.duty[..4])
    }

    /// Whether all duties are 0.
    pub(crate) fn is_off(&self) -> bool {
        let all = std::iter::once(&self.master).chain(&self.extension);
        all.flat_map(|controller| controller.duty).all(|duty| duty == 0)
    }

    /// Whether it stops the master, and the extension has the duties that it had in an earlier one.
    pub(crate) fn stops_master_alone(&self, earlier: &Self) -> bool {
        let duties = |exchange: &Self| exchange.extension.map(|extension| extension.duty);
        self.master.duty == [0; 8] && duties(self) == duties(earlier)
    }

    /// Whether it gives the master no command but to stop. An extension has at first the duties of the session before.
    pub(crate) fn only_stops(&self) -> bool {
        let ExchangeData { motor_command_id, counter_reset_id, distance, sound_index, .. } =
            self.master;
        let orders = motor_command_id.into_iter().any(|id| id > 1)
            || counter_reset_id.into_iter().chain(distance).any(|order| order > 0);
        self.master.duty == [0; 8] && !orders && sound_index == SILENCE
    }

    /// The number in the duties; 0 if they are 0. The whole exchange if they are torn.
    pub(crate) fn tag(&self) -> Result<u64, &Self> {
        let [low, high, low_again, high_again, ..] = self.master.duty;
        if (low, high) != (low_again, high_again) || (low == 0) != (high == 0) {
            return Err(self);
        }
        Ok(if low == 0 { 0 } else { (low as u64 - 1) + (high as u64 - 1) * TAG_BASE })
    }
}

const TAG_BASE: u64 = 500;

/// The duties for this number.
pub(crate) fn duties_of(tag: u64) -> [i16; 4] {
    let low = 1 + (tag % TAG_BASE) as i16;
    let high = 1 + (tag / TAG_BASE) as i16;
    [low, high, low, high]
}

/// What happened at one handler and its controller.
#[derive(Default)]
pub(crate) struct Trace {
    pub(crate) calls: Vec<Call>,
    pub(crate) holds: Vec<Hold>,
    pub(crate) exchanges: Vec<Exchange>,
    pub(crate) events: Vec<TimedEvent>,
    /// When a condition was checked.
    pub(crate) checks: Vec<Instant>,
    pub(crate) hook: HookCalls,
}

impl Trace {
    /// A hook notes the end of its guard before the guard is dropped. It is dropped when the next guard is got.
    pub(crate) fn settle_hooks(&mut self) {
        let mut next = None;
        for hold in self.holds.iter_mut().rev() {
            let got = hold.got;
            if hold.who == Who::Hook {
                hold.gone = hold.gone.max(next.unwrap_or(hold.gone + Duration::from_secs(60)));
            }
            next = Some(got);
        }
    }
}

/// The calls of cycle hooks.
#[derive(Default)]
pub(crate) struct HookCalls {
    /// When each call began and returned; the last one may not have returned.
    pub(crate) times: Vec<(Instant, Option<Instant>)>,
    /// When one said that the transfer should end, or panicked.
    pub(crate) stops: Vec<Instant>,
}

/// What happened in a run.
pub(crate) struct Record {
    numbers: AtomicU64,
    traces: Vec<Mutex<Trace>>,
    /// What each thread does at present, and since when.
    doing: Mutex<Vec<Option<(String, Instant)>>>,
}

impl Record {
    pub(crate) fn new(machines: usize, threads: usize) -> Self {
        Self {
            numbers: AtomicU64::new(1),
            traces: (0..machines).map(|_| Mutex::default()).collect(),
            doing: Mutex::new(vec![None; threads]),
        }
    }

    /// A number that is higher than all before.
    pub(crate) fn number(&self) -> u64 {
        self.numbers.fetch_add(1, Ordering::SeqCst)
    }

    pub(crate) fn trace(&self, machine: usize) -> MutexGuard<'_, Trace> {
        self.traces[machine].lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn set_doing(&self, thread: usize, what: Option<String>) {
        let mut doing = self.doing.lock().unwrap_or_else(PoisonError::into_inner);
        doing[thread] = what.map(|what| (what, Instant::now()));
    }

    /// When the call began that has taken longest of those that have not returned.
    pub(crate) fn longest_call(&self) -> Option<Instant> {
        let doing = self.doing.lock().unwrap_or_else(PoisonError::into_inner);
        doing.iter().flatten().map(|(_, since)| *since).min()
    }

    /// What threads do at present.
    pub(crate) fn doing(&self) -> Vec<String> {
        let doing = self.doing.lock().unwrap_or_else(PoisonError::into_inner);
        let text = |(thread, what): (usize, &Option<(String, Instant)>)| {
            let (what, since) = what.as_ref()?;
            Some(format!("thread {thread} is in {what} for {:.1?}", since.elapsed()))
        };
        doing.iter().enumerate().filter_map(text).collect()
    }
}

impl HookCalls {
    /// A call begins; returns its index.
    pub(crate) fn begin(&mut self) -> usize {
        self.times.push((Instant::now(), None));
        self.times.len() - 1
    }

    pub(crate) fn end(&mut self, index: usize) {
        self.times[index].1 = Some(Instant::now());
    }

    /// It stops the transfer from now on.
    pub(crate) fn stop(&mut self) {
        self.stops.push(Instant::now());
    }
}
