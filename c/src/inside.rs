//! While a thread is inside this library, no signal handler of the program runs on it.
//!
//! A handler that calls the library would otherwise wait for a lock that its own thread has, with the motors on. So
//! each call holds signals back until it returns, and the library's threads do so at all times: they are started in
//! such calls. Only the program's callbacks run as the program does. For the same reason no thread is cancelled here.

use std::mem;
use std::process;

#[cfg(all(unix, miri))]
pub(crate) use other::is_held_by_library;
#[cfg(any(not(unix), miri))]
pub(crate) use other::{enter, prepare_to_wait, uncancelled, Programs};
#[cfg(all(unix, not(miri)))]
pub(crate) use unix::{enter, is_held_by_library, prepare_to_wait, uncancelled, Programs};

use crate::exit::ft_end_transfers;
use crate::sentences;

/// Makes a call into the program, for which this thread is not inside.
pub(crate) fn leave<R>(call: impl FnOnce() -> R) -> R {
    #[cfg(any(not(unix), miri))]
    use other::leave;
    #[cfg(all(unix, not(miri)))]
    use unix::leave;

    of_program(|| leave(call))
}

/// Makes a call into the program. When it does not return, because an exception leaves it or it ends its thread, the program
/// is aborted, all transfers first.
pub(crate) fn of_program<R>(call: impl FnOnce() -> R) -> R {
    struct End;
    impl Drop for End {
        fn drop(&mut self) {
            ft_end_transfers();
            sentences::write(
                "ft-transfer-area: an exception has left a function that the library calls, or the function has ended \
                 its thread: the program is aborted\n",
            );
            process::abort();
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
    use std::slice;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::sync::mpsc;
    use std::thread;
    use std::time::Duration;

    use libc::{c_int, sigset_t};
    use parking_lot::{Condvar, Mutex};

    /// Signals of what the thread itself does: the system ends a process that holds them back.
    const OWN: [c_int; 5] = [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGSYS];

    /// The greatest number of a signal.
    const LAST: usize = 64;

    /// How many threads of the program are inside that hold back no signal themselves.
    static TAKE_ALL: AtomicU32 = AtomicU32::new(0);
    /// For each signal, how many of the others would take it.
    static TAKE: [AtomicU32; LAST + 1] = [const { AtomicU32::new(0) }; LAST + 1];

    /// Whether a signal waits only because a thread of the program is inside. Otherwise the program holds it back.
    pub(crate) fn is_held_by_library(signal: c_int) -> bool {
        let others = usize::try_from(signal).ok().and_then(|signal| TAKE.get(signal));
        let count = |counter: &AtomicU32| counter.load(Ordering::Relaxed);
        count(&TAKE_ALL) > 0 || others.is_some_and(|others| count(others) > 0)
    }

    /// Counts a thread that comes inside or goes, and that holds back these signals itself.
    fn count(before: &sigset_t, change: impl Fn(&AtomicU32)) {
        if is_empty(before) {
            return change(&TAKE_ALL);
        }
        for (counter, signal) in TAKE.iter().zip(0..).skip(1) {
            // SAFETY: the set is there.
            if unsafe { libc::sigismember(before, signal) } == 0 {
                change(counter);
            }
        }
    }

    fn is_empty(set: &sigset_t) -> bool {
        let bytes = ptr::from_ref(set).cast::<u8>();
        // SAFETY: a set is integers, of which each byte is there.
        unsafe { slice::from_raw_parts(bytes, size_of::<sigset_t>()) }.iter().all(|byte| *byte == 0)
    }

    /// A thread that is inside.
    #[derive(Clone, Copy)]
    struct Held {
        /// What the program holds back itself.
        before: sigset_t,
        /// Whether it is one of the library's own, which takes no signals.
        is_librarys: bool,
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
        hold(false);
        Some(Inside(()))
    }

    fn hold(is_librarys: bool) {
        // SAFETY: sets, for which all bits 0 are valid.
        let (mut all, mut before): (sigset_t, sigset_t) = unsafe { (zeroed(), zeroed()) };
        // SAFETY: the sets are this function's, and the signals are there.
        unsafe {
            libc::sigfillset(&raw mut all);
            OWN.iter().for_each(|signal| _ = libc::sigdelset(&raw mut all, *signal));
            libc::pthread_sigmask(libc::SIG_SETMASK, &raw const all, &raw mut before);
        }
        if !is_librarys {
            count(&before, |counter| _ = counter.fetch_add(1, Ordering::Relaxed));
        }
        HELD.set(Some(Held { before, is_librarys }));
    }

    impl Drop for Inside {
        fn drop(&mut self) {
            if let Some(held) = HELD.take() {
                if !held.is_librarys {
                    count(&held.before, |counter| _ = counter.fetch_sub(1, Ordering::Relaxed));
                }
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
                // It was inside before.
                hold(self.is_librarys);
            }
        }
        let Some(held) = HELD.get() else { return call() };
        drop(Inside(()));
        let _again = Again { is_librarys: held.is_librarys };
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
            HELD.set(self.0.map(|before| Held { before, is_librarys: true }));
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
