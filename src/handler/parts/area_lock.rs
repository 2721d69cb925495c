//! Who has the areas, and who is next.

use std::time::{Duration, Instant};

use crate::handler::sync::{self, current_thread, Thread, ThreadId};
use crate::transfer_area::FishX1Transfer;

/// A thread that locks the areas takes them out, and puts them back afterwards.
///
/// No thread overtakes waiting ones, so a thread that locks repeatedly does not starve the others. The
/// kinds of threads take turns by their rank, and while the window of a response is open, the areas are
/// kept for the threads that were woken for it.
#[derive(Debug)]
pub(crate) struct AreaLock {
    /// `None` while a thread has them.
    areas: Option<Vec<FishX1Transfer>>,
    /// The number of the newest lease: counts the holders, to know one whose areas were replaced.
    lease: u64,
    holder: Option<Holder>,
    /// The kind of the waiting thread that the areas were promised to.
    promised: Option<Waiter>,
    /// How many threads wait, by kind.
    waiting: [usize; Waiter::COUNT],
    /// How many threads were woken for a response and have not taken the areas yet, by kind. Until they have,
    /// no thread of a later kind gets them.
    expected: [usize; Waiter::COUNT],
}

/// Which thread has the areas, and since when.
#[derive(Clone, Debug)]
pub(crate) struct Holder {
    pub(crate) thread: Thread,
    pub(crate) since: Instant,
}

impl Holder {
    /// The calling thread, from now on.
    pub(crate) fn now() -> Self {
        Self { thread: current_thread(), since: sync::now() }
    }

    pub(crate) fn held(&self) -> Duration {
        sync::now() - self.since
    }
}

/// How a message names a thread.
pub(crate) fn name_of(thread: &Thread) -> String {
    thread.name().map_or("a thread without a name".into(), |name| format!("the thread {name:?}"))
}

/// The kinds of threads that wait for the areas, by their rank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Waiter {
    /// The cycle hook, so that the others find what it wrote.
    Hook,
    /// The next request waits for the thread.
    Reacting,
    Other,
}

impl Waiter {
    pub(crate) const COUNT: usize = 3;
    const BY_RANK: [Self; Self::COUNT] = [Self::Hook, Self::Reacting, Self::Other];
}

impl AreaLock {
    pub(crate) fn new(areas: Vec<FishX1Transfer>) -> Self {
        Self {
            areas: Some(areas),
            lease: 0,
            holder: None,
            promised: None,
            waiting: [0; Waiter::COUNT],
            expected: [0; Waiter::COUNT],
        }
    }

    /// Takes the areas unless another thread has them or comes first; returns also the lease's number.
    pub(crate) fn try_take(
        &mut self,
        waiter: Waiter,
        holder: Holder,
    ) -> Option<(Vec<FishX1Transfer>, u64)> {
        let others_first = self.expected[..waiter as usize].iter().any(|expected| *expected > 0);
        if self.promised.is_some() || others_first {
            return None;
        }
        self.take(holder)
    }

    /// Keeps the areas for so many threads of a kind, which were just woken for a response.
    pub(crate) fn expect(&mut self, waiter: Waiter, threads: usize) {
        self.expected[waiter as usize] = threads;
    }

    /// Keeps the areas for one more reacting thread.
    pub(crate) fn expect_one_more(&mut self) {
        self.expected[Waiter::Reacting as usize] += 1;
    }

    /// One of these threads has come. Returns the kind to wake, as [`put_back`](Self::put_back).
    pub(crate) fn arrive(&mut self, waiter: Waiter) -> Option<Waiter> {
        let expected = &mut self.expected[waiter as usize];
        *expected = expected.saturating_sub(1);
        self.promise_if_free()
    }

    /// Stops keeping the areas. Returns the kind to wake, as [`put_back`](Self::put_back).
    pub(crate) fn expect_nobody(&mut self) -> Option<Waiter> {
        self.expected = [0; Waiter::COUNT];
        self.promise_if_free()
    }

    /// Takes the areas if they were promised to this kind of waiter.
    pub(crate) fn take_promised(
        &mut self,
        waiter: Waiter,
        holder: Holder,
    ) -> Option<(Vec<FishX1Transfer>, u64)> {
        self.promised.take_if(|promised| *promised == waiter)?;
        self.take(holder)
    }

