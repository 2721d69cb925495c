//! The cycle hook's slot: the function itself, and its turns.

use std::fmt;
use std::ops::ControlFlow;
use std::time::Instant;

use super::sync::ThreadId;
use crate::transfer_area::FishX1Transfer;

/// The program's function.
pub(super) type Hook = Box<dyn FnMut(&mut [FishX1Transfer]) -> ControlFlow<()> + Send>;

/// The program puts its hook here, and the hook's thread gets its turns here.
///
/// The hook runs in a thread of its own, so that the transfer thread can go on without it.
#[derive(Default)]
pub(super) struct HookSlot {
    /// `None` also while it runs.
    hook: Option<Hook>,
    /// Counts the hooks that were set and cleared, to know one that was replaced while it ran.
    version: u64,
    turn: Turn,
    /// When the current turn was given.
    called: Option<Instant>,
    /// Counts the hook's threads, to know one whose hook did not return.
    thread: u64,
}

/// What the hook's thread is to do, or is doing.
#[derive(Debug, Default)]
enum Turn {
    /// Nothing.
    #[default]
    None,
    /// To call the hook with these areas, as the holder's turn of this number.
    Called(Vec<FishX1Transfer>, u64),
    /// The hook of this version runs in this thread.
    Running(ThreadId, u64),
}

/// A turn that has begun: the hook, if it was not cleared, and what it gets.
pub(super) struct Begun {
    pub(super) hook: Option<Hook>,
    version: u64,
    pub(super) areas: Vec<FishX1Transfer>,
    pub(super) turn: u64,
}

impl HookSlot {
    /// Whether there is a hook, or one that runs.
    pub(super) fn is_set(&self) -> bool {
        self.hook.is_some() || self.busy_since().is_some()
    }

    /// Whether there is a hook that can be called now.
    pub(super) fn is_ready(&self) -> bool {
        self.hook.is_some() && matches!(self.turn, Turn::None)
    }

    /// Puts a hook in, or none; returns the previous one, unless it runs.
    pub(super) fn put(&mut self, hook: Option<Hook>) -> Option<Hook> {
        self.version += 1;
        std::mem::replace(&mut self.hook, hook)
    }

    /// Whether a hook that was replaced still runs in another thread.
    pub(super) fn old_one_runs_elsewhere(&self, me: ThreadId) -> bool {
        matches!(self.turn, Turn::Running(thread, version)
            if thread != me && version != self.version)
    }

    /// Whether the hook runs in this thread.
    pub(super) fn runs_in(&self, me: ThreadId) -> bool {
        matches!(self.turn, Turn::Running(thread, _) if thread == me)
    }

    // What the transfer thread calls.

    /// A new thread for the hook begins; its number.
    pub(super) fn start(&mut self) -> u64 {
        self.thread += 1;
        self.turn = Turn::None;
        self.thread
    }

    /// Gives the hook's thread a turn.
    pub(super) fn call(&mut self, areas: Vec<FishX1Transfer>, turn: u64) {
        self.turn = Turn::Called(areas, turn);
        self.called = Some(Instant::now());
    }

    /// When the current turn was given; `None` without one.
    pub(super) fn busy_since(&self) -> Option<Instant> {
        self.called.filter(|_| matches!(self.turn, Turn::Called(..) | Turn::Running(..)))
    }

    /// Ends the thread: after its turn, or, if the hook hangs, when it returns.
    pub(super) fn end(&mut self) {
        self.thread += 1;
        self.turn = Turn::None;
    }

    // What the hook's thread calls.

    /// Whether the thread with this number is to end.
    pub(super) fn is_over(&self, thread: u64) -> bool {
        self.thread != thread
    }

    /// Begins a turn, if there is one.
    pub(super) fn begin(&mut self, me: ThreadId) -> Option<Begun> {
        match std::mem::take(&mut self.turn) {
            Turn::Called(areas, turn) => {
                self.turn = Turn::Running(me, self.version);
                Some(Begun { hook: self.hook.take(), version: self.version, areas, turn })
            }
            other => {
                self.turn = other;
                None
            }
        }
    }

    /// The hook has returned. If it was replaced meanwhile, this returns it, to be dropped before its turn
    /// [ends](Self::end_turn).
    pub(super) fn returned(&mut self, begun: Begun, me: ThreadId) -> Option<Hook> {
        if !self.runs_in(me) || begun.version != self.version {
            return begun.hook;
        }
        self.hook = begun.hook;
        None
    }

    /// Ends a turn, unless its thread was given up.
    pub(super) fn end_turn(&mut self, me: ThreadId) {
        if self.runs_in(me) {
            self.turn = Turn::None;
        }
    }
}

impl fmt::Debug for HookSlot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("HookSlot").field("turn", &self.turn).finish_non_exhaustive()
    }
}
