//! Who has the areas, and who is next.

use std::time::Instant;

use super::sync::ThreadId;
use crate::transfer_area::FishX1Transfer;

/// A thread that locks the areas takes them out, and puts them back afterwards.
///
/// No thread overtakes waiting ones, so a thread that locks repeatedly does not starve the others. The
/// cycle hook comes first, then threads that answer a response, for which the areas are kept while its
/// window is open, then threads that just lock.
#[derive(Debug)]
pub(super) struct AreaLock {
    /// `None` while a thread has them.
    areas: Option<Vec<FishX1Transfer>>,
    /// Counts the holders, to know one whose areas were replaced.
    turn: u64,
    holder: Option<Holder>,
    /// The kind of the waiting thread that the areas were promised to.
    promised: Option<Waiter>,
    /// How many threads wait, by kind.
    waiting: [usize; 2],
    /// How many threads were told of a response and have not taken the areas yet. Until they have, no
    /// thread of the other kind gets them.
    expected: usize,
    hook_waits: bool,
}

/// Which thread has the areas, and since when.
#[derive(Clone, Copy, Debug)]
pub(super) struct Holder {
    pub(super) thread: ThreadId,
    pub(super) since: Instant,
}

/// The kinds of threads of the program that wait for the areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Waiter {
    /// The next request waits for the thread.
    Reacting,
    Other,
}

impl AreaLock {
    pub(super) fn new(areas: Vec<FishX1Transfer>) -> Self {
        Self {
            areas: Some(areas),
            turn: 0,
            holder: None,
            promised: None,
            waiting: [0; 2],
            expected: 0,
            hook_waits: false,
        }
    }

    /// Takes the areas unless another thread has them or comes first; returns also the holder's turn.
    pub(super) fn try_take(
        &mut self,
        waiter: Waiter,
        holder: Holder,
    ) -> Option<(Vec<FishX1Transfer>, u64)> {
        let others_first = waiter == Waiter::Other && self.expected > 0;
        if self.promised.is_some() || self.hook_waits || others_first {
            return None;
        }
        self.take(holder)
    }

    /// Keeps the areas for threads that were just told of a response.
    pub(super) fn expect(&mut self, threads: usize) {
        self.expected = threads;
    }

    /// Keeps the areas for one more such thread.
    pub(super) fn expect_one_more(&mut self) {
        self.expected += 1;
    }

    /// One of these threads has come. Returns the kind to wake, as [`put_back`](Self::put_back).
    pub(super) fn arrive(&mut self) -> Option<Waiter> {
        self.expected = self.expected.saturating_sub(1);
        self.promise_if_free()
    }

    /// Stops keeping the areas. Returns the kind to wake, as [`put_back`](Self::put_back).
    pub(super) fn expect_nobody(&mut self) -> Option<Waiter> {
        self.expected = 0;
        self.promise_if_free()
    }

    /// Takes the areas if they were promised to this kind of waiter.
    pub(super) fn take_promised(
        &mut self,
        waiter: Waiter,
        holder: Holder,
    ) -> Option<(Vec<FishX1Transfer>, u64)> {
        self.promised.take_if(|promised| *promised == waiter)?;
        self.take(holder)
    }

    /// Takes the areas for the cycle hook, or makes it the next one.
    pub(super) fn take_for_hook(&mut self, holder: Holder) -> Option<(Vec<FishX1Transfer>, u64)> {
        let taken = if self.promised.is_none() { self.take(holder) } else { None };
        self.hook_waits = taken.is_none();
        taken
    }

    fn take(&mut self, holder: Holder) -> Option<(Vec<FishX1Transfer>, u64)> {
        let areas = self.areas.take()?;
        self.turn += 1;
        self.holder = Some(holder);
        Some((areas, self.turn))
    }

    /// The hook's turn has passed. Returns the kind to wake, as [`put_back`](Self::put_back).
    pub(super) fn pass_hook(&mut self) -> Option<Waiter> {
        self.hook_waits = false;
        self.promise_if_free()
    }

    fn promise_if_free(&mut self) -> Option<Waiter> {
        if self.areas.is_none() || self.promised.is_some() {
            return None;
        }
        self.promise()
    }

    /// A thread begins to wait for the areas.
    pub(super) fn wait(&mut self, waiter: Waiter) {
        self.waiting[waiter as usize] += 1;
    }

    /// A thread has waited for the areas.
    pub(super) fn waited(&mut self, waiter: Waiter) {
        self.waiting[waiter as usize] -= 1;
    }

    /// Puts the areas back; returns the kind of waiters of which one is to be woken. Areas from a holder
    /// whose turn is over are thrown away.
    pub(super) fn put_back(&mut self, areas: Vec<FishX1Transfer>, turn: u64) -> Option<Waiter> {
        if turn != self.turn {
            return None;
        }
        self.areas = Some(areas);
        self.holder = None;
        self.promise()
    }

    /// Replaces the areas that a thread has not given back.
    pub(super) fn replace(&mut self, areas: Vec<FishX1Transfer>) -> Option<Waiter> {
        self.turn += 1;
        self.put_back(areas, self.turn)
    }

