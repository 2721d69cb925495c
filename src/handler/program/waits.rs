//! Waits for a condition.

use std::time::Duration;

use crate::error::Error;
use crate::handler::program::area::TransferAreas;
use crate::handler::program::guard::TransferAreaGuard;
use crate::handler::program::known::Known;
use crate::terminals::{Counter, Input, Motor};
use crate::transfer_area::FishX1Transfer;

impl TransferAreas {
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
    /// use ft_transfer_area::prelude::*;
    ///
    /// /// Turns M1 until the end switch at I1 is pressed.
    /// fn go_home(areas: &TransferAreas) -> Result<(), Error> {
    ///     areas.lock()[LOCAL_IO].output.duty[O1] = 300;
    ///     let pressed = |now: &[FishX1Transfer]| now[LOCAL_IO].input.uni[I1] != 0;
    ///     let mut now = areas.wait_until(pressed, Duration::from_secs(5))?;
    ///     now[LOCAL_IO].output.duty[O1] = 0;
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
        let deadline = self.shared().state().clock.deadline_after(limit);
        let timed_out = || Error::WaitTimedOut { limit };
        let mut known = self.known.get();
        // Not in a closure, so that a panic names the program's line.
        let look = self.shared().look(&mut known, deadline);
        self.known.learn(known);
        let mut areas = self.guard(look?.ok_or_else(timed_out)?);
        // In lock-step each wait asks for a response, also one without time.
        let mut moves_time = self.shared().lock_step;
        while !condition(&areas) {
            let checked = areas.response();
            drop(areas);
            // Responses may come in faster than they can be checked.
            let is_over =
                deadline.is_some_and(|deadline| deadline <= self.shared().state().clock.now());
            if !std::mem::take(&mut moves_time) && is_over {
                return Err(timed_out());
            }
            let wait = |known: &mut Known| self.shared().wait_cycle(known, checked, deadline);
            areas = self.guard(self.learn(wait)?.ok_or_else(timed_out)?);
        }
        self.known.learn(Known { returned: areas.response(), ..Known::default() });
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
        let most = self.shared().state().outgoing().len() as i64 - 1;
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

#[cfg(all(test, not(shuttle)))]
mod tests {
    use std::sync::Arc;
    use std::time::Instant;

    use super::*;
    use crate::exchange::{Inputs, Outgoing};
    use crate::handler::shared::Shared;

    /// Areas of a transfer that is running.
    fn begun() -> TransferAreas {
        TransferAreas::new(Arc::new(Shared::running(None, false)))
    }

    /// A response comes in; its window stays open.
    fn respond(area: &TransferAreas) {
        let nothing = &mut Inputs::default();
        area.shared().deliver(&Inputs::default(), nothing, &mut Inputs::default());
    }

    /// The response that a wait for one `after` another finds immediately.
    fn wait_for(area: &TransferAreas, after: u64) -> Option<TransferAreaGuard<'_>> {
        let wait = |known: &mut Known| area.shared().wait_cycle(known, after, Some(Instant::now()));
        area.learn(wait).unwrap().map(|lease| area.guard(lease))
    }

    #[test]
    fn a_response_that_comes_in_during_the_first_check_is_answered_within_its_window() {
        let area = begun();
        respond(&area);
        area.shared().hold_window(None, Duration::ZERO, &mut [Outgoing::default()]);
        let look = || area.learn(|known| area.shared().look(known, None)).unwrap();
        let first = area.guard(look().unwrap());
        assert_eq!(first.response(), 1, "its window was closed");
        respond(&area);
        drop(first);
        let second = wait_for(&area, 1).unwrap();
        assert_eq!(second.response(), 2);
        assert!(!area.shared().state().next_may_leave(), "the next request has left");
        drop(second);
        assert!(area.shared().state().next_may_leave());
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
