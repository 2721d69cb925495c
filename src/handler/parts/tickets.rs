//! The threads of the program that wait for a response, want the areas or have them.

use std::time::Instant;

use crate::handler::sync::{Thread, ThreadId};
use crate::transfer_area::FishX1Transfer;

/// Names a ticket. No number comes twice.
pub(crate) type TicketId = u64;

/// A thread has one ticket from the beginning of its wait until it drops its guard. The cycle hook has one for as long
/// as its thread lives.
#[derive(Debug)]
struct Ticket {
    id: TicketId,
    of: Of,
    stage: Stage,
}

/// Whose ticket it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Thread,
    /// The cycle hook, with its thread when that has begun.
    Hook(Option<ThreadId>),
}

/// What a thread is doing.
#[derive(Debug)]
pub(crate) enum Stage {
    /// It waits for the next response.
    Waiting,
    /// Something has stopped the outputs or ended the transfer, and so the wait; the thread has not noticed yet.
    Interrupted,
    /// It wants the areas: to answer a response, or only to lock them.
    Wants {
        answers: Option<u64>,
        /// Whether it has come for them: a thread that was just woken is still on its way.
        here: bool,
    },
    /// It has the areas.
    Holds(Hold),
    /// The hook is over, and its thread is about to end.
    Leaving,
}

/// Which thread has the areas, and what counts when it puts them back.
#[derive(Clone, Debug)]
pub(crate) struct Hold {
    pub(crate) thread: Thread,
    pub(crate) since: Instant,
    /// The response that it answers.
    pub(crate) answers: Option<u64>,
    /// The newest response that is in the areas.
    pub(crate) shows: u64,
    /// Whether its handle shows this response for the first time.
    pub(crate) shows_first: bool,
    /// How many interruptions there were; if there are more, the outputs do not count.
    pub(crate) interruptions: u64,
    /// Whether the outputs count at all.
    pub(crate) outputs_count: bool,
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
    /// Whether a thread other than the hook answers the response whose window is open: only then it ends early.
    hurries: bool,
}

impl Tickets {
    pub(crate) fn new(areas: Vec<FishX1Transfer>) -> Self {
        Self { areas: Some(areas), list: Vec::new(), newest: 0, hook: None, hurries: false }
    }

    /// A thread comes, to wait for the next response or for the areas.
    pub(crate) fn add(&mut self, stage: Stage) -> TicketId {
        self.hurries |= matches!(stage, Stage::Wants { answers: Some(_), .. });
        self.push(Of::Thread, stage)
    }

