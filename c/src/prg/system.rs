//! What all hooks share. A hook has no argument that says which program calls it, so this is the process's.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::Arc;

use parking_lot::Mutex;

use super::callbacks::Callbacks;
use super::display::Display;
use crate::i2c::I2cThread;
use crate::memory::{AreaArray, Ta, AREAS};

/// What is behind the hooks of the program that runs.
pub(super) struct System {
    pub(super) array: Arc<AreaArray<Ta>>,
    pub(super) display: Display,
    pub(super) callbacks: Arc<Callbacks>,
    pub(super) i2c: Mutex<I2cThread>,
}

impl System {
    /// Which area a program means; the master's when it means none.
    pub(super) fn index_of(&self, area: *const Ta) -> usize {
        let offset = (area as usize).wrapping_sub(self.array.as_ptr() as usize);
        let index = offset / size_of::<Ta>();
        if index < AREAS {
            index
        } else {
            0
        }
    }
}

static CURRENT: Mutex<Option<Arc<System>>> = Mutex::new(None);

/// Sets what is behind the hooks.
pub(super) fn set(system: Option<Arc<System>>) {
    // Dropped outside the lock: that ends threads.
    let before = std::mem::replace(&mut *CURRENT.lock(), system);
    drop(before);
}

/// What is behind the hooks, while a program runs.
pub(super) fn current() -> Option<Arc<System>> {
    CURRENT.lock().clone()
}

/// The signal or the like that asks the program to end; 0 for none.
static STOP: AtomicU32 = AtomicU32::new(0);

/// Asks the program to end. Async-signal-safe.
pub(super) fn ask_to_stop(reason: u32) {
    STOP.store(reason, Ordering::Release);
}

/// Why the program is to end; `None` while it may run.
pub(super) fn stop_reason() -> Option<u32> {
    Some(STOP.load(Ordering::Acquire)).filter(|reason| *reason != 0)
}