    /// Takes the areas for the cycle hook, if they are free or were promised to it.
    pub(crate) fn take_for_hook(&mut self, holder: Holder) -> Option<(Vec<FishX1Transfer>, u64)> {
        if self.promised.is_some_and(|promised| promised != Waiter::Hook) {
            return None;
        }
        self.promised = None;
        let taken = self.take(holder)?;
        self.expected[Waiter::Hook as usize] = 0;
        Some(taken)
    }

    fn take(&mut self, holder: Holder) -> Option<(Vec<FishX1Transfer>, u64)> {
        let areas = self.areas.take()?;
        self.lease += 1;
        self.holder = Some(holder);
        Some((areas, self.lease))
    }

    fn promise_if_free(&mut self) -> Option<Waiter> {
        if self.areas.is_none() || self.promised.is_some() {
            return None;
        }
        self.promise()
    }

    /// A thread begins to wait for the areas.
    pub(crate) fn wait(&mut self, waiter: Waiter) {
        self.waiting[waiter as usize] += 1;
    }

    /// A thread has waited for the areas.
    pub(crate) fn waited(&mut self, waiter: Waiter) {
        self.waiting[waiter as usize] -= 1;
    }

    /// Whether the cycle hook waits for the areas. It may change its mind; then this returns the kind to wake,
    /// as [`put_back`](Self::put_back).
    pub(crate) fn hook_waits(&mut self, waits: bool) -> Option<Waiter> {
        self.waiting[Waiter::Hook as usize] = usize::from(waits);
        if waits || self.promised != Some(Waiter::Hook) {
            return None;
        }
        self.promised = None;
        self.promise_if_free()
    }

    /// Puts the areas back; returns the kind of waiters of which one is to be woken. Areas from a holder
    /// whose lease is over are thrown away.
    pub(crate) fn put_back(&mut self, areas: Vec<FishX1Transfer>, lease: u64) -> Option<Waiter> {
        if lease != self.lease {
            return None;
        }
        self.areas = Some(areas);
        self.holder = None;
        self.promise()
    }

    /// Replaces the areas that a thread has not given back.
    pub(crate) fn replace(&mut self, areas: Vec<FishX1Transfer>) -> Option<Waiter> {
        self.lease += 1;
        self.put_back(areas, self.lease)
    }

    fn promise(&mut self) -> Option<Waiter> {
        let is_wanted = |waiter: &Waiter| {
            self.waiting[*waiter as usize] > 0 || self.expected[*waiter as usize] > 0
        };
        let first = Waiter::BY_RANK.into_iter().find(is_wanted)?;
        self.promised = Some(first).filter(|first| self.waiting[*first as usize] > 0);
        self.promised
    }

    pub(crate) fn holder(&self) -> Option<&Holder> {
        self.holder.as_ref()
    }

    /// Whether this thread has the areas.
    pub(crate) fn is_held_by(&self, thread: ThreadId) -> bool {
        self.holder.as_ref().is_some_and(|holder| holder.thread.id() == thread)
    }

    /// Whether this is still the lease of a holder.
    pub(crate) fn is_current(&self, lease: u64) -> bool {
        self.lease == lease
    }

