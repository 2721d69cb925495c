//! The threads of the program that wait for a response, want the areas or have them.

use std::time::Instant;

use crate::handler::sync::{Thread, ThreadId};
use crate::transfer_area::FishX1Transfer;

/// So many threads need no more memory.
const USUAL: usize = 8;

/// Names a ticket. No number comes twice.
pub(crate) type TicketId = u64;

/// A thread has one ticket from the beginning of its wait until it drops its guard. The cycle hook has one for as long
/// as its thread lives.
#[derive(Debug)]
struct Ticket {
    id: TicketId,
    owner: Owner,
    stage: Stage,
}

/// Whose ticket it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Owner {
    Thread,
    /// The cycle hook, with its thread when that has begun.
    Hook(Option<ThreadId>),
}

/// What a thread is doing.
#[derive(Debug)]
pub(crate) enum Stage {
    /// It waits for the next response.
    Waiting,
    /// Something has stopped the outputs or ended the transfer, and so the wait. A thread has not noticed yet; the hook
    /// may be called with the error.
    Interrupted,
    /// It wants the areas.
    Wants {
        purpose: Purpose,
        /// Whether it has come for them. Before, it was just woken and is on its way.
        here: bool,
    },
    /// It has the areas.
    Holds(Hold),
    /// The hook waits for the end of an earlier one, or is over.
    Away,
}

/// What a thread wants the areas for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To answer this response. The next request waits for it.
    Answer(u64),
    /// To see the inputs of a transfer; an interruption ends this.
    Look,
    /// To lock them, in any case.
    Lock,
}

/// Which thread has the areas.
#[derive(Clone, Debug)]
pub(crate) struct Hold {
    pub(crate) purpose: Purpose,
    pub(crate) thread: Thread,
    pub(crate) since: Instant,
    /// Whether the program was warned that it takes long.
    pub(crate) warned: bool,
}

/// All tickets, in the order in which their threads came, and the areas while no thread has them.
///
/// [`first`](Self::first) says who gets the areas next, [`all_have_answered`](Self::all_have_answered) and
/// [`all_wait`](Self::all_wait) who holds the next request back.
#[derive(Debug)]
pub(crate) struct Tickets {
    /// `None` while a thread has them.
    areas: Option<Vec<FishX1Transfer>>,
    list: Vec<Ticket>,
    /// The newest ticket.
    newest: TicketId,
    /// The ticket of the cycle hook that is set.
    hook: Option<TicketId>,
    /// Whether a thread other than the hook answers the response whose window is open.
    may_end_early: bool,
}

impl Tickets {
    pub(crate) fn new(areas: Vec<FishX1Transfer>) -> Self {
        let list = Vec::with_capacity(USUAL);
        Self { areas: Some(areas), list, newest: 0, hook: None, may_end_early: false }
    }

    /// A thread comes, to wait for the next response or for the areas.
    pub(crate) fn add(&mut self, stage: Stage) -> TicketId {
        self.may_end_early |= matches!(stage, Stage::Wants { purpose: Purpose::Answer(_), .. });
        self.push(Owner::Thread, stage)
    }

    fn push(&mut self, owner: Owner, stage: Stage) -> TicketId {
        self.newest += 1;
        self.list.push(Ticket { id: self.newest, owner, stage });
        self.newest
    }

    /// The thread has stopped waiting, or dropped its guard.
    pub(crate) fn remove(&mut self, id: TicketId) {
        self.list.retain(|ticket| ticket.id != id);
    }

    pub(crate) fn stage(&self, id: TicketId) -> Option<&Stage> {
        self.list.iter().find(|ticket| ticket.id == id).map(|ticket| &ticket.stage)
    }

    fn ticket(&mut self, id: TicketId) -> Option<&mut Ticket> {
        self.list.iter_mut().find(|ticket| ticket.id == id)
    }

    // The areas.

    /// The thread that gets the areas now, if they are free: the hook, so that the others find what it wrote, then one
    /// that answers a response, then one that does not; of several, the one that came first. While the window of the
    /// response `opened` is open, the areas are kept for threads that were woken for it and are on their way.
    pub(crate) fn first(&self, opened: Option<u64>) -> Option<TicketId> {
        self.areas.as_ref()?;
        let is_kept_for = |purpose| opened.map(Purpose::Answer) == Some(purpose);
        let wants = self.list.iter().filter_map(|ticket| match ticket.stage {
            Stage::Wants { purpose, here } if here || is_kept_for(purpose) => {
                Some((ticket.rank(purpose), !here, ticket.id))
            }
            _ => None,
        });
        // One that is here comes before those of its kind that are on their way.
        wants.min().filter(|(_, on_its_way, _)| !on_its_way).map(|(_, _, id)| id)
    }