    fn promise(&mut self) -> Option<Waiter> {
        if self.hook_waits {
            return None;
        }
        let [reacting, other] = self.waiting.map(|waiting| waiting > 0);
        self.promised = match (reacting, self.expected) {
            (true, _) => Some(Waiter::Reacting),
            (false, 0) if other => Some(Waiter::Other),
            (false, _) => None,
        };
        self.promised
    }

    /// Hands the areas to another thread.
    pub(super) fn hand_to(&mut self, thread: ThreadId) {
        if let Some(holder) = &mut self.holder {
            holder.thread = thread;
        }
    }

    pub(super) fn hook_waits(&self) -> bool {
        self.hook_waits
    }

    pub(super) fn holder(&self) -> Option<Holder> {
        self.holder
    }

    /// Whether this is still the turn of a holder.
    pub(super) fn is_turn(&self, turn: u64) -> bool {
        self.turn == turn
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;
    use crate::handler::sync::thread_id;

    fn lock() -> AreaLock {
        AreaLock::new(vec![FishX1Transfer::default()])
    }

    fn me() -> Holder {
        Holder { thread: thread_id(), since: Instant::now() }
    }

    #[test]
    fn no_thread_overtakes_a_waiting_one() {
        let mut lock = lock();
        let (areas, turn) = lock.try_take(Waiter::Other, me()).unwrap();
        assert!(lock.try_take(Waiter::Other, me()).is_none());
        lock.wait(Waiter::Other);
        assert_eq!(lock.put_back(areas, turn), Some(Waiter::Other));
        assert!(lock.try_take(Waiter::Other, me()).is_none(), "they are promised");
        assert!(lock.take_promised(Waiter::Reacting, me()).is_none(), "to another kind");
        assert!(lock.take_promised(Waiter::Other, me()).is_some());
        lock.waited(Waiter::Other);
        assert!(lock.take_promised(Waiter::Other, me()).is_none(), "once");
    }

    #[test]
    fn a_thread_that_answers_a_response_comes_before_one_that_just_locks() {
        let mut lock = lock();
        let (areas, turn) = lock.try_take(Waiter::Other, me()).unwrap();
        lock.wait(Waiter::Other);
        lock.wait(Waiter::Reacting);
        assert_eq!(lock.put_back(areas, turn), Some(Waiter::Reacting));
        let (areas, turn) = lock.take_promised(Waiter::Reacting, me()).unwrap();
        lock.waited(Waiter::Reacting);
        assert_eq!(lock.put_back(areas, turn), Some(Waiter::Other));
    }

    #[test]
    fn the_areas_are_kept_for_threads_that_were_told_of_a_response() {
        let mut lock = lock();
        let (areas, turn) = lock.try_take(Waiter::Other, me()).unwrap();
        lock.wait(Waiter::Other);
        lock.expect(2);
        assert_eq!(lock.put_back(areas, turn), None);
        assert!(lock.try_take(Waiter::Other, me()).is_none());
        let (areas, turn) = lock.try_take(Waiter::Reacting, me()).unwrap();
        assert_eq!(lock.arrive(), None, "it has them");
        assert_eq!(lock.put_back(areas, turn), None, "another one is still to come");
        assert_eq!(lock.arrive(), Some(Waiter::Other), "it does not take them");
        assert!(lock.take_promised(Waiter::Other, me()).is_some());
    }

    #[test]
    fn the_areas_are_kept_no_longer_than_the_window_is_open() {
        let mut lock = lock();
        lock.expect(1);
        lock.wait(Waiter::Other);
        assert_eq!(lock.expect_nobody(), Some(Waiter::Other));
    }

    #[test]
    fn the_hook_comes_first_unless_its_turn_has_passed() {
        let mut lock = lock();
        let (areas, turn) = lock.try_take(Waiter::Other, me()).unwrap();
        lock.wait(Waiter::Reacting);
        assert!(lock.take_for_hook(me()).is_none());
        assert_eq!(lock.put_back(areas, turn), None);
        assert!(lock.try_take(Waiter::Other, me()).is_none());
        let (areas, turn) = lock.take_for_hook(me()).unwrap();
        assert!(!lock.hook_waits());
        assert_eq!(lock.put_back(areas, turn), Some(Waiter::Reacting));
        let (areas, turn) = lock.take_promised(Waiter::Reacting, me()).unwrap();
        assert!(lock.take_for_hook(me()).is_none());
        assert_eq!(lock.put_back(areas, turn), None);
        assert_eq!(lock.pass_hook(), Some(Waiter::Reacting));
    }

    #[test]
    fn a_holder_whose_turn_is_over_puts_nothing_back() {
        let mut lock = lock();
        let (mut areas, turn) = lock.try_take(Waiter::Other, me()).unwrap();
        areas[0].output.duty[0] = 512;
        lock.replace(vec![FishX1Transfer::default()]);
        let (fresh, next) = lock.try_take(Waiter::Other, me()).unwrap();
        assert_eq!(lock.put_back(areas, turn), None);
        assert!(lock.holder().is_some(), "another one has them now");
        assert_eq!(fresh[0].output.duty[0], 0);
        lock.put_back(fresh, next);
        assert!(lock.holder().is_none());
    }
}