    /// The lease of the current holder, or of the last one.
    pub(crate) fn lease(&self) -> u64 {
        self.lease
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;

    fn lock() -> AreaLock {
        AreaLock::new(vec![FishX1Transfer::default()])
    }

    #[test]
    fn no_thread_overtakes_a_waiting_one() {
        let mut lock = lock();
        let (areas, lease) = lock.try_take(Waiter::Other, Holder::now()).unwrap();
        assert!(lock.try_take(Waiter::Other, Holder::now()).is_none());
        lock.wait(Waiter::Other);
        assert_eq!(lock.put_back(areas, lease), Some(Waiter::Other));
        assert!(lock.try_take(Waiter::Other, Holder::now()).is_none(), "they are promised");
        assert!(lock.take_promised(Waiter::Reacting, Holder::now()).is_none(), "to another kind");
        assert!(lock.take_promised(Waiter::Other, Holder::now()).is_some());
        lock.waited(Waiter::Other);
        assert!(lock.take_promised(Waiter::Other, Holder::now()).is_none(), "once");
    }

    #[test]
    fn a_thread_that_answers_a_response_comes_before_one_that_just_locks() {
        let mut lock = lock();
        let (areas, lease) = lock.try_take(Waiter::Other, Holder::now()).unwrap();
        lock.wait(Waiter::Other);
        lock.wait(Waiter::Reacting);
        assert_eq!(lock.put_back(areas, lease), Some(Waiter::Reacting));
        let (areas, lease) = lock.take_promised(Waiter::Reacting, Holder::now()).unwrap();
        lock.waited(Waiter::Reacting);
        assert_eq!(lock.put_back(areas, lease), Some(Waiter::Other));
    }

    #[test]
    fn the_areas_are_kept_for_threads_that_were_told_of_a_response() {
        let mut lock = lock();
        let (areas, lease) = lock.try_take(Waiter::Other, Holder::now()).unwrap();
        lock.wait(Waiter::Other);
        lock.expect(Waiter::Reacting, 2);
        assert_eq!(lock.put_back(areas, lease), None);
        assert!(lock.try_take(Waiter::Other, Holder::now()).is_none());
        let (areas, lease) = lock.try_take(Waiter::Reacting, Holder::now()).unwrap();
        assert_eq!(lock.arrive(Waiter::Reacting), None, "it has them");
        assert_eq!(lock.put_back(areas, lease), None, "another one is still to come");
        assert_eq!(lock.arrive(Waiter::Reacting), Some(Waiter::Other), "it does not take them");
        assert!(lock.take_promised(Waiter::Other, Holder::now()).is_some());
    }

    #[test]
    fn the_areas_are_kept_no_longer_than_the_window_is_open() {
        let mut lock = lock();
        lock.expect(Waiter::Reacting, 1);
        lock.wait(Waiter::Other);
        assert_eq!(lock.expect_nobody(), Some(Waiter::Other));
    }

    #[test]
    fn the_hook_comes_first_until_its_window_is_over() {
        let mut lock = lock();
        lock.expect(Waiter::Hook, 1);
        lock.expect(Waiter::Reacting, 1);
        assert!(lock.try_take(Waiter::Other, Holder::now()).is_none());
        assert!(lock.try_take(Waiter::Reacting, Holder::now()).is_none());
        lock.wait(Waiter::Reacting);
        let (areas, lease) = lock.take_for_hook(Holder::now()).unwrap();
        assert_eq!(lock.put_back(areas, lease), Some(Waiter::Reacting));
        let (areas, lease) = lock.take_promised(Waiter::Reacting, Holder::now()).unwrap();
        lock.wait(Waiter::Reacting);
        lock.expect(Waiter::Hook, 1);
        assert_eq!(lock.put_back(areas, lease), None, "kept for the hook");
        assert_eq!(lock.expect_nobody(), Some(Waiter::Reacting));
    }

    #[test]
    fn the_hook_may_decline_the_areas_that_it_was_promised() {
        let mut lock = lock();
        let (areas, lease) = lock.try_take(Waiter::Other, Holder::now()).unwrap();
        lock.wait(Waiter::Other);
        assert_eq!(lock.hook_waits(true), None);
        assert_eq!(lock.put_back(areas, lease), Some(Waiter::Hook));
        assert_eq!(lock.hook_waits(false), Some(Waiter::Other));
        assert!(lock.take_promised(Waiter::Other, Holder::now()).is_some());
    }

    #[test]
    fn a_holder_whose_turn_is_over_puts_nothing_back() {
        let mut lock = lock();
        let (mut areas, lease) = lock.try_take(Waiter::Other, Holder::now()).unwrap();
        areas[0].output.duty[0] = 512;
        lock.replace(vec![FishX1Transfer::default()]);
        let (fresh, next) = lock.try_take(Waiter::Other, Holder::now()).unwrap();
        assert_eq!(lock.put_back(areas, lease), None);
        assert!(lock.holder().is_some(), "another one has them now");
        assert_eq!(fresh[0].output.duty[0], 0);
        lock.put_back(fresh, next);
        assert!(lock.holder().is_none());
    }
}