    fn push(&mut self, of: Of, stage: Stage) -> TicketId {
        self.newest += 1;
        self.list.push(Ticket { id: self.newest, of, stage });
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
    /// that answers a response, then one that only locks; of several, the one that came first. While the window of
    /// the response `opened` is open, the areas are kept for threads that were woken for it and are on their way.
    pub(crate) fn first(&self, opened: Option<u64>) -> Option<TicketId> {
        self.areas.as_ref()?;
        let wants = self.list.iter().filter_map(|ticket| match ticket.stage {
            Stage::Wants { answers, here } if here || answers == opened => {
                Some((ticket.rank(answers), !here, ticket.id))
            }
            _ => None,
        });
        // One that is here comes before those of its kind that are on their way.
        wants.min().filter(|(_, on_its_way, _)| !on_its_way).map(|(_, _, id)| id)
    }

    /// The thread has come for the areas, to answer this response or only to lock them.
    pub(crate) fn come(&mut self, id: TicketId, answers: Option<u64>) {
        if let Some(ticket) = self.ticket(id) {
            ticket.stage = Stage::Wants { answers, here: true };
        }
    }

    /// Gives the areas to the thread that is [first](Self::first).
    pub(crate) fn take(&mut self, id: TicketId, hold: Hold) -> Option<Vec<FishX1Transfer>> {
        let answers = hold.answers.is_some();
        let ticket = self.ticket(id)?;
        ticket.stage = Stage::Holds(hold);
        let is_thread = ticket.of == Of::Thread;
        self.hurries |= answers && is_thread;
        self.areas.take()
    }

    /// The thread puts the areas back. The hook waits for the next response then.
    pub(crate) fn put_back(&mut self, id: TicketId, areas: Vec<FishX1Transfer>) {
        self.areas = Some(areas);
        match self.ticket(id) {
            Some(ticket) if ticket.of != Of::Thread => ticket.stage = Stage::Waiting,
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

    /// A response wakes all threads that wait for it; returns whether there was one.
    pub(crate) fn respond(&mut self, response: u64, wake: impl Fn(TicketId)) -> bool {
        self.hurries = false;
        let mut any = false;
        for ticket in &mut self.list {
            if let Stage::Waiting = ticket.stage {
                ticket.stage = Stage::Wants { answers: Some(response), here: false };
                self.hurries |= ticket.of == Of::Thread;
                any = true;
                wake(ticket.id);
            }
        }
        any
    }

    /// Ends the waits of all threads; that of the hook only if the transfer `goes_on`.
    pub(crate) fn interrupt(&mut self, goes_on: bool, wake: impl Fn(TicketId)) {
        for ticket in &mut self.list {
            if let Stage::Waiting | Stage::Wants { answers: Some(_), .. } = ticket.stage {
                let is_told = goes_on || ticket.of == Of::Thread;
                ticket.stage = if is_told { Stage::Interrupted } else { Stage::Waiting };
                wake(ticket.id);
            }
        }
    }

    /// Whether threads have waited for this response, and all of them have answered it.
    pub(crate) fn all_have_answered(&self, response: u64) -> bool {
        let is_answering = |ticket: &Ticket| match &ticket.stage {
            Stage::Wants { answers, .. } => *answers == Some(response),
            Stage::Holds(hold) => hold.answers == Some(response),
            // The hook is called with the error, and then comes for the response.
            Stage::Interrupted => ticket.of != Of::Thread,
            Stage::Waiting | Stage::Leaving => false,
        };
        self.hurries && !self.list.iter().any(is_answering)
    }

    /// Whether a thread other than the hook waits for the next response, and no thread does anything else.
    pub(crate) fn all_wait(&self) -> bool {
        let waits = |ticket: &Ticket| matches!(ticket.stage, Stage::Waiting);
        let is_idle = |ticket: &Ticket| waits(ticket) || matches!(ticket.stage, Stage::Leaving);
        self.list.iter().all(is_idle)
            && self.list.iter().any(|ticket| ticket.of == Of::Thread && waits(ticket))
    }

    // The cycle hook.

    /// No hook is set from now on. Returns the ticket of the one before.
    pub(crate) fn clear_hook(&mut self) -> Option<TicketId> {
        // Hooks that are set later have a newer ticket.
        self.newest += 1;
        self.hook.take()
    }

    /// A hook is set; its ticket.
    pub(crate) fn set_hook(&mut self) -> TicketId {
        let id = self.push(Of::Hook(None), Stage::Waiting);
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
            ticket.of = Of::Hook(Some(thread));
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
        self.list.iter().any(|ticket| match ticket.of {
            Of::Hook(thread) => ticket.id < number && thread != Some(me),
            Of::Thread => false,
        })
    }

    /// Whether there is a hook's thread.
    pub(crate) fn has_hook(&self) -> bool {
        self.list.iter().any(|ticket| ticket.of != Of::Thread)
    }

    /// When a hook got the areas that it has.
    pub(crate) fn hook_since(&self) -> Option<Instant> {
        let mut hooks = self.list.iter().filter(|ticket| ticket.of != Of::Thread);
        hooks.find_map(|ticket| match &ticket.stage {
            Stage::Holds(hold) => Some(hold.since),
            _ => None,
        })
    }
}

impl Ticket {
    /// Its turn among those that want the areas.
    fn rank(&self, answers: Option<u64>) -> u8 {
        match (self.of, answers) {
            (Of::Hook(_), _) => 0,
            (Of::Thread, Some(_)) => 1,
            (Of::Thread, None) => 2,
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
        tickets.add(Stage::Wants { answers: None, here: true })
    }

    fn hold(answers: Option<u64>) -> Hold {
        Hold {
            thread: current_thread(),
            since: now(),
            answers,
            shows: RESPONSE,
            shows_first: true,
            interruptions: 0,
            outputs_count: true,
            warned: false,
        }
    }

    fn respond(tickets: &mut Tickets) {
        tickets.respond(RESPONSE, |_| ());
    }

    #[test]
    fn no_thread_overtakes_one_of_its_kind() {
        let mut tickets = tickets();
        let (first, second) = (locks(&mut tickets), locks(&mut tickets));
        assert_eq!(tickets.first(None), Some(first));
        let areas = tickets.take(first, hold(None)).unwrap();
        assert_eq!(tickets.first(None), None, "the areas are taken");
        let third = locks(&mut tickets);
        tickets.put_back(first, areas);
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
        tickets.come(soon, Some(RESPONSE));
        assert_eq!(tickets.first(Some(RESPONSE)), None, "the hook is on its way");
        tickets.come(hook, Some(RESPONSE));
        assert_eq!(tickets.first(Some(RESPONSE)), Some(hook));
        let areas = tickets.take(hook, hold(Some(RESPONSE))).unwrap();
        tickets.put_back(hook, areas);
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
        tickets.come(one, Some(RESPONSE));
        let areas = tickets.take(one, hold(Some(RESPONSE))).unwrap();
        tickets.remove(other);
        assert!(!tickets.all_have_answered(RESPONSE), "one has the areas");
        tickets.put_back(one, areas);
        assert!(tickets.all_have_answered(RESPONSE), "one that only locks is not waited for");
        tickets.remove(lock);
        // A thread that comes within the window answers, too.
        let joins = tickets.add(Stage::Wants { answers: Some(RESPONSE), here: true });
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
        tickets.change(hook, Stage::Leaving);
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
