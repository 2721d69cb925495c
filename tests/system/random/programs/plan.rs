//! What a random program does: plain data, printed when it fails.

use std::time::Duration;

use ft_transfer_area::tx::{Counter, Motor};
use ft_transfer_area_simulator::FaultKind;

use crate::proxy::fault::Strike;

/// How many threads a program may have.
pub(crate) const THREADS_MAX: usize = 4;

/// A random program, and the controllers that it meets.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) setups: Vec<Setup>,
    /// The calls of each thread, in groups.
    pub(crate) threads: Vec<Vec<Vec<Op>>>,
}

/// A handler and its controller.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    /// Whether the transfer begins before the threads.
    pub(crate) begun: bool,
    pub(crate) extension: bool,
    pub(crate) simple: bool,
    pub(crate) lock_step: bool,
    pub(crate) window_ms: u64,
    pub(crate) watchdog_ms: Option<u64>,
    pub(crate) reconnect_ms: Option<u64>,
    pub(crate) pace_ms: u64,
    /// Whether a listener has subscribed to all events.
    pub(crate) listens: bool,
    /// Faults by the number of an exchange on a connection.
    pub(crate) faults: Vec<(u64, FaultKind)>,
    /// What the network between both does.
    pub(crate) network: Option<Strike>,
}

impl Setup {
    /// How long a cycle hook may keep the areas before the motors stop.
    pub(crate) fn hook_limit(&self) -> Option<Duration> {
        let limit = self.watchdog_ms.map_or(Duration::from_millis(500), Duration::from_millis);
        (!self.lock_step).then_some(limit)
    }
}

/// Whose areas a call uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum By {
    /// The thread's own handle.
    Own,
    /// A handle that all threads share.
    Shared,
    /// The handler itself.
    Handler,
}

/// How a program gets the areas. Limits are in ms.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Get {
    Lock,
    Cycle,
    CycleFor(u64),
    /// Until the condition was checked this often.
    Until(u32, u64),
    Motor(Motor, u64),
    Counter(Counter, u64),
    Sound(u64),
    Input(u64),
}

/// What a program does under a guard.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Act {
    /// Duties that no other guard writes.
    Write,
    /// All duties 0.
    Zero,
    /// A distance, for M3 or M4.
    Drive(Motor, u16),
    Halt(Motor),
    Reset(Counter),
    Sound,
    Config,
}

/// How a guard ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Leave {
    Drop,
    Panic,
    /// It is kept during the next calls of the thread.
    Keep,
}

/// What happens under a guard, and how long it is held.
#[derive(Clone, Debug)]
pub(crate) struct Under {
    pub(crate) acts: Vec<Act>,
    pub(crate) hold_ms: u64,
    pub(crate) leave: Leave,
}

/// A call. The first number says of which handler.
#[derive(Clone, Debug)]
pub(crate) enum Op {
    Begin(usize),
    End(usize),
    /// With a logger that panics in this thread.
    BeginPanicking(usize),
    /// Drops the handler, if no other thread is in a call of it.
    DropHandler(usize),
    Guard(usize, By, Get, Under),
    /// Drops the guard that was kept for longest, or the last one.
    DropKept {
        newest: bool,
    },
    UpdateConfig(usize, By),
    Feed(usize, By),
    IsRunning(usize, By),
    Error(usize, By),
    Statistics(usize),
    Subscribe(usize),
    /// Receives one event, for at most this many ms.
    Receive(usize, u64),
    Unsubscribe(usize),
    /// Begins to record, instead of an earlier recorder of this thread.
    Record(usize, Disk),
    EndRecording(usize, EndRecording),
    Sleep(u64),
    /// A thread that owns a handle panics between two guards.
    PanicAsOwner(usize),
    StartCamera(usize),
    StopCamera(usize),
    CameraState(usize),
    I2c(usize),
    SetHook(usize, Hook),
    ClearHook(usize),
    /// The controller's next response has this fault.
    Disturb(usize, FaultKind),
    /// The controller answers no connection, for this many ms.
    Absent(usize, u64),
}

/// Where a recorder writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Disk {
    Works,
    StandsStill,
}

/// How a recording ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EndRecording {
    Finish,
    /// The program leaves.
    Drop,
    Panic,
}

/// A cycle hook.
#[derive(Clone, Debug)]
pub(crate) struct Hook {
    /// What it writes in each call.
    pub(crate) acts: Vec<Act>,
    /// From which call on it does what follows.
    pub(crate) after: u32,
    pub(crate) then: Then,
}

/// What a cycle hook does once, or from then on.
#[derive(Clone, Debug)]
pub(crate) enum Then {
    Nothing,
    /// Each call takes this many ms.
    Slow(u64),
    /// One call takes this many ms.
    SlowOnce(u64),
    /// It returns late, or when the program ends.
    Hang,
    Panic,
    Break,
    /// It drops its areas and makes a call.
    Call(Box<Op>),
}
