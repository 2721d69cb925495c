//! Callbacks of hooks, which the program gets between two tics.

use std::collections::VecDeque;
use std::sync::Once;

use parking_lot::Mutex;

/// A call into the program that is to be made.
pub(super) type Callback = Box<dyn FnOnce() + Send>;

/// How many wait at most. A program that asks again in each callback and in each tic would have ever more of them.
const MOST: usize = 1000;

/// Callbacks that wait for their moment.
#[derive(Default)]
pub(super) struct Callbacks(Mutex<VecDeque<Callback>>);

impl Callbacks {
    /// Has this called between two tics, after those that were given before, if there is room. Any thread may call it.
    pub(super) fn add(&self, callback: Callback) {
        static SAID: Once = Once::new();
        let mut waiting = self.0.lock();
        if waiting.len() < MOST {
            return waiting.push_back(callback);
        }
        drop(waiting);
        SAID.call_once(|| {
            log::error!("{MOST} callbacks wait for a tic, so further ones are left out")
        });
    }

    /// The callbacks that wait now. One that they add waits for the next tic.
    pub(super) fn take(&self) -> VecDeque<Callback> {
        std::mem::take(&mut *self.0.lock())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_wait_than_a_tic_can_call() {
        let callbacks = Callbacks::default();
        (0..2 * MOST).for_each(|_| callbacks.add(Box::new(|| {})));
        assert_eq!(callbacks.take().len(), MOST);
        callbacks.add(Box::new(|| {}));
        assert_eq!(callbacks.take().len(), 1, "there is room again");
    }
}
