//! Events, locks and threads, and waiting for them.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::ffi::{c_char, c_void};
use std::mem;
use std::ptr;
use std::sync::LazyLock;
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

use crate::ffi::caught;

pub(super) type Handle = *mut c_void;

const TRUE: i32 = 1;
const FALSE: i32 = 0;
const INFINITE: u32 = u32::MAX;
const WAIT_OBJECT_0: u32 = 0;
const WAIT_ABANDONED_0: u32 = 0x80;
const WAIT_TIMEOUT: u32 = 258;
const WAIT_FAILED: u32 = u32::MAX;
/// No wait is for more.
const MOST_OBJECTS: usize = 64;
const STILL_ACTIVE: u32 = 259;

/// What a handle leads to.
pub(super) enum Object {
    Event {
        manual: bool,
        set: bool,
    },
    /// It is abandoned when the thread has ended that had it last.
    Mutex {
        owner: Option<ThreadId>,
        times: u32,
        abandoned: bool,
    },
    Semaphore {
        count: i32,
        most: i32,
    },
    Thread {
        code: Option<u32>,
    },
}

impl Object {
    fn is_ready(&self) -> bool {
        match self {
            Self::Event { set, .. } => *set,
            Self::Mutex { owner, .. } => owner.is_none_or(|owner| owner == thread::current().id()),
            Self::Semaphore { count, .. } => *count > 0,
            Self::Thread { code } => code.is_some(),
        }
    }

    /// What a wait for this handle does that has ended. Returns whether it was for an abandoned lock.
    fn take(&mut self, handle: usize) -> bool {
        match self {
            Self::Event { manual, set } => *set = *manual,
            Self::Mutex { owner, times, abandoned } => {
                *owner = Some(thread::current().id());
                *times += 1;
                hold(|held| _ = held.insert(handle));
                return mem::take(abandoned);
            }
            Self::Semaphore { count, .. } => *count -= 1,
            Self::Thread { .. } => {}
        }
        false
    }
}

/// The locks of a thread. When it ends they are free: others wait for them with motors on.
struct Held {
    thread: ThreadId,
    locks: RefCell<HashSet<usize>>,
}

thread_local! {
    static HELD: Held = Held { thread: thread::current().id(), locks: RefCell::default() };
}

/// Changes what is known of this thread's locks, unless it is at its end.
fn hold(change: impl FnOnce(&mut HashSet<usize>)) {
    let _ = HELD.try_with(|held| change(&mut held.locks.borrow_mut()));
}

/// Frees what this thread has.
pub(super) fn free_locks() {
    HELD.with(Held::free_all);
}

impl Drop for Held {
    fn drop(&mut self) {
        self.free_all();
    }
}

impl Held {
    fn free_all(&self) {
        let locks = self.locks.take();
        if locks.is_empty() {
            return;
        }
        let mut objects = OBJECTS.lock();
        for lock in locks {
            let Some(Object::Mutex { owner, times, abandoned }) = objects.all.get_mut(&lock) else {
                continue;
            };
            if *owner == Some(self.thread) {
                (*owner, *times, *abandoned) = (None, 0, true);
            }
        }
        CHANGED.notify_all();
    }
}

#[derive(Default)]
struct Objects {
    all: HashMap<usize, Object>,
    made: usize,
}

static OBJECTS: LazyLock<Mutex<Objects>> = LazyLock::new(Mutex::default);
/// Something has become ready or is closed.
static CHANGED: Condvar = Condvar::new();

/// Makes a handle. No number comes twice, so that a closed handle is never valid again.
pub(super) fn add(object: Object) -> Handle {
    let mut objects = OBJECTS.lock();
    objects.made += 1;
    // Programs take neither null nor small numbers for handles.
    let handle = objects.made * 4 + 0x5000_0000;
    objects.all.insert(handle, object);
    ptr::without_provenance_mut(handle)
}

/// Changes what a handle leads to. `None` when that is nothing.
pub(super) fn change<R>(
    handle: Handle,
    change: impl FnOnce(&mut Object) -> Option<R>,
) -> Option<R> {
    let answer = OBJECTS.lock().all.get_mut(&handle.addr()).and_then(change);
    CHANGED.notify_all();
    answer
}

fn truth(done: Option<()>) -> i32 {
    i32::from(done.is_some())
}

pub(super) fn close(handle: Handle) -> bool {
    let closed = OBJECTS.lock().all.remove(&handle.addr()).is_some();
    hold(|held| _ = held.remove(&handle.addr()));
    CHANGED.notify_all();
    closed
}