    /// The thread has come for the areas; returns what for, if it still wants them.
    pub(crate) fn come(&mut self, id: TicketId) -> Option<Purpose> {
        let Stage::Wants { purpose, here } = &mut self.ticket(id)?.stage else { return None };
        *here = true;
        Some(*purpose)
    }

    /// Gives the areas to the thread that is [first](Self::first).
    pub(crate) fn take(&mut self, id: TicketId, hold: Hold) -> Option<Vec<FishX1Transfer>> {
        self.ticket(id)?.stage = Stage::Holds(hold);
        self.areas.take()
    }

    /// The thread puts the areas back. The hook waits for the next response then, or wants a `newer` one than it had,
    /// whose window is open.
    pub(crate) fn put_back(
        &mut self,
        id: TicketId,
        areas: Vec<FishX1Transfer>,
        newer: Option<u64>,
    ) {
        self.areas = Some(areas);
        match self.ticket(id) {
            Some(Ticket { owner: Owner::Hook(_), stage, .. }) => {
                *stage = newer.map_or(Stage::Waiting, Stage::woken_for);
            }
            _ => self.remove(id),
        }
    }

    /// The thread that has the areas.
    pub(crate) fn holder(&self) -> Option<&Hold> {
        self.list.iter().find_map(|ticket| match &ticket.stage {
            Stage::Holds(hold) => Some(hold),
            _ => None,
        })
    }

    pub(crate) fn holder_mut(&mut self) -> Option<&mut Hold> {
        self.list.iter_mut().find_map(|ticket| match &mut ticket.stage {
            Stage::Holds(hold) => Some(hold),
            _ => None,
        })
    }

    // Responses and interruptions.

    /// A response wakes all threads that wait for it, and those that have not got the areas for an earlier one yet; the
    /// hook only if it is to be called. Returns whether there was one.
    pub(crate) fn respond(
        &mut self,
        response: u64,
        calls_hook: bool,
        wake: impl Fn(TicketId),
    ) -> bool {
        self.may_end_early = false;
        let mut any = false;
        for ticket in &mut self.list {
            let is_thread = ticket.owner == Owner::Thread;
            match &mut ticket.stage {
                stage @ Stage::Waiting if is_thread || calls_hook => {
                    *stage = Stage::woken_for(response);
                    wake(ticket.id);
                }
                Stage::Wants { purpose: purpose @ Purpose::Answer(_), .. } => {
                    *purpose = Purpose::Answer(response);
                }
                _ => continue,
            }
            self.may_end_early |= is_thread;
            any = true;
        }
        any
    }

    /// Ends the waits of all threads; that of the hook only if the transfer `goes_on`.
    pub(crate) fn interrupt(&mut self, goes_on: bool, wake: impl Fn(TicketId)) {
        for ticket in &mut self.list {
            let is_thread = ticket.owner == Owner::Thread;
            match &mut ticket.stage {
                Stage::Wants { purpose: Purpose::Lock, .. } | Stage::Holds(_) | Stage::Away => {}
                stage @ (Stage::Waiting | Stage::Interrupted | Stage::Wants { .. }) => {
                    let learns = goes_on || is_thread;
                    *stage = if learns { Stage::Interrupted } else { Stage::Waiting };
                    wake(ticket.id);
                }
            }
        }
    }

    /// Whether threads have waited for this response, and all of them have answered it.
    pub(crate) fn all_have_answered(&self, response: u64) -> bool {
        let is_answering = |ticket: &Ticket| match &ticket.stage {
            Stage::Wants { purpose, .. } | Stage::Holds(Hold { purpose, .. }) => {
                *purpose == Purpose::Answer(response)
            }
            // The hook is called with the error, and then comes for the response.
            Stage::Interrupted => ticket.owner != Owner::Thread,
            Stage::Waiting | Stage::Away => false,
        };
        self.may_end_early && !self.list.iter().any(is_answering)
    }

    /// Whether a thread other than the hook waits for the next response, and no thread does anything else.
    pub(crate) fn all_wait(&self) -> bool {
        let waits = |ticket: &Ticket| matches!(ticket.stage, Stage::Waiting);
        let is_idle = |ticket: &Ticket| waits(ticket) || matches!(ticket.stage, Stage::Away);
        self.list.iter().all(is_idle)
            && self.list.iter().any(|ticket| ticket.owner == Owner::Thread && waits(ticket))
    }

