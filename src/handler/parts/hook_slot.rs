//! Which cycle hook is set, and what its thread is doing.

use std::time::{Duration, Instant};

use crate::handler::sync::{now, ThreadId};

/// The function itself belongs to its thread. Here is what others have to know of it.
#[derive(Debug)]
pub(crate) struct HookSlot {
    /// How long a call may take.
    limit: Duration,
    /// Counts the hooks that were set and cleared.
    version: u64,
    /// Whether the last one was set.
    set: bool,
    /// The hooks whose threads have not ended and were not given up.
    threads: Vec<u64>,
    /// Whether the function is to be called for the newest response.
    due: bool,
    /// The hook's thread that is in the program's function, or drops it.
    call: Option<Call>,
}

#[derive(Clone, Copy, Debug)]
struct Call {
    thread: ThreadId,
    version: u64,
    since: Instant,
    /// Whether it answers a response, and so has the areas.
    answers: bool,
}

impl HookSlot {
    pub(crate) fn new(limit: Duration) -> Self {
        Self { limit, version: 0, set: false, threads: Vec::new(), due: false, call: None }
    }

    pub(crate) fn limit(&self) -> Duration {
        self.limit
    }

    /// The hook that was set, if any, is not called any more. Returns the version of having none.
    pub(crate) fn clear(&mut self) -> u64 {
        self.version += 1;
        self.set = false;
        self.due = false;
        self.version
    }

    /// A hook is set, whose thread is about to start; its version.
    pub(crate) fn set(&mut self) -> u64 {
        self.clear();
        self.set = true;
        self.threads.push(self.version);
        self.version
    }

    /// Whether this hook was replaced or cleared.
    pub(crate) fn is_over(&self, version: u64) -> bool {
        self.version != version
    }

    /// Whether threads of hooks before this version are left, other than the one that asks.
    pub(crate) fn has_older(&self, version: u64, me: ThreadId) -> bool {
        let own = self.call.filter(|call| call.thread == me).map(|call| call.version);
        self.threads.iter().any(|thread| *thread < version && Some(*thread) != own)
    }

    // What the transfer thread calls.

    /// A response has come in for which the hook is to be called. Returns whether a call for an earlier
    /// response is left out.
    pub(crate) fn call_for_response(&mut self) -> bool {
        self.set && std::mem::replace(&mut self.due, true)
    }

    /// Whether the hook is going to take the areas, or has them and is going to take them again.
    pub(crate) fn is_about_to_take(&self) -> bool {
        self.due && self.call.is_none_or(|call| call.answers)
    }

    /// The hook is not called for the last response any more. Returns whether this leaves a call out.
    pub(crate) fn stop(&mut self) -> bool {
        std::mem::take(&mut self.due)
    }

    /// Whether the hook is answering a response, or is going to.
    pub(crate) fn is_answering(&self) -> bool {
        self.due || self.call.is_some_and(|call| call.answers)
    }

    /// Whether the program's function runs, or is going to.
    pub(crate) fn is_busy(&self) -> bool {
        self.due || self.call.is_some()
    }

    /// When the call that is running has taken too long.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.call.and_then(|call| call.since.checked_add(self.limit))
    }

    /// Gives the hook up whose call has taken too long; returns its thread.
    pub(crate) fn give_up(&mut self, now: Instant) -> Option<ThreadId> {
        self.deadline().filter(|deadline| *deadline <= now)?;
        let call = self.call.take()?;
        self.thread_ends(call.version);
        if call.version == self.version {
            self.clear();
        }
        Some(call.thread)
    }

    // What the hook's thread calls.

    /// Whether the program's function is to be called for a response.
    pub(crate) fn is_due(&self) -> bool {
        self.due
    }

    /// Whether no other hook's thread is in its function, so that only one runs at a time.
    pub(crate) fn is_free(&self) -> bool {
        self.call.is_none()
    }

    /// A call of this hook begins; whether it `answers` the newest response.
    pub(crate) fn begin(&mut self, thread: ThreadId, version: u64, answers: bool) {
        self.due &= !answers;
        self.call = Some(Call { thread, version, since: now(), answers });
    }

    /// The call of this thread has ended, unless it was given up.
    pub(crate) fn returned(&mut self, thread: ThreadId) {
        self.call.take_if(|call| call.thread == thread);
    }

    /// A hook's thread ends, or nobody waits for it any more.
    pub(crate) fn thread_ends(&mut self, version: u64) {
        self.threads.retain(|thread| *thread != version);
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;
    use crate::handler::sync::thread_id;

    const LIMIT: Duration = Duration::from_millis(500);

    fn set() -> (HookSlot, u64) {
        let mut slot = HookSlot::new(LIMIT);
        let version = slot.set();
        (slot, version)
    }

    #[test]
    fn each_response_is_answered_once_or_left_out() {
        let (mut slot, version) = set();
        assert!(!slot.call_for_response());
        assert!(slot.is_due() && slot.is_about_to_take());
        slot.begin(thread_id(), version, true);
        assert!(slot.is_answering() && !slot.is_due());
        assert!(!slot.call_for_response(), "the hook was called for the last one");
        assert!(slot.is_about_to_take(), "when it has returned");
        assert!(slot.call_for_response(), "one is left out");
        slot.returned(thread_id());
        assert!(slot.is_answering());
        slot.begin(thread_id(), version, true);
        slot.returned(thread_id());
        assert!(!slot.is_busy());
    }

    #[test]
    fn nobody_waits_for_a_hook_that_is_told_of_an_interruption_but_in_lock_step() {
        let (mut slot, version) = set();
        slot.begin(thread_id(), version, false);
        assert!(slot.is_busy() && !slot.is_answering());
        slot.call_for_response();
        assert!(slot.is_answering() && !slot.is_about_to_take());
    }

    #[test]
    fn a_call_that_takes_too_long_is_given_up_and_never_made_again() {
        let (mut slot, version) = set();
        slot.begin(thread_id(), version, true);
        let deadline = slot.deadline().unwrap();
        assert_eq!(slot.give_up(deadline - Duration::from_nanos(1)), None);
        assert_eq!(slot.give_up(deadline), Some(thread_id()));
        assert_eq!(slot.give_up(deadline), None, "once");
        slot.call_for_response();
        assert!(slot.is_over(version) && !slot.is_due() && !slot.is_busy());
        // Another hook is not disturbed by it.
        let next = slot.set();
        assert!(!slot.has_older(next, thread_id()), "nobody waits for it");
        slot.thread_ends(version);
        assert!(slot.has_older(next + 1, thread_id()));
    }

    #[test]
    fn only_its_own_thread_does_not_wait_for_itself() {
        let (mut slot, version) = set();
        assert!(!slot.has_older(version, thread_id()), "it is not an older one");
        let cleared = slot.clear();
        assert!(slot.has_older(cleared, thread_id()) && slot.is_over(version));
        slot.begin(thread_id(), version, true);
        assert!(!slot.has_older(cleared, thread_id()));
        slot.returned(thread_id());
        assert!(slot.has_older(cleared, thread_id()));
        slot.thread_ends(version);
        assert!(!slot.has_older(cleared, thread_id()));
    }
}
