//! The locks, threads and time of this module: those of `parking_lot` and the system, or the model checker's own in
//! its tests.

use std::time::Instant;

#[cfg(not(all(test, shuttle)))]
pub(crate) use self::real::{
    current_thread, lock_soon, now, spawn, thread_id, Condvar, JoinHandle, Mutex, MutexGuard,
    Thread, ThreadId,
};

#[cfg(all(test, shuttle))]
pub(crate) use self::model::{
    current_thread, lock_soon, now, pass, spawn, thread_id, Condvar, JoinHandle, Mutex, MutexGuard,
    Thread, ThreadId,
};

/// Waits for a change, forever without a deadline; returns whether the deadline came first.
pub(crate) fn wait_until<T>(
    changed: &Condvar,
    guard: &mut MutexGuard<'_, T>,
    deadline: Option<Instant>,
) -> bool {
    match deadline {
        Some(deadline) => changed.wait_until(guard, deadline).timed_out(),
        None => {
            changed.wait(guard);
            false
        }
    }
}

/// Does the same as [`wait_until`], but ends on time even on a system with a coarse clock. May end
/// without a change, too.
pub(crate) fn wait_on_time<T>(
    changed: &Condvar,
    guard: &mut MutexGuard<'_, T>,
    deadline: Option<Instant>,
) -> bool {
    match deadline {
        #[cfg(not(all(test, shuttle)))]
        Some(deadline) => crate::pause::Timing::OF_SYSTEM.wait_until(changed, guard, deadline),
        deadline => wait_until(changed, guard, deadline),
    }
}

/// Distinguishes a panic that began after this was made from an earlier one, as when a destructor uses
/// the area while its thread unwinds.
#[derive(Debug)]
pub(crate) struct PanicCheck {
    before: bool,
}

impl PanicCheck {
    pub(crate) fn new() -> Self {
        Self { before: std::thread::panicking() }
    }

    pub(crate) fn has_begun(&self) -> bool {
        !self.before && std::thread::panicking()
    }
}

/// The earlier of two deadlines; each may be missing.
pub(crate) fn earlier(one: Option<Instant>, other: Option<Instant>) -> Option<Instant> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

#[cfg(not(all(test, shuttle)))]
mod real {
    use std::io;
    use std::time::Instant;

    pub(crate) use parking_lot::{Condvar, Mutex, MutexGuard};
    pub(crate) use std::thread::{current as current_thread, JoinHandle, Thread, ThreadId};

    pub(crate) fn now() -> Instant {
        Instant::now()
    }

    /// Starts a thread with a name.
    pub(crate) fn spawn(
        name: &str,
        work: impl FnOnce() + Send + 'static,
    ) -> io::Result<JoinHandle<()>> {
        std::thread::Builder::new().name(name.to_owned()).spawn(work)
    }

    /// How often a lock that is held only for moments is tried: for about 10 µs.
    const TRIES: usize = 1000;

    /// Locks, and spins longer than usual before it yields its core: if other threads use their cores fully, a
    /// thread that yields may get its core back milliseconds later.
    pub(crate) fn lock_soon<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
        for _ in 0..TRIES {
            if let Some(guard) = mutex.try_lock() {
                return guard;
            }
            std::hint::spin_loop();
        }
        mutex.lock()
    }

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
    use std::cell::Cell;
    use std::io;
    use std::ops::{Deref, DerefMut};
    use std::time::{Duration, Instant};

    use shuttle::rand::Rng;
    use shuttle::sync;

    pub(crate) use shuttle::thread::{current as current_thread, JoinHandle, Thread, ThreadId};

    /// A deadline that is so far away never comes: a thread that waits for so long has to be woken.
    const FAR: Duration = Duration::from_millis(500);

    thread_local! {
        /// All threads of a model are one thread of the system.
        static NOW: Cell<Instant> = Cell::new(Instant::now());
    }

    /// The time, which moves only by [`pass`] and by deadlines.
    pub(crate) fn now() -> Instant {
        NOW.get()
    }

    /// Time goes by.
    pub(crate) fn pass(time: Duration) {
        NOW.set(NOW.get() + time);
    }

    pub(crate) fn spawn(
        name: &str,
        work: impl FnOnce() + Send + 'static,
    ) -> io::Result<JoinHandle<()>> {
        shuttle::thread::Builder::new().name(name.to_owned()).spawn(work)
    }

    pub(crate) fn thread_id() -> ThreadId {
        shuttle::thread::current().id()
    }

    pub(crate) fn lock_soon<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
        mutex.lock()
    }

    fn let_others_run<T>(guard: &mut MutexGuard<'_, T>) {
        MutexGuard::unlocked(guard, shuttle::thread::yield_now);
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

        pub(crate) fn unlocked(guard: &mut Self, work: impl FnOnce()) {
            guard.guard = None;
            work();
            let locked = guard.mutex.lock();
            guard.guard = Some(locked.unwrap_or_else(std::sync::PoisonError::into_inner));
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

        /// Whether the deadline comes now is random. Other threads may run first.
        pub(crate) fn wait_until<T>(
            &self,
            guard: &mut MutexGuard<'_, T>,
            deadline: Instant,
        ) -> TimedOut {
            if deadline.saturating_duration_since(now()) >= FAR {
                self.wait(guard);
                return TimedOut(false);
            }
            let_others_run(guard);
            let comes = shuttle::rand::thread_rng().gen_bool(0.5);
            if comes {
                NOW.set(now().max(deadline));
            }
            TimedOut(comes)
        }

        pub(crate) fn notify_one(&self) {
            self.0.notify_one();
        }

        pub(crate) fn notify_all(&self) {
            self.0.notify_all();
        }
    }
}
