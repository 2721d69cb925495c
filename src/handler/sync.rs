//! The locks of this module: those of `parking_lot`, or under a model checker its own.

use std::time::{Duration, Instant};

#[cfg(not(all(test, shuttle)))]
pub(super) use self::real::{thread_id, Condvar, Mutex, MutexGuard, ThreadId};

#[cfg(all(test, shuttle))]
pub(super) use self::model::{thread_id, Condvar, Mutex, MutexGuard, ThreadId};

/// Waits for news, for ever without a deadline; tells whether the deadline came first.
pub(super) fn wait_until<T>(
    news: &Condvar,
    guard: &mut MutexGuard<'_, T>,
    deadline: Option<Instant>,
) -> bool {
    match deadline {
        Some(deadline) => news.wait_until(guard, deadline).timed_out(),
        None => {
            news.wait(guard);
            false
        }
    }
}

/// Does the same as [`wait_until`], and keeps to the millisecond where that does not.
///
/// On Windows a wait with a limit ends with a tick of the system's clock, of which there are 64 a second
/// unless a program asks for more; that would miss the controller's pace of 10 ms. Sleeping has a finer
/// timer there, so the wait is a row of short sleeps.
pub(super) fn wait_window<T>(
    news: &Condvar,
    guard: &mut MutexGuard<'_, T>,
    deadline: Option<Instant>,
) -> bool {
    match deadline {
        Some(deadline) if cfg!(windows) => sleep_towards(guard, deadline),
        deadline => wait_until(news, guard, deadline),
    }
}

/// The longest that news may go unnoticed in [`sleep_towards`].
const SLICE: Duration = Duration::from_micros(500);

/// Sleeps unlocked for a slice of the time until the deadline; tells whether that has come.
fn sleep_towards<T>(guard: &mut MutexGuard<'_, T>, deadline: Instant) -> bool {
    let rest = deadline.saturating_duration_since(Instant::now());
    if rest.is_zero() {
        return true;
    }
    MutexGuard::unlocked(guard, || std::thread::sleep(rest.min(SLICE)));
    false
}

/// The earlier of two deadlines, of which each may be missing.
pub(super) fn earlier(one: Option<Instant>, other: Option<Instant>) -> Option<Instant> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

#[cfg(not(all(test, shuttle)))]
mod real {
    pub(crate) use parking_lot::{Condvar, Mutex, MutexGuard};
    pub(crate) use std::thread::ThreadId;

    /// Which thread this is. Asking the standard library each time would count a reference.
    pub(crate) fn thread_id() -> ThreadId {
        thread_local! {
            static ID: ThreadId = std::thread::current().id();
        }
        ID.with(|id| *id)
    }
}

/// The same calls on the locks of `shuttle`, which tries many orders of threads.
#[cfg(all(test, shuttle))]
mod model {
    use std::ops::{Deref, DerefMut};
    use std::time::Instant;

    use shuttle::rand::Rng;
    use shuttle::sync;

    pub(crate) use shuttle::thread::ThreadId;

    pub(crate) fn thread_id() -> ThreadId {
        shuttle::thread::current().id()
    }

    #[derive(Debug, Default)]
    pub(crate) struct Mutex<T>(sync::Mutex<T>);

    pub(crate) struct MutexGuard<'a, T> {
        mutex: &'a sync::Mutex<T>,
        /// `None` only while a condition variable has it.
        guard: Option<sync::MutexGuard<'a, T>>,
    }

    impl<T> Mutex<T> {
        pub(crate) fn new(value: T) -> Self {
            Self(sync::Mutex::new(value))
        }

        pub(crate) fn lock(&self) -> MutexGuard<'_, T> {
            let guard = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            MutexGuard { mutex: &self.0, guard: Some(guard) }
        }
    }

    impl<T> MutexGuard<'_, T> {
        pub(crate) fn unlock_fair(guard: Self) {
            drop(guard);
        }

        pub(crate) fn unlocked<R>(guard: &mut Self, f: impl FnOnce() -> R) -> R {
            guard.guard = None;
            let result = f();
            let locked = guard.mutex.lock();
            guard.guard = Some(locked.unwrap_or_else(std::sync::PoisonError::into_inner));
            result
        }
    }

    impl<T> Deref for MutexGuard<'_, T> {
        type Target = T;

        fn deref(&self) -> &T {
            self.guard.as_deref().expect("a guard that is in use is locked")
        }
    }

    impl<T> DerefMut for MutexGuard<'_, T> {
        fn deref_mut(&mut self) -> &mut T {
            self.guard.as_deref_mut().expect("a guard that is in use is locked")
        }
    }

    #[derive(Debug, Default)]
    pub(crate) struct Condvar(sync::Condvar);

    pub(crate) struct TimedOut(bool);

    impl TimedOut {
        pub(crate) fn timed_out(&self) -> bool {
            self.0
        }
    }

    impl Condvar {
        pub(crate) fn new() -> Self {
            Self::default()
        }

        pub(crate) fn wait<T>(&self, guard: &mut MutexGuard<'_, T>) {
            let locked = guard.guard.take().expect("a guard that is in use is locked");
            let locked = self.0.wait(locked);
            guard.guard = Some(locked.unwrap_or_else(std::sync::PoisonError::into_inner));
        }

        /// There is no clock: whether the deadline has come is drawn by lot. Others may run first.
        pub(crate) fn wait_until<T>(
            &self,
            guard: &mut MutexGuard<'_, T>,
            _deadline: Instant,
        ) -> TimedOut {
            MutexGuard::unlocked(guard, shuttle::thread::yield_now);
            TimedOut(shuttle::rand::thread_rng().gen_bool(0.5))
        }

        pub(crate) fn notify_one(&self) {
            self.0.notify_one();
        }

        pub(crate) fn notify_all(&self) {
            self.0.notify_all();
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_short_sleeps_ends_at_the_deadline_and_lets_others_in_between() {
        let mutex = Mutex::new(0);
        let deadline = Instant::now() + Duration::from_millis(20);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while Instant::now() < deadline {
                    *mutex.lock() += 1;
                    std::thread::yield_now();
                }
            });
            let mut guard = mutex.lock();
            let mut seen = vec![*guard];
            while !sleep_towards(&mut guard, deadline) {
                seen.push(*guard);
            }
            assert!(Instant::now() >= deadline);
            assert!(seen.len() > 2, "a slice is much shorter than the wait");
            assert!(seen.first() < seen.last(), "nobody else had the lock");
        });
    }
}
