//! Waits that end on time.
//!
//! On Windows a wait on a condition variable that has a limit ends with a tick of the system's
//! clock, which comes every 15.6 ms by default: too coarse for a controller's cycle of 10 ms.
//! `thread::sleep` has a timer of high resolution there, but nothing can wake it. So the last part
//! of a wait is made of short sleeps, with a check of the condition after each.
//!
//! The library waits in the same way, but not in public.

use std::thread;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, MutexGuard};

/// How exactly a wait on a condition variable ends at its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Timing {
    /// Well within a millisecond.
    Fine,
    /// With a tick that may be [`COARSE`] later.
    Coarse,
}

/// More than two ticks of a coarse clock.
const COARSE: Duration = Duration::from_millis(40);

/// How long each of the short sleeps is, so how late the condition may be seen.
const NAP: Duration = Duration::from_micros(500);

impl Timing {
    /// The timing of the system that this is compiled for.
    pub(crate) const OF_SYSTEM: Self = if cfg!(windows) { Self::Coarse } else { Self::Fine };

    /// Waits for a change, but not beyond the deadline if there is one; returns whether the deadline has
    /// passed. May end without either.
    pub(crate) fn wait_until<T>(
        self,
        changed: &Condvar,
        guard: &mut MutexGuard<'_, T>,
        deadline: Option<Instant>,
    ) -> bool {
        let Some(deadline) = deadline else {
            changed.wait(guard);
            return false;
        };
        if self == Self::Fine {
            return changed.wait_until(guard, deadline).timed_out();
        }
        let left = deadline.saturating_duration_since(Instant::now());
        if left > COARSE {
            changed.wait_for(guard, left - COARSE);
        } else if !left.is_zero() {
            MutexGuard::unlocked(guard, || thread::sleep(left.min(NAP)));
        }
        left.is_zero()
    }
}

#[cfg(test)]
mod tests {
    use parking_lot::Mutex;

    use super::*;

    const TIMINGS: [Timing; 2] = [Timing::Fine, Timing::Coarse];
    /// Far more than any test takes.
    const LONG: Duration = Duration::from_secs(3600);

    /// How many waits a limit of this length takes that nothing else ends.
    fn waits(timing: Timing, limit: Duration) -> usize {
        let (mutex, begin) = (Mutex::new(()), Instant::now());
        let mut guard = mutex.lock();
        let mut waits = 1;
        while !timing.wait_until(&Condvar::new(), &mut guard, Some(begin + limit)) {
            waits += 1;
        }
        assert!(begin.elapsed() >= limit);
        waits
    }

    #[test]
    fn a_coarse_clock_is_not_relied_on_for_the_last_part_of_a_wait() {
        // Each sleep may last longer on a busy machine, but not all of them every time.
        assert!((0..100).any(|_| waits(Timing::Coarse, COARSE / 2) > 4));
        assert!(waits(Timing::Fine, COARSE / 2) <= 2);
        // The first part is slept through.
        let naps = (COARSE.as_micros() / NAP.as_micros()) as usize;
        assert!(waits(Timing::Coarse, 3 * COARSE) < 10 + naps);
    }
    #[test]
    fn a_wait_ends_when_its_condition_does() {
        for timing in TIMINGS {
            for limit in [Some(COARSE), Some(LONG), None] {
                let (waiting, changed) = (Mutex::new(true), Condvar::new());
                thread::scope(|scope| {
                    scope.spawn(|| {
                        *waiting.lock() = false;
                        changed.notify_all();
                    });
                    let deadline = limit.map(|limit| Instant::now() + limit);
                    let mut guard = waiting.lock();
                    while *guard && !timing.wait_until(&changed, &mut guard, deadline) {}
                });
            }
        }
    }

    #[test]
    fn the_lock_is_free_during_a_wait() {
        for timing in TIMINGS {
            let (count, changed) = (Mutex::new(0), Condvar::new());
            thread::scope(|scope| {
                scope.spawn(|| {
                    while *count.lock() < 3 {
                        *count.lock() += 1;
                    }
                });
                let mut guard = count.lock();
                while *guard < 3 {
                    timing.wait_until(&changed, &mut guard, Some(Instant::now() + NAP));
                }
            });
        }
    }
}