fn wait(handles: &[usize], all: bool, milliseconds: u32) -> u32 {
    let end = (milliseconds != INFINITE)
        .then(|| Instant::now() + Duration::from_millis(milliseconds.into()));
    let mut objects = OBJECTS.lock();
    loop {
        let mut ready = Vec::new();
        for (index, handle) in handles.iter().enumerate() {
            match objects.all.get(handle) {
                None => return WAIT_FAILED,
                Some(object) if object.is_ready() => ready.push(index),
                Some(_) => {}
            }
        }
        if !all {
            ready.truncate(1);
        }
        if !ready.is_empty() && (!all || ready.len() == handles.len()) {
            let mut begin = WAIT_OBJECT_0;
            for index in &ready {
                let handle = handles[*index];
                if objects.all.get_mut(&handle).is_some_and(|object| object.take(handle)) {
                    begin = WAIT_ABANDONED_0;
                }
            }
            return begin + if all { 0 } else { ready[0] as u32 };
        }
        match end {
            None => CHANGED.wait(&mut objects),
            Some(end) if Instant::now() >= end => return WAIT_TIMEOUT,
            Some(end) => {
                CHANGED.wait_until(&mut objects, end);
            }
        }
    }
}

/// Makes an event.
#[no_mangle]
pub extern "C" fn CreateEventA(
    _security: *mut c_void,
    manual: i32,
    set: i32,
    _name: *const c_char,
) -> Handle {
    caught(ptr::null_mut(), || add(Object::Event { manual: manual != FALSE, set: set != FALSE }))
}

/// Makes an event.
#[no_mangle]
pub extern "C" fn CreateEventW(
    security: *mut c_void,
    manual: i32,
    set: i32,
    _name: *const libc::wchar_t,
) -> Handle {
    CreateEventA(security, manual, set, ptr::null())
}

fn set_event(handle: Handle, to: bool) -> i32 {
    caught(FALSE, || {
        truth(change(handle, |object| {
            let Object::Event { set, .. } = object else { return None };
            *set = to;
            Some(())
        }))
    })
}

/// Sets an event.
#[no_mangle]
pub extern "C" fn SetEvent(event: Handle) -> i32 {
    set_event(event, true)
}

/// Takes an event back.
#[no_mangle]
pub extern "C" fn ResetEvent(event: Handle) -> i32 {
    set_event(event, false)
}

/// Makes a lock.
#[no_mangle]
pub extern "C" fn CreateMutexA(_security: *mut c_void, owned: i32, _name: *const c_char) -> Handle {
    caught(ptr::null_mut(), || {
        let mutex = add(Object::Mutex { owner: None, times: 0, abandoned: false });
        if owned != FALSE {
            wait(&[mutex.addr()], false, 0);
        }
        mutex
    })
}

/// Makes a lock.
#[no_mangle]
pub extern "C" fn CreateMutexW(
    security: *mut c_void,
    owned: i32,
    _name: *const libc::wchar_t,
) -> Handle {
    CreateMutexA(security, owned, ptr::null())
}

/// Gives a lock back, which only its owner can.
#[no_mangle]
pub extern "C" fn ReleaseMutex(mutex: Handle) -> i32 {
    caught(FALSE, || {
        truth(change(mutex, |object| {
            let Object::Mutex { owner, times, .. } = object else { return None };
            if *owner != Some(thread::current().id()) {
                return None;
            }
            *times -= 1;
            if *times == 0 {
                *owner = None;
                hold(|held| _ = held.remove(&mutex.addr()));
            }
            Some(())
        }))
    })
}

/// Makes a semaphore with this count.
#[no_mangle]
pub extern "C" fn CreateSemaphoreA(
    _security: *mut c_void,
    count: i32,
    most: i32,
    _name: *const c_char,
) -> Handle {
    caught(ptr::null_mut(), || match most > 0 && (0..=most).contains(&count) {
        true => add(Object::Semaphore { count, most }),
        false => ptr::null_mut(),
    })
}

/// Makes a semaphore with this count.
#[no_mangle]
pub extern "C" fn CreateSemaphoreW(
    security: *mut c_void,
    count: i32,
    most: i32,
    _name: *const libc::wchar_t,
) -> Handle {
    CreateSemaphoreA(security, count, most, ptr::null())
}

