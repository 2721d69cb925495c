//! While a thread is inside this library, no signal handler of the program runs on it.
//!
//! A handler that calls the library would otherwise wait for a lock that its own thread has, with the motors on. So
//! each call holds signals back until it returns, and the library's threads do so at all times: they are started in
//! such calls. Only the program's callbacks run as the program does. For the same reason no thread is cancelled here.

use std::mem;

#[cfg(all(unix, miri))]
pub(crate) use other::is_held_by_library;
#[cfg(any(not(unix), miri))]
pub(crate) use other::{enter, prepare_to_wait, uncancelled, Programs};
#[cfg(all(unix, not(miri)))]
pub(crate) use unix::{enter, is_held_by_library, prepare_to_wait, uncancelled, Programs};

use crate::exit::ft_end_transfers;

/// Makes a call into the program, for which this thread is not inside.
pub(crate) fn leave<R>(call: impl FnOnce() -> R) -> R {
    #[cfg(any(not(unix), miri))]
    use other::leave;
    #[cfg(all(unix, not(miri)))]
    use unix::leave;

    of_program(|| leave(call))
}

/// Makes a call into the program. An exception that leaves it ends all transfers, before Rust's runtime writes that it
/// can't catch it: perhaps nobody reads that.
pub(crate) fn of_program<R>(call: impl FnOnce() -> R) -> R {
    struct End;
    impl Drop for End {
        fn drop(&mut self) {
            ft_end_transfers();
        }
    }
    let end = End;
    let result = call();
    mem::forget(end);
    result
}

#[cfg(all(unix, not(miri)))]
mod unix {
    use std::cell::Cell;
    use std::mem::zeroed;
    use std::ptr;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::sync::mpsc;
    use std::thread;
    use std::time::Duration;

    use libc::{c_int, sigset_t};
    use parking_lot::{Condvar, Mutex};

    /// Signals of what the thread itself does: the system ends a process that holds them back.
    const OWN: [c_int; 5] = [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGSYS];

    /// The signals that ask a program to end, which may wait for longer than a moment.
    const ENDS: [c_int; 4] = [libc::SIGINT, libc::SIGTERM, libc::SIGHUP, libc::SIGQUIT];

    /// For each of `ENDS`, in 16 bits: how many threads of the program would take it, but are inside.
    static WAITING: AtomicU64 = AtomicU64::new(0);

    /// Whether a signal waits only because a thread of the program is inside. Otherwise the program holds it back.
    pub(crate) fn is_held_by_library(signal: c_int) -> bool {
        let index = ENDS.iter().position(|end| *end == signal);
        index.is_some_and(|index| WAITING.load(Ordering::Relaxed) >> (16 * index) & 0xFFFF != 0)
    }

    /// What counts a thread in `WAITING`, with what the program holds back itself.
    fn count_of(before: &sigset_t) -> u64 {
        // SAFETY: the set is there, and so are the signals.
        let takes = |signal| unsafe { libc::sigismember(before, signal) == 0 };
        let bits = ENDS.iter().enumerate().filter(|(_, signal)| takes(**signal));
        bits.map(|(index, _)| 1 << (16 * index)).sum()
    }

    /// A thread that is inside.
    #[derive(Clone, Copy)]
    struct Held {
        /// What the program holds back itself.
        before: sigset_t,
        /// What the thread has added to `WAITING`.
        count: u64,
    }

    thread_local! {
        /// While this thread is inside. Needs no allocation.
        static HELD: Cell<Option<Held>> = const { Cell::new(None) };
        /// Whether this thread can wait without memory of the C library.
        static IS_PREPARED: Cell<bool> = const { Cell::new(false) };
    }

    /// Until this is dropped, the thread is inside.
    pub(crate) struct Inside(());

    /// `None` when it is inside already.
    pub(crate) fn enter() -> Option<Inside> {
        if HELD.get().is_some() {
            return None;
        }
        hold(count_of);
        Some(Inside(()))
    }

