//! The areas, locked.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Index, IndexMut};
use std::rc::Rc;
use std::slice::SliceIndex;
use std::time::Instant;

use crate::handler::shared::Shared;
use crate::handler::state::Lease;
use crate::handler::sync::PanicCheck;
use crate::transfer_area::FishX1Transfer;

/// The areas, locked: a slice with the master at
/// [`LOCAL_IO`](crate::transfer_area::LOCAL_IO) and the extensions after it.
///
/// After the guard is dropped, what was written goes out with the next request, all together. A guard can't
/// be sent to another thread.
///
/// Outputs that were written do not count when the outputs were stopped meanwhile, by the end of the
/// transfer, a lost connection or the watchdog, or when they were stopped before and the handle does [not
/// know of that yet](crate::TransferAreas#when-outputs-count). Then they read 0 at the next lock.
///
/// An index beyond the number of areas that the handler was
/// [built](crate::TransferAreaComHandlerBuilder::areas) with panics; `get` returns `None` for it.
pub struct TransferAreaGuard<'a> {
    shared: &'a Shared,
    lease: Lease,
    panicking: PanicCheck,
    /// The holder of the areas is known by its thread.
    stays_in_its_thread: PhantomData<Rc<()>>,
}

impl<'a> TransferAreaGuard<'a> {
    pub(crate) fn new(shared: &'a Shared, lease: Lease) -> Self {
        let panicking = PanicCheck::new();
        Self { shared, lease, panicking, stays_in_its_thread: PhantomData }
    }

    /// The number of the response whose inputs are in the areas, as in
    /// [`Statistics::cycles`](crate::Statistics::cycles): 1 for the first of a transfer, 0 before it.
    ///
    /// A loop around `wait_cycle` that finds it two higher than in its last round has missed one response.
    ///
    /// ```
    /// use ft_transfer_area::prelude::*;
    ///
    /// /// Holds the distance that a sensor at I1 measures, by an integrating controller for M1.
    /// fn hold_distance(areas: &TransferAreas, wanted: f64) -> Result<(), Error> {
    ///     let now = areas.wait_cycle()?;
    ///     let (mut cycle, mut arrived) = (now.cycle(), now.arrived());
    ///     drop(now);
    ///     let (mut integral, mut missed) = (0.0, 0);
    ///     loop {
    ///         let mut now = areas.wait_cycle()?;
    ///         let dt = (now.arrived() - arrived).as_secs_f64();
    ///         missed += now.cycle() - cycle - 1;
    ///         (cycle, arrived) = (now.cycle(), now.arrived());
    ///         integral += (wanted - f64::from(now[LOCAL_IO].input.uni[I1])) * dt;
    ///         now[LOCAL_IO].output.duty[O1] = integral.clamp(0.0, 512.0) as i16;
    ///         if missed > 100 {
    ///             return Ok(()); // this program is too slow
    ///         }
    ///     }
    /// }
    /// ```
    #[must_use]
    pub fn cycle(&self) -> u64 {
        self.lease.cycle
    }

    /// When the response came in whose inputs are in the areas; before the first one of a transfer, when
    /// the transfer began.
    ///
    /// The transfer thread takes this time, so it does not depend on when this thread was woken.
    #[must_use]
    pub fn arrived(&self) -> Instant {
        self.lease.arrived
    }

    /// The newest response that is in the areas, counted over all transfers.
    pub(crate) fn response(&self) -> u64 {
        self.lease.response
    }
}

impl Deref for TransferAreaGuard<'_> {
    type Target = [FishX1Transfer];

    fn deref(&self) -> &Self::Target {
        &self.lease.areas
    }
}

impl DerefMut for TransferAreaGuard<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.lease.areas
    }
}

/// As for a slice, with a panic that says what to write instead.
impl<I> Index<I> for TransferAreaGuard<'_>
where
    I: SliceIndex<[FishX1Transfer]> + Clone + fmt::Debug,
{
    type Output = I::Output;

    #[track_caller]
    fn index(&self, index: I) -> &I::Output {
        // No closure, so that the panic shows the caller's line.
        match self.get(index.clone()) {
            Some(areas) => areas,
            None => no_area(&index, self.len()),
        }
    }
}

impl<I> IndexMut<I> for TransferAreaGuard<'_>
where
    I: SliceIndex<[FishX1Transfer]> + Clone + fmt::Debug,
{
    #[track_caller]
    fn index_mut(&mut self, index: I) -> &mut I::Output {
        let count = self.len();
        match self.get_mut(index.clone()) {
            Some(areas) => areas,
            None => no_area(&index, count),
        }
    }
}

#[cold]
#[track_caller]
fn no_area(index: &dyn fmt::Debug, count: usize) -> ! {
    panic!(
        "there is no area {index:?}, because the handler has {count}; areas count from 0, the master, \
         and builder.areas(…) sets how many there are, such as areas(2) for the master and one extension"
    )
}

impl fmt::Debug for TransferAreaGuard<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.lease.areas.iter()).finish()
    }
}

impl Drop for TransferAreaGuard<'_> {
    fn drop(&mut self) {
        // A panic may have left half of what belongs together in the areas.
        self.shared.release(&mut self.lease, self.panicking.has_begun());
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use std::panic::{catch_unwind, AssertUnwindSafe};

    use crate::transfer_area::{LOCAL_IO, REMOTE_IO_1};
    use crate::TransferAreaComHandler;

    /// The panic of a program that does this with the guard of a handler with two areas.
    fn panic_of(program: impl FnOnce(&mut super::TransferAreaGuard)) -> String {
        let handler = TransferAreaComHandler::builder("127.0.0.1").areas(2).build().unwrap();
        let panic =
            catch_unwind(AssertUnwindSafe(|| program(&mut handler.areas().lock()))).unwrap_err();
        *panic.downcast::<String>().unwrap()
    }

    #[test]
    fn the_panic_for_an_index_beyond_the_areas_says_what_to_write() {
        for text in [
            panic_of(|areas| areas[2].output.duty[0] = 512),
            panic_of(|areas| assert_eq!(areas[2].input.uni[0], 0)),
        ] {
            assert!(text.starts_with("there is no area 2, because the handler has 2;"), "{text}");
            assert!(text.contains("builder.areas(…)"), "{text}");
        }
        assert!(panic_of(|areas| areas[1..3].fill_with(Default::default)).contains("no area 1..3"));
    }

    #[test]
    fn indices_and_ranges_within_the_areas_are_those_of_a_slice() {
        let handler = TransferAreaComHandler::builder("127.0.0.1").areas(2).build().unwrap();
        let mut areas = handler.areas().lock();
        areas[REMOTE_IO_1].output.duty[0] = 7;
        assert_eq!((areas[LOCAL_IO].state.id, areas[1..][0].output.duty[0]), (0, 7));
        assert_eq!((areas[..].len(), areas.get(2)), (2, None));
    }
}