/// Adds to a semaphore's count, at most to what it may be.
///
/// # Safety
///
/// `before` is null or points to an integer that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn ReleaseSemaphore(semaphore: Handle, by: i32, before: *mut i32) -> i32 {
    caught(FALSE, || {
        let was = change(semaphore, |object| {
            let Object::Semaphore { count, most } = object else { return None };
            let was = *count;
            *count = was.checked_add(by).filter(|sum| by > 0 && sum <= most)?;
            Some(was)
        });
        if let Some(was) = was.filter(|_| !before.is_null()) {
            // SAFETY: as the caller promises.
            unsafe { *before = was };
        }
        was.is_some().into()
    })
}

/// Waits for one object.
#[no_mangle]
pub extern "C" fn WaitForSingleObject(object: Handle, milliseconds: u32) -> u32 {
    caught(WAIT_FAILED, || wait(&[object.addr()], false, milliseconds))
}

/// Waits for one of several objects, or for all of them.
///
/// # Safety
///
/// `objects` is null or points to `count` handles that do not change during the call.
#[no_mangle]
pub unsafe extern "C" fn WaitForMultipleObjects(
    count: u32,
    objects: *const Handle,
    all: i32,
    milliseconds: u32,
) -> u32 {
    caught(WAIT_FAILED, || {
        let count = count as usize;
        if objects.is_null() || count == 0 || count > MOST_OBJECTS {
            return WAIT_FAILED;
        }
        // SAFETY: as the caller promises.
        let handles: Vec<_> = (0..count).map(|at| unsafe { *objects.add(at) }.addr()).collect();
        wait(&handles, all != FALSE, milliseconds)
    })
}

/// Closes a handle. Waits for it fail; a thread goes on.
#[no_mangle]
pub extern "C" fn CloseHandle(object: Handle) -> i32 {
    caught(FALSE, || close(object).into())
}

/// Tells the code with which a thread has ended.
///
/// # Safety
///
/// `code` is null or points to an integer that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetExitCodeThread(thread: Handle, code: *mut u32) -> i32 {
    caught(FALSE, || {
        let ended = change(thread, |object| {
            let Object::Thread { code } = object else { return None };
            Some(code.unwrap_or(STILL_ACTIVE))
        });
        match ended {
            Some(ended) if !code.is_null() => {
                // SAFETY: as the caller promises.
                unsafe { *code = ended };
                TRUE
            }
            _ => FALSE,
        }
    })
}

/// A lock in the program's memory.
#[repr(C)]
pub struct CriticalSection {
    mutex: Handle,
}

/// # Safety
///
/// `section` is null or points to a section that was initialized.
unsafe fn mutex_of(section: *const CriticalSection) -> Handle {
    if section.is_null() {
        return ptr::null_mut();
    }
    // SAFETY: as the caller promises; only making and deleting the section writes it.
    unsafe { (*section).mutex }
}

/// Makes a lock.
///
/// # Safety
///
/// `section` is null or points to a section that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn InitializeCriticalSection(section: *mut CriticalSection) {
    if section.is_null() {
        return;
    }
    let mutex = CreateMutexA(ptr::null_mut(), FALSE, ptr::null());
    // SAFETY: as the caller promises.
    unsafe { (*section).mutex = mutex };
}

/// Waits for a lock and takes it.
///
/// # Safety
///
/// `section` is null or points to a section that was initialized.
#[no_mangle]
pub unsafe extern "C" fn EnterCriticalSection(section: *mut CriticalSection) {
    // SAFETY: as the caller promises.
    WaitForSingleObject(unsafe { mutex_of(section) }, INFINITE);
}

/// Takes a lock if it is free.
///
/// # Safety
///
/// `section` is null or points to a section that was initialized.
#[no_mangle]
pub unsafe extern "C" fn TryEnterCriticalSection(section: *mut CriticalSection) -> i32 {
    // SAFETY: as the caller promises.
    i32::from(WaitForSingleObject(unsafe { mutex_of(section) }, 0) == WAIT_OBJECT_0)
}

/// Gives a lock back.
///
/// # Safety
///
/// `section` is null or points to a section that was initialized.
#[no_mangle]
pub unsafe extern "C" fn LeaveCriticalSection(section: *mut CriticalSection) {
    // SAFETY: as the caller promises.
    ReleaseMutex(unsafe { mutex_of(section) });
}

/// Takes a lock away.
///
/// # Safety
///
/// `section` is null or points to a section that was initialized and that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn DeleteCriticalSection(section: *mut CriticalSection) {
    // SAFETY: as the caller promises.
    CloseHandle(unsafe { mutex_of(section) });
}