    fn hold(count: impl FnOnce(&sigset_t) -> u64) {
        // SAFETY: sets, for which all bits 0 are valid.
        let (mut all, mut before): (sigset_t, sigset_t) = unsafe { (zeroed(), zeroed()) };
        // SAFETY: the sets are this function's, and the signals are there.
        unsafe {
            libc::sigfillset(&raw mut all);
            OWN.iter().for_each(|signal| _ = libc::sigdelset(&raw mut all, *signal));
            libc::pthread_sigmask(libc::SIG_SETMASK, &raw const all, &raw mut before);
        }
        let count = count(&before);
        WAITING.fetch_add(count, Ordering::Relaxed);
        HELD.set(Some(Held { before, count }));
    }

    impl Drop for Inside {
        fn drop(&mut self) {
            if let Some(held) = HELD.take() {
                WAITING.fetch_sub(held.count, Ordering::Relaxed);
                // SAFETY: the set is one that this thread had.
                unsafe {
                    let before = &raw const held.before;
                    libc::pthread_sigmask(libc::SIG_SETMASK, before, ptr::null_mut());
                }
            }
        }
    }

    pub(super) fn leave<R>(call: impl FnOnce() -> R) -> R {
        struct Again {
            is_librarys: bool,
        }
        impl Drop for Again {
            fn drop(&mut self) {
                // It was inside before. A thread of the library takes no signals.
                let is_librarys = self.is_librarys;
                hold(|before| if is_librarys { 0 } else { count_of(before) });
            }
        }
        let Some(held) = HELD.get() else { return call() };
        drop(Inside(()));
        let _again = Again { is_librarys: held.count == 0 };
        call()
    }

    /// Lets this thread wait once in each way in which it may wait in a signal handler. The first time registers values
    /// of the thread, with memory of the C library: a handler that has interrupted `malloc` would hang there.
    pub(crate) fn prepare_to_wait() {
        if IS_PREPARED.replace(true) {
            return;
        }
        let _ = thread::current();
        let _ = Condvar::new().wait_for(&mut Mutex::new(()).lock(), Duration::ZERO);
        let (_sender, receiver) = mpsc::sync_channel::<()>(0);
        let _ = receiver.recv_timeout(Duration::ZERO);
    }

    extern "C" {
        fn pthread_setcancelstate(state: c_int, before: *mut c_int) -> c_int;
    }

    /// Until this is dropped, `pthread_cancel` waits: it would take the thread out of the middle of Rust code, which ends
    /// the process.
    pub(crate) struct Uncancelled(c_int);

    pub(crate) fn uncancelled() -> Uncancelled {
        // PTHREAD_CANCEL_DISABLE
        const NOT: c_int = if cfg!(target_vendor = "apple") { 0 } else { 1 };
        let mut before = NOT;
        // SAFETY: the place is this function's.
        unsafe { pthread_setcancelstate(NOT, &raw mut before) };
        Uncancelled(before)
    }

    impl Drop for Uncancelled {
        fn drop(&mut self) {
            // SAFETY: the state is one that this thread had.
            unsafe { pthread_setcancelstate(self.0, ptr::null_mut()) };
        }
    }

    /// What the program holds back itself, for a thread of this library that calls it back.
    pub(crate) struct Programs(Option<sigset_t>);

    impl Programs {
        /// In a call from the program.
        pub(crate) fn of_this_thread() -> Self {
            Self(HELD.get().map(|held| held.before))
        }

        /// This thread of the library is inside from its start on.
        pub(crate) fn begin(self) {
            HELD.set(self.0.map(|before| Held { before, count: 0 }));
        }
    }
}

/// Other systems call handlers in threads of their own, and Miri has no signals.
#[cfg(any(not(unix), miri))]
mod other {
    pub(crate) fn enter() -> Option<()> {
        None
    }

    pub(super) fn leave<R>(call: impl FnOnce() -> R) -> R {
        call()
    }

    pub(crate) fn prepare_to_wait() {}

    pub(crate) fn uncancelled() -> Option<()> {
        None
    }

    #[cfg(unix)]
    pub(crate) fn is_held_by_library(_: i32) -> bool {
        false
    }

    pub(crate) struct Programs;

    impl Programs {
        pub(crate) fn of_this_thread() -> Self {
            Self
        }

        pub(crate) fn begin(self) {}
    }
}
