//! Who drives. Only one page does, for all controllers, and only while it shows that it is there.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::trouble::Trouble;

/// How long the driving page may be silent.
pub(crate) const SILENCE_LIMIT: Duration = Duration::from_secs(1);

/// The number of a page's connection.
pub(crate) type Page = u64;

/// The wheel: one page has it, or nobody.
///
/// Each stop and each change of the driver begins another turn. A command belongs to the turn in which it was
/// given, and is carried out in no other. Whoever carries out commands sets all outputs to 0 when it
/// finds another turn than before.
#[derive(Debug, Default)]
pub(crate) struct Wheel {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    driver: Option<Driver>,
    turn: u64,
    freed: Option<Freed>,
}

/// Why the last driver drives no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Freed {
    /// It has let go.
    Left,
    /// Somebody has pressed the stop, or the driver has sent nonsense.
    Stop,
    /// It was silent.
    Silent,
    /// This program did not look after a controller for too long.
    Hang,
}

#[derive(Debug)]
struct Driver {
    page: Page,
    last_sign: Instant,
}

impl Wheel {
    /// The present driver and the present turn.
    pub(crate) fn look(&self) -> (Option<Page>, u64) {
        let state = self.state();
        (state.page(), state.turn)
    }

    /// The present driver; if nobody drives, why the last one does not.
    pub(crate) fn driver(&self) -> Result<Page, Option<Freed>> {
        let state = self.state();
        state.page().ok_or(state.freed)
    }

    /// This page is there.
    pub(crate) fn sign_of_life(&self, page: Page) {
        if let Some(driver) = self.state().driver.as_mut().filter(|driver| driver.page == page) {
            driver.last_sign = Instant::now();
        }
    }

    /// This page wants to drive, if nobody else does.
    pub(crate) fn drive(&self, page: Page) -> Result<(), Trouble> {
        let mut state = self.state();
        match state.page() {
            Some(driver) if driver == page => Ok(()),
            Some(_) => Err(Trouble::new("taken", "another page drives; take the wheel from it")),
            None => {
                state.hand_to(page);
                Ok(())
            }
        }
    }

    /// This page drives from now on, whoever did before.
    pub(crate) fn take(&self, page: Page) {
        let mut state = self.state();
        if state.page() != Some(page) {
            state.hand_to(page);
        }
    }

    /// This page does not drive any more. Returns whether it did.
    pub(crate) fn release(&self, page: Page) -> bool {
        let mut state = self.state();
        let drove = state.page() == Some(page);
        if drove {
            state.free(Freed::Left);
        }
        drove
    }

    /// Begins another turn, in which nobody drives at first.
    ///
    /// Commands of the driver may still be on their way here, also from a page that hangs. They come without
    /// the wheel, so they move nothing.
    pub(crate) fn stop(&self) {
        self.state().free(Freed::Stop);
    }

    /// The same, because this program did not look after a controller for too long.
    pub(crate) fn stop_after_hang(&self) {
        self.state().free(Freed::Hang);
    }

    /// The turn for a command of this page, if it may give one.
    pub(crate) fn turn_of(&self, page: Page) -> Result<u64, Trouble> {
        let state = self.state();
        if state.page() == Some(page) {
            return Ok(state.turn);
        }
        Err(Trouble::new("not_driving", "this page only looks; it has to take the wheel first"))
    }

    /// The state, without a driver that was silent for too long.
    fn state(&self) -> MutexGuard<'_, State> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let silent = |driver: &Driver| driver.last_sign.elapsed() > SILENCE_LIMIT;
        if state.driver.as_ref().is_some_and(silent) {
            state.free(Freed::Silent);
        }
        state
    }
}

impl State {
    fn page(&self) -> Option<Page> {
        self.driver.as_ref().map(|driver| driver.page)
    }

    fn hand_to(&mut self, page: Page) {
        self.driver = Some(Driver { page, last_sign: Instant::now() });
        self.turn += 1;
    }

    fn free(&mut self, why: Freed) {
        // Who did not drive has lost nothing: the reason of the last driver stays.
        if self.driver.take().is_some() {
            self.freed = Some(why);
        }
        self.turn += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_page_drives_until_it_lets_go() {
        let wheel = Wheel::default();
        assert_eq!(wheel.turn_of(1).unwrap_err().code, "not_driving");
        wheel.drive(1).unwrap();
        let turn = wheel.turn_of(1).unwrap();
        wheel.drive(1).unwrap();
        assert_eq!(wheel.turn_of(1).unwrap(), turn, "it drives already");
        assert_eq!(wheel.drive(2).unwrap_err().code, "taken");
        assert!(!wheel.release(2));
        assert_eq!(wheel.look(), (Some(1), turn));
        assert!(wheel.release(1));
        assert!(wheel.look().1 > turn);
        wheel.drive(2).unwrap();
    }

    #[test]
    fn taking_the_wheel_and_stopping_begin_another_turn() {
        let wheel = Wheel::default();
        wheel.drive(1).unwrap();
        let first = wheel.turn_of(1).unwrap();
        wheel.take(2);
        let second = wheel.turn_of(2).unwrap();
        assert!(second > first);
        assert_eq!(wheel.turn_of(1).unwrap_err().code, "not_driving");
        wheel.stop();
        assert_eq!(wheel.turn_of(2).unwrap_err().code, "not_driving");
        assert!(wheel.look().1 > second);
    }

    #[test]
    fn a_silent_page_loses_the_wheel() {
        let wheel = Wheel::default();
        wheel.drive(1).unwrap();
        let turn = wheel.turn_of(1).unwrap();
        let long_ago = Instant::now().checked_sub(2 * SILENCE_LIMIT).unwrap();
        wheel.state().driver.as_mut().unwrap().last_sign = long_ago;
        assert_eq!(wheel.look(), (None, turn + 1));
        assert_eq!(wheel.driver(), Err(Some(Freed::Silent)));
        wheel.sign_of_life(1);
        assert_eq!(wheel.look().0, None, "it has to ask again");
    }

    #[test]
    fn the_last_driver_learns_why_it_drives_no_more() {
        let wheel = Wheel::default();
        assert_eq!(wheel.driver(), Err(None));
        let ends: [fn(&Wheel); 3] =
            [|wheel| assert!(wheel.release(1)), Wheel::stop_after_hang, Wheel::stop];
        for (free, why) in ends.iter().zip([Freed::Left, Freed::Hang, Freed::Stop]) {
            wheel.drive(1).unwrap();
            assert_eq!(wheel.driver(), Ok(1));
            free(&wheel);
            assert_eq!(wheel.driver(), Err(Some(why)));
        }
        wheel.stop_after_hang();
        assert_eq!(wheel.driver(), Err(Some(Freed::Stop)), "nobody has lost the wheel by it");
    }
}
