//! While a thread is inside this library, no signal handler of the program runs on it.
//!
//! A handler that calls the library would otherwise wait for a lock that its own thread has, with the motors on. So
//! each call holds signals back until it returns, and the library's threads do so at all times: they are started in
//! such calls. Only the program's callbacks run as the program does.

#[cfg(any(not(unix), miri))]
pub(crate) use other::{enter, leave, Programs};
#[cfg(all(unix, not(miri)))]
pub(crate) use unix::{enter, leave, Programs};

#[cfg(all(unix, not(miri)))]
mod unix {
    use std::cell::Cell;
    use std::mem::zeroed;
    use std::ptr;

    use libc::{c_int, sigset_t};

    /// Signals of what the thread itself does: the system ends a process that holds them back.
    const OWN: [c_int; 7] = [
        libc::SIGSEGV,
        libc::SIGBUS,
        libc::SIGFPE,
        libc::SIGILL,
        libc::SIGTRAP,
        libc::SIGABRT,
        libc::SIGSYS,
    ];

    thread_local! {
        /// What the program holds back itself, while this thread is inside. Needs no allocation.
        static BEFORE: Cell<Option<sigset_t>> = const { Cell::new(None) };
    }

    /// Until this is dropped, the thread is inside.
    pub(crate) struct Inside(());

    /// `None` when it is inside already.
    pub(crate) fn enter() -> Option<Inside> {
        if BEFORE.get().is_some() {
            return None;
        }
        // SAFETY: sets, for which all bits 0 are valid.
        let (mut all, mut before): (sigset_t, sigset_t) = unsafe { (zeroed(), zeroed()) };
        // SAFETY: the sets are this function's, and the signals are there.
        unsafe {
            libc::sigfillset(&raw mut all);
            OWN.iter().for_each(|signal| _ = libc::sigdelset(&raw mut all, *signal));
            libc::pthread_sigmask(libc::SIG_SETMASK, &raw const all, &raw mut before);
        }
        BEFORE.set(Some(before));
        Some(Inside(()))
    }

    impl Drop for Inside {
        fn drop(&mut self) {
            if let Some(before) = BEFORE.take() {
                // SAFETY: the set is one that this thread had.
                unsafe {
                    libc::pthread_sigmask(libc::SIG_SETMASK, &raw const before, ptr::null_mut());
                }
            }
        }
    }

    /// Makes a call into the program, for which this thread is not inside.
    pub(crate) fn leave<R>(call: impl FnOnce() -> R) -> R {
        struct Again;
        impl Drop for Again {
            fn drop(&mut self) {
                // It was inside before.
                std::mem::forget(enter());
            }
        }
        if BEFORE.get().is_none() {
            return call();
        }
        drop(Inside(()));
        let _again = Again;
        call()
    }

    /// What the program holds back itself, for a thread of this library that calls it back.
    pub(crate) struct Programs(Option<sigset_t>);

    impl Programs {
        /// In a call from the program.
        pub(crate) fn of_this_thread() -> Self {
            Self(BEFORE.get())
        }

        /// This thread of the library is inside from its start on.
        pub(crate) fn begin(self) {
            BEFORE.set(self.0);
        }
    }
}

/// Other systems call handlers in threads of their own, and Miri has no signals.
#[cfg(any(not(unix), miri))]
mod other {
    pub(crate) fn enter() -> Option<()> {
        None
    }

    pub(crate) fn leave<R>(call: impl FnOnce() -> R) -> R {
        call()
    }

    pub(crate) struct Programs;

    impl Programs {
        pub(crate) fn of_this_thread() -> Self {
            Self
        }

        pub(crate) fn begin(self) {}
    }
}