    /// Whether the thread that has the areas `waits` for something else, or nobody has or wants them.
    pub(crate) fn are_at_rest(&self, waits: impl Fn(ThreadId) -> bool) -> bool {
        let is_wanted =
            || self.list.iter().any(|ticket| matches!(ticket.stage, Stage::Wants { .. }));
        self.holder().map_or_else(|| !is_wanted(), |hold| waits(hold.thread.id()))
    }

    // The cycle hook.

    /// No hook is set from now on. Returns the ticket of the one before.
    pub(crate) fn clear_hook(&mut self) -> Option<TicketId> {
        // Hooks that are set later have a newer ticket.
        self.newest += 1;
        self.hook.take()
    }

    /// A hook is set; its ticket. While an earlier one has not ended, no response waits for it.
    pub(crate) fn set_hook(&mut self) -> TicketId {
        let stage = if self.has_hook() { Stage::Away } else { Stage::Waiting };
        let id = self.push(Owner::Hook(None), stage);
        self.hook = Some(id);
        id
    }

    /// The newest number.
    pub(crate) fn newest(&self) -> TicketId {
        self.newest
    }

    /// The ticket of the hook that is set.
    pub(crate) fn hook(&self) -> Option<TicketId> {
        self.hook
    }

    /// The thread of a hook begins.
    pub(crate) fn hook_begins(&mut self, id: TicketId, thread: ThreadId) {
        if let Some(ticket) = self.ticket(id) {
            ticket.owner = Owner::Hook(Some(thread));
        }
    }

    /// What the hook's thread does next.
    pub(crate) fn change(&mut self, id: TicketId, stage: Stage) {
        if let Some(ticket) = self.ticket(id) {
            ticket.stage = stage;
        }
    }

    /// The hook's thread has ended, because it is over or has panicked.
    pub(crate) fn end_hook(&mut self, id: TicketId) {
        self.hook.take_if(|hook| *hook == id);
        self.remove(id);
    }

    /// Whether the thread of a hook before this number has not ended, other than the calling thread.
    pub(crate) fn has_hook_before(&self, number: TicketId, me: ThreadId) -> bool {
        self.list.iter().any(|ticket| match ticket.owner {
            Owner::Hook(thread) => ticket.id < number && thread != Some(me),
            Owner::Thread => false,
        })
    }

    /// Whether this thread is called by the hook, and so waits for itself if it waits for a response.
    pub(crate) fn is_called(&self, thread: ThreadId) -> bool {
        self.list.iter().any(|ticket| {
            ticket.owner == Owner::Hook(Some(thread)) && matches!(ticket.stage, Stage::Interrupted)
        })
    }

    /// Whether there is a hook's thread.
    pub(crate) fn has_hook(&self) -> bool {
        self.list.iter().any(|ticket| ticket.owner != Owner::Thread)
    }

    /// When a hook got the areas that it has.
    pub(crate) fn hook_since(&self) -> Option<Instant> {
        let mut hooks = self.list.iter().filter(|ticket| ticket.owner != Owner::Thread);
        hooks.find_map(|ticket| match &ticket.stage {
            Stage::Holds(hold) => Some(hold.since),
            _ => None,
        })
    }
}

impl Stage {
    /// The thread has waited for this response, and is on its way.
    fn woken_for(response: u64) -> Self {
        Self::Wants { purpose: Purpose::Answer(response), here: false }
    }
}

