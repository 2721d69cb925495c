//! Waits for a condition.

use std::time::Duration;

use crate::error::Error;
use crate::handler::program::area::TransferArea;
use crate::handler::program::guard::TransferAreaGuard;
use crate::handler::program::lease::Known;
use crate::handler::program::response_wait::Wait;
use crate::handler::sync::park;
use crate::terminals::{Counter, Input, Motor};
use crate::transfer_area::FishX1Transfer;
use std::time::Instant;

impl TransferArea {
    /// Waits until a condition holds and returns the areas locked, as they were found then.
    ///
    /// The condition is checked immediately, and then once for each response, as in a loop around
    /// [`wait_cycle`](Self::wait_cycle): it sees the response's inputs, and what is written under
    /// the guard goes out in the very next request. In a transfer without a response yet, the first
    /// check waits for one. The condition runs with the areas locked, so it has to be quick. It must not
    /// lock them itself, which panics. A panic in it counts as a panic under a guard.
    ///
    /// Between two checks the areas are not locked; waiting does not slow the exchange down.
    ///
    /// Blocks up to `limit`, with [`Duration::MAX`] forever; the lock itself may take longer when another thread holds a guard.
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, FishX1Transfer, TransferArea};
    ///
    /// /// Turns M1 until the end switch at I1 is pressed.
    /// fn go_home(area: &TransferArea) -> Result<(), Error> {
    ///     area.lock()[LOCAL_IO].output.duty[0] = 300;
    ///     let pressed = |areas: &[FishX1Transfer]| areas[LOCAL_IO].input.uni[0] != 0;
    ///     let mut areas = area.wait_until(pressed, Duration::from_secs(5))?;
    ///     areas[LOCAL_IO].output.duty[0] = 0;
    ///     Ok(())
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::WaitTimedOut`] when the condition did not hold in time; this changes neither the areas nor
    /// the transfer. Otherwise as [`wait_cycle`](Self::wait_cycle).
    ///
    /// # Panics
    ///
    /// When this thread holds a guard, as [`lock`](Self::lock).
    #[track_caller]
    pub fn wait_until(
        &self,
        mut condition: impl FnMut(&[FishX1Transfer]) -> bool,
        limit: Duration,
    ) -> Result<TransferAreaGuard<'_>, Error> {
        let deadline = self.shared().clock().deadline_after(limit);
        let timed_out = || Error::WaitTimedOut { limit };
        let mut known = self.known();
        let look = self.shared().look(&mut known, deadline);
        self.has_learned(known);
        let look = look?;
        let mut areas = self.guard(look.ok_or_else(timed_out)?);
        while !condition(&areas) {
            let seen = areas.attended();
            drop(areas);
            // Responses may come in faster than they can be checked.
            if deadline.is_some_and(|deadline| deadline <= self.shared().clock().now()) {
                return Err(timed_out());
            }
            let next = self.wait_for_next(Known { returned: seen, ..self.known() }, deadline);
            areas = self.guard(next?.ok_or_else(timed_out)?);
        }
        self.note_returned(areas.window());
        Ok(areas)
    }

    /// Waits until the last command of a motor in the extended mode
    /// [is done](FishX1Transfer::is_motor_ex_ready).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist; otherwise as
    /// [`wait_until`](Self::wait_until).
    #[track_caller]
    pub fn wait_motor_ex(
        &self,
        area: usize,
        motor: Motor,
        limit: Duration,
    ) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait_area(area, |area| area.is_motor_ex_ready(motor), limit)
    }

    /// Waits until the last reset of a counter [is done](FishX1Transfer::is_cnt_reset_ready).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist; otherwise as
    /// [`wait_until`](Self::wait_until).
    #[track_caller]
    pub fn wait_counter_reset(
        &self,
        area: usize,
        counter: Counter,
        limit: Duration,
    ) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait_area(area, |area| area.is_cnt_reset_ready(counter), limit)
    }

    /// Waits until the last sound command [is done](FishX1Transfer::is_sound_ready).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist; otherwise as
    /// [`wait_until`](Self::wait_until).
    #[track_caller]
    pub fn wait_sound(&self, area: usize, limit: Duration) -> Result<TransferAreaGuard<'_>, Error> {
        self.wait_area(area, FishX1Transfer::is_sound_ready, limit)
    }

    /// Waits until a universal input reports another value than at the beginning of the wait. Any difference
    /// counts.
    ///
    /// A new configuration changes the value, too; wait for it with
    /// [`update_config`](Self::update_config) first.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist; otherwise as
    /// [`wait_until`](Self::wait_until).
    #[track_caller]
    pub fn wait_input_change(
        &self,
        area: usize,
        input: Input,
        limit: Duration,
    ) -> Result<TransferAreaGuard<'_>, Error> {
        let mut before = None;
        let has_changed = |area: &FishX1Transfer| {
            let value = area.input.uni[input.index()];
            *before.get_or_insert(value) != value
        };
        self.wait_area(area, has_changed, limit)
    }

    /// Returns an error unless there is an area with this index.
    pub(crate) fn check_area(&self, area: usize) -> Result<(), Error> {
        let most = self.shared().area_count() as i64 - 1;
        Error::check_range("area's index", area, 0..=most)
    }

    /// Waits until a condition holds for one area.
    #[track_caller]
    fn wait_area(
        &self,
        area: usize,
        mut condition: impl FnMut(&FishX1Transfer) -> bool,
        limit: Duration,
    ) -> Result<TransferAreaGuard<'_>, Error> {
        self.check_area(area)?;
        self.wait_until(|areas| condition(&areas[area]), limit)
    }
}

impl TransferArea {
    /// Waits for the next response of any of several controllers; returns the index of its areas, and the
    /// areas locked, as [`wait_cycle`](Self::wait_cycle) does for one.
    ///
    /// This is for a loop that controls several machines, each by a handler of its own. Their responses come
    /// at independent times, so waiting for one controller while the areas of another are locked makes the
    /// reactions to the other late. With this call each response is answered in time. The newest inputs of
    /// the other controllers are read by [`lock`](Self::lock), which does not wait for a response, so it may
    /// be called while the returned guard is held; what is written there goes out with their next request.
    /// To answer a response, write under the guard that this returns for it.
    ///
    /// When there are several responses, it returns the oldest; the others keep their reaction windows until
    /// the next call. In [lock-step](crate::TransferAreaComHandlerBuilder::lock_step) it returns the areas
    /// whose transfer has had the least time, so they take turns.
    ///
    /// ```
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::{Error, TransferAreaComHandler, TransferArea};
    ///
    /// /// The belt at the second controller runs while the first one's light barrier is interrupted.
    /// fn feed(first: &TransferAreaComHandler, second: &TransferAreaComHandler) -> Result<(), Error> {
    ///     let (barrier, belt) = (first.transfer_area(), second.transfer_area());
    ///     loop {
    ///         let (which, areas) = TransferArea::wait_any(&[&barrier, &belt]);
    ///         let mut areas = areas?;
    ///         if which == 0 {
    ///             let waits = areas[LOCAL_IO].input.uni[0] == 0;
    ///             areas[LOCAL_IO].output.duty[6] = if waits { 512 } else { 0 }; // a lamp at O7
    ///         } else {
    ///             let waits = barrier.lock()[LOCAL_IO].input.uni[0] == 0;
    ///             areas[LOCAL_IO].output.duty[0] = if waits { 512 } else { 0 }; // M1
    ///         }
    ///     }
    /// }
    /// ```
    ///
    /// Blocks as `wait_cycle` does until the first of them has a response or an error. Threads that each hold
    /// guards of several controllers must lock them in the same order.
    ///
    /// # Errors
    ///
    /// As `wait_cycle`, with the index of the areas whose transfer has the error. An error comes before the
    /// responses of the others: leave areas whose transfer has ended out of the next call.
    /// [`Error::OutOfRange`] without any areas.
    ///
    /// # Panics
    ///
    /// When this thread holds a guard of any of them, as [`lock`](Self::lock).
    #[track_caller]
    pub fn wait_any<'a>(areas: &[&'a Self]) -> (usize, Result<TransferAreaGuard<'a>, Error>) {
        if let Err(error) =
            Error::check_range("number of areas", areas.len(), 1..=i64::from(u16::MAX))
        {
            return (0, Err(error));
        }
        for area in areas {
            area.shared().check_free();
        }
        if areas.iter().all(|area| area.shared().is_lock_step()) {
            let time = |index: &usize| areas[*index].shared().elapsed();
            let slowest = (0..areas.len()).min_by_key(time).unwrap_or_default();
            return (slowest, areas[slowest].wait_cycle());
        }
        let mut waits = Vec::with_capacity(areas.len());
        for (index, area) in areas.iter().enumerate() {
            match area.learn(|known| area.shared().begin_shared_wait(known)) {
                Ok(wait) => waits.push(wait),
                Err(error) => {
                    put_off(areas, &waits, None);
                    return (index, Err(error));
                }
            }
        }
        loop {
            match first_told(areas, &mut waits) {
                Some((index, Ok(()))) => {
                    put_off(areas, &waits, Some(index));
                    let area = areas[index];
                    let lease = area.learn(|known| area.shared().take_after(&waits[index], *known));
                    let guard = area.guard(lease);
                    area.note_returned(guard.window());
                    return (index, Ok(guard));
                }
                Some((index, Err(error))) => {
                    put_off(areas, &waits, Some(index));
                    return (index, Err(error));
                }
                None => park(),
            }
        }
    }
}

