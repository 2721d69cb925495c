//! The areas, locked.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};
use std::rc::Rc;

use super::panic_check::PanicCheck;
use super::shared::Shared;
use super::taken::Taken;
use crate::transfer_area::FishX1Transfer;

/// The areas, locked: a slice with the master at
/// [`LOCAL_IO`](crate::transfer_area::LOCAL_IO) and the extensions behind it.
///
/// Dropping it lets what was written go out with the next request, all of it or nothing. It stays with
/// the thread that has locked.
///
/// What was written does not count when the outputs were stopped meanwhile, by the end of the transfer,
/// a lost connection or the watchdog, nor when they were stopped before and the handle does [not know
/// of that yet](crate::TransferArea#when-outputs-count). They read 0 then at the next lock.
pub struct TransferAreaGuard<'a> {
    shared: &'a Shared,
    taken: Taken,
    panicking: PanicCheck,
    /// It is known by its thread who has the areas.
    stays_in_its_thread: PhantomData<Rc<()>>,
}

impl<'a> TransferAreaGuard<'a> {
    pub(super) fn new(shared: &'a Shared, taken: Taken) -> Self {
        let panicking = PanicCheck::new();
        Self { shared, taken, panicking, stays_in_its_thread: PhantomData }
    }

    /// The newest response whose window was opened when this was locked.
    pub(super) fn response(&self) -> u64 {
        self.taken.response
    }

    /// The newest response that needs no waiting for any more. One that came in while this thread
    /// did not expect it does: its window waits for somebody still.
    pub(super) fn attended(&self) -> u64 {
        let expected = self.taken.reacts_to == Some(self.taken.response);
        if expected {
            self.taken.response
        } else {
            self.taken.response.saturating_sub(1)
        }
    }
}

impl Deref for TransferAreaGuard<'_> {
    type Target = [FishX1Transfer];

    fn deref(&self) -> &Self::Target {
        &self.taken.areas
    }
}

impl DerefMut for TransferAreaGuard<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.taken.areas
    }
}

impl fmt::Debug for TransferAreaGuard<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.taken.areas.iter()).finish()
    }
}

impl Drop for TransferAreaGuard<'_> {
    fn drop(&mut self) {
        // A panic may have left half of what belongs together in the areas.
        self.shared.release(&mut self.taken, self.panicking.has_begun());
    }
}
