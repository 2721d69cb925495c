//! Waits that end on time.
//!
//! On Windows a wait on a condition variable that has a limit ends with a tick of the system's
//! clock, which comes every 15.6 ms by default: too coarse for a controller's cycle of 10 ms.
//! `thread::sleep` has a timer of high resolution there, but nothing can wake it. So the last part
//! of a wait is made of short sleeps, with a check of the condition after each.

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
    #[cfg(not(all(test, shuttle)))]
    pub(crate) const OF_SYSTEM: Self = if cfg!(windows) { Self::Coarse } else { Self::Fine };

    /// Waits for a change, but not beyond the deadline; returns whether the deadline has passed. May end
    /// without either.
    pub(crate) fn wait_until<T>(
        self,
        changed: &Condvar,
        guard: &mut MutexGuard<'_, T>,
        deadline: Instant,
    ) -> bool {
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

/// A limit that every clock reaches, for waits of others that end in a panic otherwise: forever is 136 years.
pub(crate) fn within_clock(limit: Duration) -> Duration {
    limit.min(Duration::from_secs(u32::MAX.into()))
}

#[cfg(test)]
mod tests {
    use parking_lot::Mutex;

    use super::*;

    const TIMINGS: [Timing; 2] = [Timing::Fine, Timing::Coarse];
    /// Far more than any test takes.
    const LONG: Duration = Duration::from_secs(3600);

    /// Waits as long as the condition holds, but not longer than `limit`.
    fn wait_while_for<T>(
        clock: Timing,
        changed: &Condvar,
        guard: &mut MutexGuard<'_, T>,
        limit: Duration,
        mut condition: impl FnMut(&mut T) -> bool,
    ) {
        let deadline = Instant::now() + limit;
        while condition(guard) && !clock.wait_until(changed, guard, deadline) {}
    }

    /// How often the condition is checked in a wait of this length that nothing else ends.
    fn looks(clock: Timing, limit: Duration) -> usize {
        let mut looks = 0;
        let begin = Instant::now();
        wait_while_for(clock, &Condvar::new(), &mut Mutex::new(()).lock(), limit, |()| {
            looks += 1;
            true
        });
        assert!(begin.elapsed() >= limit);
        looks
    }

    #[test]
    fn a_coarse_clock_is_not_relied_on_for_the_last_part_of_a_wait() {
        let limit = COARSE / 2;
        // Each sleep may last longer on a busy machine, but not all of them every time.
        assert!((0..100).any(|_| looks(Timing::Coarse, limit) > 4));
        assert!(looks(Timing::Fine, limit) <= 2);
        // The first part is slept through.
        assert!(
            looks(Timing::Coarse, 3 * COARSE)
                < 10 + (COARSE.as_micros() / NAP.as_micros()) as usize
        );
    }

    #[test]
    fn a_wait_ends_when_its_condition_does() {
        for clock in TIMINGS {
            for limit in [COARSE, LONG] {
                let (waiting, changed) = (Mutex::new(true), Condvar::new());
                thread::scope(|scope| {
                    scope.spawn(|| {
                        *waiting.lock() = false;
                        changed.notify_all();
                    });
                    wait_while_for(clock, &changed, &mut waiting.lock(), limit, |waiting| *waiting);
                });
            }
        }
    }

    #[test]
    fn the_lock_is_free_during_a_wait() {
        for clock in TIMINGS {
            let (count, changed) = (Mutex::new(0), Condvar::new());
            thread::scope(|scope| {
                scope.spawn(|| {
                    while *count.lock() < 3 {
                        *count.lock() += 1;
                    }
                });
                let mut guard = count.lock();
                while *guard < 3 {
                    wait_while_for(clock, &changed, &mut guard, NAP, |count| *count < 3);
                }
            });
        }
    }

    #[test]
    fn without_time_the_condition_is_looked_at_and_nothing_waited_for() {
        for clock in TIMINGS {
            assert!(looks(clock, Duration::ZERO) >= 1);
        }
    }
}