/// The oldest response that has come in, or an error.
fn first_told(areas: &[&TransferArea], waits: &mut [Wait]) -> Option<(usize, Result<(), Error>)> {
    let mut oldest: Option<(usize, Instant)> = None;
    for (index, (area, wait)) in areas.iter().zip(waits).enumerate() {
        match area.learn(|known| area.shared().look_after(wait, known)) {
            Ok(Some(arrived)) if oldest.is_none_or(|(_, before)| arrived < before) => {
                oldest = Some((index, arrived));
            }
            Ok(_) => {}
            Err(error) => return Some((index, Err(error))),
        }
    }
    oldest.map(|(index, _)| (index, Ok(())))
}

/// Ends the waits that have begun, except this one.
fn put_off(areas: &[&TransferArea], waits: &[Wait], except: Option<usize>) {
    for (index, (area, wait)) in areas.iter().zip(waits).enumerate() {
        if Some(index) != except {
            area.shared().put_off(wait);
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use std::sync::Arc;
    use std::time::Instant;

    use super::*;
    use crate::exchange::Inputs;
    use crate::handler::parts::clock::TransferClock;
    use crate::handler::parts::watchdog::Watchdog;
    use crate::handler::shared::Shared;

    /// Areas of a transfer that is running.
    fn begun() -> TransferArea {
        let (watchdog, clock) = (Watchdog::new(None), TransferClock::new(false));
        let area = TransferArea::new(Arc::new(Shared::new(1, watchdog, Duration::MAX, clock)));
        area.shared().begin().unwrap();
        area.shared().run(0).unwrap();
        area
    }

    /// A response comes in; its window stays open.
    fn respond(area: &TransferArea) {
        let nothing = &mut Inputs::default();
        area.shared().deliver(&Inputs::default(), 0, nothing, &mut Inputs::default());
    }

    /// The response that a wait for a newer one than `seen` finds immediately.
    fn wait_for(area: &TransferArea, seen: u64) -> Option<TransferAreaGuard<'_>> {
        let wait = |known: &mut Known| {
            known.returned = seen;
            area.shared().wait_cycle(known, Some(Instant::now()))
        };
        area.learn(wait).unwrap().map(|lease| area.guard(lease))
    }

    #[test]
    fn a_response_that_comes_in_during_the_first_check_is_answered_within_its_window() {
        let area = begun();
        respond(&area);
        area.shared().hold_window(None, Duration::ZERO, &mut [FishX1Transfer::default()]);
        let look = || area.learn(|known| area.shared().look(known, None)).unwrap();
        let first = area.guard(look().unwrap());
        assert_eq!((first.window(), first.attended()), (1, 0), "its window was closed");
        let seen = first.attended();
        drop(first);
        respond(&area);
        let second = wait_for(&area, seen).unwrap();
        assert_eq!((second.window(), second.attended()), (2, 2));
        drop(second);
        assert!(wait_for(&area, 2).is_none());
    }

    #[test]
    fn the_limit_holds_even_if_there_is_always_another_response() {
        let area = begun();
        respond(&area);
        let mut checks = 0;
        let condition = |_: &[FishX1Transfer]| {
            checks += 1;
            assert_eq!(checks, 1, "checked after the limit");
            respond(&area);
            false
        };
        let limit = Duration::ZERO;
        let error = area.wait_until(condition, limit).unwrap_err();
        assert_eq!(error, Error::WaitTimedOut { limit });
    }

    #[test]
    fn a_response_that_was_found_is_not_the_next_one() {
        let area = begun();
        respond(&area);
        let limit = Duration::ZERO;
        drop(area.wait_until(|_| true, limit).unwrap());
        assert_eq!(area.wait_cycle_for(limit).unwrap_err(), Error::WaitTimedOut { limit });
    }
}
