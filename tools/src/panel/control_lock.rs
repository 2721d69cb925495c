//! Who drives. Only one page does, for all controllers, and only while it shows that it is there.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::problem::Problem;

/// How long the driving page may be silent.
pub(crate) const SILENCE_LIMIT: Duration = Duration::from_secs(1);

/// The number of a page's connection.
pub(crate) type PageId = u64;

/// The control over all controllers: one page has it, or nobody.
///
/// Each stop and each change of the driver begins a new lease. A command belongs to the lease under which it was
/// given, and is carried out under no other. Whoever carries out commands sets all outputs to 0 when it
/// finds another lease than before.
#[derive(Debug, Default)]
pub(crate) struct ControlLock {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    driver: Option<Driver>,
    lease: u64,
    freed: Option<ReleaseReason>,
}

/// Why the last driver drives no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ReleaseReason {
    /// It has let go.
    Left,
    /// Somebody has pressed the stop, or the driver has sent nonsense.
    Stop,
    /// It was silent.
    Silent,
    /// This program did not check a controller for too long.
    Hang,
}

#[derive(Debug)]
struct Driver {
    page: PageId,
    last_sign: Instant,
}

impl ControlLock {
    /// The number of the present lease.
    pub(crate) fn lease(&self) -> u64 {
        self.state().lease
    }

    /// The present driver; if nobody drives, why the last one does not.
    pub(crate) fn driver(&self) -> Result<PageId, Option<ReleaseReason>> {
        let state = self.state();
        state.page().ok_or(state.freed)
    }

    /// This page is there.
    pub(crate) fn sign_of_life(&self, page: PageId) {
        if let Some(driver) = self.state().driver.as_mut().filter(|driver| driver.page == page) {
            driver.last_sign = Instant::now();
        }
    }

    /// This page wants to drive, if nobody else does.
    pub(crate) fn drive(&self, page: PageId) -> Result<(), Problem> {
        let mut state = self.state();
        match state.page() {
            Some(driver) if driver == page => Ok(()),
            Some(_) => Err(Problem::new("taken", "another page drives; take control from it")),
            None => {
                state.hand_to(page);
                Ok(())
            }
        }
    }

    /// This page drives from now on, whoever did before, in a new lease.
    pub(crate) fn take(&self, page: PageId) {
        self.state().hand_to(page);
    }

    /// This page does not drive any more. Returns whether it did.
    pub(crate) fn release(&self, page: PageId) -> bool {
        let mut state = self.state();
        let drove = state.page() == Some(page);
        if drove {
            state.free(ReleaseReason::Left);
        }
        drove
    }

    /// Begins a new lease, under which nobody drives at first.
    ///
    /// Commands of the driver may still be on their way here, also from a page that hangs. They belong to an
    /// earlier lease, so they move nothing.
    pub(crate) fn stop(&self) {
        self.state().free(ReleaseReason::Stop);
    }

    /// The same, because this program did not check a controller for too long.
    pub(crate) fn stop_after_hang(&self) {
        self.state().free(ReleaseReason::Hang);
    }

    /// The lease of a command of this page, if it may give one.
    pub(crate) fn lease_of(&self, page: PageId) -> Result<u64, Problem> {
        let state = self.state();
        if state.page() == Some(page) {
            return Ok(state.lease);
        }
        Err(Problem::new("not_driving", "this page only looks; it has to take control first"))
    }

    /// The state, without a driver that was silent for too long.
    fn state(&self) -> MutexGuard<'_, State> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let silent = |driver: &Driver| driver.last_sign.elapsed() > SILENCE_LIMIT;
        if state.driver.as_ref().is_some_and(silent) {
            state.free(ReleaseReason::Silent);
        }
        state
    }
}

impl State {
    fn page(&self) -> Option<PageId> {
        self.driver.as_ref().map(|driver| driver.page)
    }

    fn hand_to(&mut self, page: PageId) {
        self.driver = Some(Driver { page, last_sign: Instant::now() });
        self.lease += 1;
    }

    fn free(&mut self, why: ReleaseReason) {
        // A page that did not drive has lost nothing: the reason of the last driver stays.
        if self.driver.take().is_some() {
            self.freed = Some(why);
        }
        self.lease += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_page_drives_until_it_lets_go() {
        let control = ControlLock::default();
        assert_eq!(control.lease_of(1).unwrap_err().code, "not_driving");
        control.drive(1).unwrap();
        let lease = control.lease_of(1).unwrap();
        control.drive(1).unwrap();
        assert_eq!(control.lease_of(1).unwrap(), lease, "it drives already");
        assert_eq!(control.drive(2).unwrap_err().code, "taken");
        assert!(!control.release(2));
        assert_eq!((control.driver(), control.lease()), (Ok(1), lease));
        assert!(control.release(1));
        assert!(control.lease() > lease);
        control.drive(2).unwrap();
    }

    #[test]
    fn taking_the_wheel_and_stopping_begin_another_turn() {
        let control = ControlLock::default();
        control.drive(1).unwrap();
        let first = control.lease_of(1).unwrap();
        control.take(2);
        let second = control.lease_of(2).unwrap();
        assert!(second > first);
        assert_eq!(control.lease_of(1).unwrap_err().code, "not_driving");
        control.stop();
        assert_eq!(control.lease_of(2).unwrap_err().code, "not_driving");
        assert!(control.lease() > second);
    }

    #[test]
    fn a_silent_page_loses_the_wheel() {
        let control = ControlLock::default();
        control.drive(1).unwrap();
        let lease = control.lease_of(1).unwrap();
        let long_ago = Instant::now().checked_sub(2 * SILENCE_LIMIT).unwrap();
        control.state().driver.as_mut().unwrap().last_sign = long_ago;
        assert_eq!(control.driver(), Err(Some(ReleaseReason::Silent)));
        assert_eq!(control.lease(), lease + 1);
        control.sign_of_life(1);
        assert!(control.driver().is_err(), "it has to ask again");
    }

    #[test]
    fn the_last_driver_learns_why_it_drives_no_more() {
        let control = ControlLock::default();
        assert_eq!(control.driver(), Err(None));
        let ends: [fn(&ControlLock); 3] = [
            |control| assert!(control.release(1)),
            ControlLock::stop_after_hang,
            ControlLock::stop,
        ];
        for (free, why) in
            ends.iter().zip([ReleaseReason::Left, ReleaseReason::Hang, ReleaseReason::Stop])
        {
            control.drive(1).unwrap();
            assert_eq!(control.driver(), Ok(1));
            free(&control);
            assert_eq!(control.driver(), Err(Some(why)));
        }
        control.stop_after_hang();
        assert_eq!(
            control.driver(),
            Err(Some(ReleaseReason::Stop)),
            "nobody has lost control by it"
        );
    }
}
