//! Callbacks of hooks, which the program gets between two tics.

use std::collections::VecDeque;

use parking_lot::Mutex;

/// A call into the program that is to be made.
pub(super) type Callback = Box<dyn FnOnce() + Send>;

/// Callbacks that wait for their moment.
#[derive(Default)]
pub(super) struct Callbacks(Mutex<VecDeque<Callback>>);

impl Callbacks {
    /// Has this called between two tics, after those that were given before. Any thread may call it.
    pub(super) fn add(&self, callback: Callback) {
        self.0.lock().push_back(callback);
    }

    /// The callbacks that wait now. One that they add waits for the next tic.
    pub(super) fn take(&self) -> VecDeque<Callback> {
        std::mem::take(&mut *self.0.lock())
    }
}
