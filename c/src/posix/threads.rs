//! Threads of the program.

use std::ffi::{c_uint, c_void};
use std::ptr;
use std::sync::atomic::{AtomicU32, Ordering};

use super::objects::{add, change, close, free_locks, Handle, Object};
use crate::calling;
use crate::ffi::caught;
use crate::inside;

/// What `_beginthread` answers when there can be no thread.
const NO_THREAD: usize = usize::MAX;

thread_local! {
    static ID: u32 = {
        static LAST: AtomicU32 = AtomicU32::new(0);
        LAST.fetch_add(1, Ordering::Relaxed) + 1
    };
}

/// An argument that the program gives to its thread.
struct Argument(*mut c_void);

// SAFETY: this library does nothing with it but pass it on.
unsafe impl Send for Argument {}

impl Argument {
    fn get(self) -> *mut c_void {
        self.0
    }
}

/// Runs a function of the program in a thread. A handle that no one waits for closes with the thread.
fn start(
    run: impl FnOnce(*mut c_void) -> u32 + Send + 'static,
    argument: *mut c_void,
    stack: usize,
    stays: bool,
) -> Option<(Handle, u32)> {
    let handle = add(Object::Thread { code: None });
    let number = handle.addr();
    let argument = Argument(argument);
    let (tell, reported) = std::sync::mpsc::channel();
    let body = move || {
        let _stack = crate::exit::Stack::give();
        let _ = tell.send(GetCurrentThreadId());
        let code = inside::of_program(|| run(argument.get()));
        free_locks();
        let handle = ptr::without_provenance_mut(number);
        change(handle, |object| {
            let Object::Thread { code: its } = object else { return None };
            *its = Some(code);
            Some(())
        });
        if !stays {
            close(handle);
        }
    };
    let made = calling::spawn("program", stack, body).ok();
    let id = made.and_then(|_| reported.recv().ok());
    if id.is_none() {
        close(handle);
    }
    id.map(|id| (handle, id))
}

/// # Safety
///
/// `to` is null or points to an integer that this call alone uses.
unsafe fn give(to: *mut u32, id: u32) {
    if !to.is_null() {
        // SAFETY: as the caller promises.
        unsafe { *to = id };
    }
}

/// Begins a thread. It begins at once, whatever the flags say.
///
/// # Safety
///
/// `id` is null or points to an integer that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn CreateThread(
    _security: *mut c_void,
    stack: usize,
    start_at: Option<extern "system-unwind" fn(*mut c_void) -> u32>,
    argument: *mut c_void,
    _flags: u32,
    id: *mut u32,
) -> Handle {
    caught(ptr::null_mut(), || {
        let made =
            start_at.and_then(|run| start(move |argument| run(argument), argument, stack, true));
        let Some((handle, its_id)) = made else { return ptr::null_mut() };
        // SAFETY: as the caller promises.
        unsafe { give(id, its_id) };
        handle
    })
}

/// Begins a thread whose handle closes by itself.
#[no_mangle]
pub extern "C" fn _beginthread(
    start_at: Option<extern "C-unwind" fn(*mut c_void)>,
    stack: c_uint,
    argument: *mut c_void,
) -> usize {
    caught(NO_THREAD, || {
        let run = |run: extern "C-unwind" fn(*mut c_void)| {
            start(
                move |argument| {
                    run(argument);
                    0
                },
                argument,
                stack as usize,
                false,
            )
        };
        start_at.and_then(run).map_or(NO_THREAD, |(handle, _)| handle.addr())
    })
}

/// Begins a thread, as [`CreateThread`] does.
///
/// # Safety
///
/// As for [`CreateThread`].
#[no_mangle]
pub unsafe extern "C" fn _beginthreadex(
    security: *mut c_void,
    stack: c_uint,
    start_at: Option<extern "system-unwind" fn(*mut c_void) -> u32>,
    argument: *mut c_void,
    flags: c_uint,
    id: *mut c_uint,
) -> usize {
    // SAFETY: as the caller promises.
    unsafe { CreateThread(security, stack as usize, start_at, argument, flags, id) }.addr()
}

/// A number that no other thread has.
#[no_mangle]
pub extern "C" fn GetCurrentThreadId() -> u32 {
    caught(0, || ID.try_with(|id| *id).unwrap_or(0))
}
