//! Who drives. Only one page does, for all controllers, and only while it shows that it is there.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

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
                state.hand_to(Some(page));
                Ok(())
            }
        }
    }

    /// This page drives from now on, whoever did before.
    pub(crate) fn take(&self, page: Page) {
        let mut state = self.state();
        if state.page() != Some(page) {
            state.hand_to(Some(page));
        }
    }

    /// This page does not drive any more. Returns whether it did.
    pub(crate) fn release(&self, page: Page) -> bool {
        let mut state = self.state();
        let drove = state.page() == Some(page);
        if drove {
            state.hand_to(None);
        }
        drove
    }

    /// Begins another turn, in which nobody drives at first.
    ///
    /// Commands of the driver may still be on their way here, also from a page that hangs. They come without
    /// the wheel, so they move nothing.
    pub(crate) fn stop(&self) {
        self.state().hand_to(None);
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
            state.hand_to(None);
        }
        state
    }
}

impl State {
    fn page(&self) -> Option<Page> {
        self.driver.as_ref().map(|driver| driver.page)
    }

    fn hand_to(&mut self, page: Option<Page>) {
        self.driver = page.map(|page| Driver { page, last_sign: Instant::now() });
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
        wheel.sign_of_life(1);
        assert_eq!(wheel.look().0, None, "it has to ask again");
    }
}