impl Ticket {
    /// Its turn among those that want the areas.
    fn rank(&self, purpose: Purpose) -> u8 {
        match (self.owner, purpose) {
            (Owner::Hook(_), _) => 0,
            (Owner::Thread, Purpose::Answer(_)) => 1,
            (Owner::Thread, Purpose::Look | Purpose::Lock) => 2,
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;
    use crate::handler::sync::{current_thread, now, thread_id};

    const RESPONSE: u64 = 7;

    fn tickets() -> Tickets {
        Tickets::new(vec![FishX1Transfer::default()])
    }

    fn locks(tickets: &mut Tickets) -> TicketId {
        tickets.add(Stage::Wants { purpose: Purpose::Lock, here: true })
    }

    fn hold(purpose: Purpose) -> Hold {
        Hold { purpose, thread: current_thread(), since: now(), warned: false }
    }

    fn respond(tickets: &mut Tickets) {
        tickets.respond(RESPONSE, true, |_| ());
    }

    #[test]
    fn no_thread_overtakes_one_of_its_kind() {
        let mut tickets = tickets();
        let (first, second) = (locks(&mut tickets), locks(&mut tickets));
        assert_eq!(tickets.first(None), Some(first));
        let areas = tickets.take(first, hold(Purpose::Lock)).unwrap();
        assert_eq!(tickets.first(None), None, "the areas are taken");
        let third = locks(&mut tickets);
        tickets.put_back(first, areas, None);
        assert_eq!(tickets.first(None), Some(second));
        tickets.remove(second);
        assert_eq!(tickets.first(None), Some(third));
    }

    #[test]
    fn the_hook_comes_before_threads_that_answer_and_these_before_those_that_lock() {
        let mut tickets = tickets();
        let lock = locks(&mut tickets);
        let (late, soon) = (tickets.add(Stage::Waiting), tickets.add(Stage::Waiting));
        let hook = tickets.set_hook();
        respond(&mut tickets);
        assert_eq!(tickets.first(Some(RESPONSE)), None, "they are on their way");
        tickets.come(soon);
        assert_eq!(tickets.first(Some(RESPONSE)), None, "the hook is on its way");
        tickets.come(hook);
        assert_eq!(tickets.first(Some(RESPONSE)), Some(hook));
        let areas = tickets.take(hook, hold(Purpose::Answer(RESPONSE))).unwrap();
        tickets.put_back(hook, areas, None);
        assert_eq!(tickets.first(Some(RESPONSE)), Some(soon), "it came first");
        tickets.remove(soon);
        assert_eq!(tickets.first(Some(RESPONSE)), None, "the other one is on its way");
        assert_eq!(tickets.first(None), Some(lock), "the window is closed");
        tickets.remove(late);
        assert_eq!(tickets.first(Some(RESPONSE)), Some(lock));
    }

    #[test]
    fn a_request_may_leave_when_all_threads_that_waited_have_answered() {
        let mut tickets = tickets();
        respond(&mut tickets);
        assert!(!tickets.all_have_answered(RESPONSE), "nobody has waited");
        let (one, other) = (tickets.add(Stage::Waiting), tickets.add(Stage::Waiting));
        let lock = locks(&mut tickets);
        respond(&mut tickets);
        assert!(!tickets.all_have_answered(RESPONSE));
        tickets.come(one);
        let areas = tickets.take(one, hold(Purpose::Answer(RESPONSE))).unwrap();
        tickets.remove(other);
        assert!(!tickets.all_have_answered(RESPONSE), "one has the areas");
        tickets.put_back(one, areas, None);
        assert!(tickets.all_have_answered(RESPONSE), "one that only locks is not waited for");
        tickets.remove(lock);
        // A thread that comes within the window answers, too.
        let joins = tickets.add(Stage::Wants { purpose: Purpose::Answer(RESPONSE), here: true });
        assert!(!tickets.all_have_answered(RESPONSE));
        tickets.remove(joins);
        assert!(tickets.all_have_answered(RESPONSE));
    }

    #[test]
    fn the_hook_is_waited_for_and_does_not_end_a_window_early() {
        let mut tickets = tickets();
        let hook = tickets.set_hook();
        respond(&mut tickets);
        assert!(!tickets.all_have_answered(RESPONSE));
        tickets.change(hook, Stage::Waiting);
        assert!(!tickets.all_have_answered(RESPONSE), "a program that polls has the whole window");
        let waits = tickets.add(Stage::Waiting);
        respond(&mut tickets);
        tickets.remove(waits);
        assert!(!tickets.all_have_answered(RESPONSE), "the hook has not answered");
        tickets.change(hook, Stage::Interrupted);
        assert!(!tickets.all_have_answered(RESPONSE), "it is called with an error first");
        tickets.change(hook, Stage::Waiting);
        assert!(tickets.all_have_answered(RESPONSE));
    }

    #[test]
    fn a_hook_that_is_late_comes_first_for_the_response_that_has_come_in_meanwhile() {
        let mut tickets = tickets();
        let hook = tickets.set_hook();
        respond(&mut tickets);
        tickets.come(hook);
        let areas = tickets.take(hook, hold(Purpose::Answer(RESPONSE))).unwrap();
        let waits = tickets.add(Stage::Waiting);
        tickets.respond(RESPONSE + 1, true, |_| ());
        tickets.come(waits);
        tickets.put_back(hook, areas, Some(RESPONSE + 1));
        assert_eq!(tickets.first(Some(RESPONSE + 1)), None, "the hook is on its way");
        tickets.come(hook);
        assert_eq!(tickets.first(Some(RESPONSE + 1)), Some(hook));
    }

    #[test]
    fn a_thread_that_has_not_got_the_areas_answers_the_newer_response() {
        let mut tickets = tickets();
        let waits = tickets.add(Stage::Waiting);
        respond(&mut tickets);
        tickets.come(waits);
        tickets.respond(RESPONSE + 1, true, |_| ());
        assert!(!tickets.all_have_answered(RESPONSE + 1));
        tickets.remove(waits);
        assert!(tickets.all_have_answered(RESPONSE + 1));
    }

    #[test]
    fn the_hook_is_not_woken_when_the_transfer_is_to_end() {
        let mut tickets = tickets();
        let hook = tickets.set_hook();
        tickets.respond(RESPONSE, false, |_| panic!("it is woken"));
        let lock = locks(&mut tickets);
        assert_eq!(tickets.first(Some(RESPONSE)), Some(lock), "the areas are kept for nobody");
        assert!(matches!(tickets.stage(hook), Some(Stage::Waiting)));
    }

    #[test]
    fn a_hook_that_may_not_run_yet_keeps_nobody() {
        let mut tickets = tickets();
        let first = tickets.set_hook();
        tickets.clear_hook();
        let second = tickets.set_hook();
        respond(&mut tickets);
        tickets.change(first, Stage::Away);
        let lock = locks(&mut tickets);
        assert_eq!(tickets.first(Some(RESPONSE)), Some(lock));
        assert!(matches!(tickets.stage(second), Some(Stage::Away)));
    }

    #[test]
    fn the_time_moves_when_a_thread_waits_and_none_does_anything_else() {
        let mut tickets = tickets();
        assert!(!tickets.all_wait(), "nobody waits");
        let hook = tickets.set_hook();
        assert!(!tickets.all_wait(), "the hook does not move the time");
        let waits = tickets.add(Stage::Waiting);
        assert!(tickets.all_wait());
        let lock = locks(&mut tickets);
        assert!(!tickets.all_wait());
        tickets.remove(lock);
        tickets.change(hook, Stage::Interrupted);
        assert!(!tickets.all_wait(), "the hook is called");
        tickets.change(hook, Stage::Away);
        assert!(tickets.all_wait());
        tickets.interrupt(true, |_| ());
        assert!(!tickets.all_wait(), "it has not noticed yet");
        tickets.remove(waits);
    }

    #[test]
    fn an_interruption_ends_all_waits_and_no_lock() {
        let mut tickets = tickets();
        let (waits, woken) = (tickets.add(Stage::Waiting), tickets.add(Stage::Waiting));
        tickets.remove(waits);
        respond(&mut tickets);
        let waits = tickets.add(Stage::Waiting);
        let (lock, hook) = (locks(&mut tickets), tickets.set_hook());
        tickets.interrupt(false, |_| ());
        for id in [waits, woken] {
            assert!(matches!(tickets.stage(id), Some(Stage::Interrupted)));
        }
        assert!(matches!(tickets.stage(lock), Some(Stage::Wants { .. })));
        assert!(
            matches!(tickets.stage(hook), Some(Stage::Waiting)),
            "it waits for the next transfer"
        );
        tickets.interrupt(true, |_| ());
        assert!(matches!(tickets.stage(hook), Some(Stage::Interrupted)));
    }

    #[test]
    fn a_hook_waits_for_the_end_of_earlier_ones_but_not_for_itself() {
        let mut tickets = tickets();
        let me = thread_id();
        let first = tickets.set_hook();
        assert_eq!(tickets.clear_hook(), Some(first));
        let second = tickets.set_hook();
        assert!(tickets.has_hook_before(second, me));
        assert!(!tickets.has_hook_before(first, me));
        tickets.hook_begins(first, me);
        assert!(!tickets.has_hook_before(second, me), "that is this thread");
        assert!(tickets.has_hook_before(second + 1, me), "the second one has not ended");
        tickets.end_hook(first);
        assert_eq!(tickets.hook(), Some(second));
        tickets.end_hook(second);
        assert!(tickets.hook().is_none() && !tickets.has_hook());
    }
}
