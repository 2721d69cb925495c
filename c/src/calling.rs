//! Threads in which the program is called.

#[cfg(any(not(unix), miri))]
pub(crate) use others::{spawn, Thread};
#[cfg(all(unix, not(miri)))]
pub(crate) use unix::{spawn, Thread};

/// An exception that nobody catches ends the program where it is thrown, as in a thread of the C library: nothing in these
/// threads would catch it. A thread of Rust's standard library would, and first all values of the program's functions would
/// be dropped, which may wait with the motors on.
#[cfg(all(unix, not(miri)))]
mod unix {
    use std::ffi::c_void;
    use std::io;
    use std::mem;
    use std::ptr;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::Arc;

    use crate::inside;

    type Body = Box<dyn FnOnce() + Send>;

    /// That of other threads of Rust, whatever the system gives by default.
    const STACK: usize = 2 << 20;
    /// What a program may ask for at most: nobody has more in mind.
    const MOST_STACK: usize = 1 << 30;

    /// A thread. Without this it goes on alone.
    pub(crate) struct Thread {
        /// Until it is waited for.
        thread: Option<libc::pthread_t>,
        has_ended: Arc<AtomicBool>,
    }

    /// Starts one with this name, of up to 15 bytes, and at least so many bytes for its stack.
    pub(crate) fn spawn(
        name: &'static str,
        stack: usize,
        body: impl FnOnce() + Send + 'static,
    ) -> io::Result<Thread> {
        type Begin = extern "C-unwind" fn(*mut c_void) -> *mut c_void;
        type BeginOfC = extern "C" fn(*mut c_void) -> *mut c_void;

        let has_ended = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&has_ended);
        let body: Body = Box::new(move || {
            call_this_thread(name);
            // To its end: it would be taken out of the middle of Rust code, which ends the process.
            mem::forget(inside::uncancelled());
            body();
            ends.store(true, Ordering::Release);
        });
        let body = Box::into_raw(Box::new(body));
        // In whole pages, which some systems want.
        let stack = stack.clamp(STACK, MOST_STACK).next_multiple_of(64 << 10);
        // SAFETY: both are called in the same way.
        let begin = unsafe { mem::transmute::<Begin, BeginOfC>(begin) };
        let mut thread = libc::pthread_t::default();
        // SAFETY: integers and pointers, for which all bits 0 are valid.
        let mut attributes: libc::pthread_attr_t = unsafe { mem::zeroed() };
        // SAFETY: the places are this function's, and the thread takes the body.
        let error = unsafe {
            libc::pthread_attr_init(&raw mut attributes);
            libc::pthread_attr_setstacksize(&raw mut attributes, stack);
            let error =
                libc::pthread_create(&raw mut thread, &raw const attributes, begin, body.cast());
            libc::pthread_attr_destroy(&raw mut attributes);
            error
        };
        if error != 0 {
            // SAFETY: there is no thread that takes it.
            drop(unsafe { Box::from_raw(body) });
            return Err(io::Error::from_raw_os_error(error));
        }
        Ok(Thread { thread: Some(thread), has_ended })
    }

    extern "C-unwind" fn begin(body: *mut c_void) -> *mut c_void {
        // SAFETY: it was made for this thread alone.
        let body = unsafe { Box::from_raw(body.cast::<Body>()) };
        body();
        ptr::null_mut()
    }

    /// By its name a thread is known as one of this library.
    fn call_this_thread(name: &str) {
        #[cfg(target_os = "linux")]
        if let Ok(name) = std::ffi::CString::new(name) {
            // SAFETY: the name ends with 0.
            unsafe { libc::prctl(libc::PR_SET_NAME, name.as_ptr()) };
        }
        #[cfg(not(target_os = "linux"))]
        let _ = name;
    }

    impl Thread {
        /// Whether it is this one.
        pub(crate) fn is_this(&self) -> bool {
            // SAFETY: calls without pointers.
            self.thread
                .is_some_and(|it| unsafe { libc::pthread_equal(it, libc::pthread_self()) } != 0)
        }

        /// Whether it has nothing more to do.
        pub(crate) fn is_finished(&self) -> bool {
            self.has_ended.load(Ordering::Acquire)
        }

        /// Waits for its end.
        pub(crate) fn join(mut self) {
            if let Some(thread) = self.thread.take() {
                // SAFETY: it was not waited for.
                unsafe { libc::pthread_join(thread, ptr::null_mut()) };
            }
        }
    }

    impl Drop for Thread {
        fn drop(&mut self) {
            if let Some(thread) = self.thread.take() {
                // SAFETY: it was not waited for.
                unsafe { libc::pthread_detach(thread) };
            }
        }
    }
}

/// Other systems have no such threads, nor has Miri.
#[cfg(any(not(unix), miri))]
mod others {
    use std::io;
    use std::thread::{Builder, JoinHandle};

    pub(crate) struct Thread(JoinHandle<()>);

    pub(crate) fn spawn(
        name: &'static str,
        _stack: usize,
        body: impl FnOnce() + Send + 'static,
    ) -> io::Result<Thread> {
        Builder::new().name(name.into()).spawn(body).map(Thread)
    }

    impl Thread {
        pub(crate) fn is_this(&self) -> bool {
            self.0.thread().id() == std::thread::current().id()
        }

        pub(crate) fn is_finished(&self) -> bool {
            self.0.is_finished()
        }

        pub(crate) fn join(self) {
            if self.0.join().is_err() {
                log::error!("a thread for calls of the program panicked");
            }
        }
    }
}
