//! What the threads of a simulated TXT and its owner share.

use std::fmt;
use std::mem;
use std::time::{Duration, Instant};

use mio::Waker;
use parking_lot::{Condvar, Mutex};

use crate::machine::journal::{notice, About, Subject};
use crate::machine::Machine;
use crate::server::pause::Timing;
use crate::END_LIMIT;

/// The simulated TXT is being dropped, and its threads should end.
#[derive(Debug)]
pub(crate) struct Stopped;

/// What the threads and their owner share.
pub(crate) struct Shared {
    /// What the lines that are logged about it begin with.
    subject: Subject,
    machine: Mutex<Machine>,
    /// The machine may have changed.
    changed: Condvar,
    /// Something has changed that the camera's thread may wait for.
    camera_changed: Condvar,
    stopping: Mutex<bool>,
    stopped: Condvar,
    /// How waits for the pace and the camera end.
    timing: Timing,
    /// One for each thread that waits for sockets.
    wakers: Mutex<Vec<ThreadWaker>>,
}

/// Wakes a thread that waits for sockets.
struct ThreadWaker {
    waker: Waker,
    follows: bool,
}

impl Shared {
    pub(crate) fn new(machine: Machine, subject: Subject) -> Self {
        Self { subject, ..Self::with_timing(machine, Timing::OF_SYSTEM) }
    }

    fn with_timing(machine: Machine, timing: Timing) -> Self {
        Self {
            subject: None,
            machine: Mutex::new(machine),
            changed: Condvar::new(),
            camera_changed: Condvar::new(),
            stopping: Mutex::new(false),
            stopped: Condvar::new(),
            timing,
            wakers: Mutex::new(Vec::new()),
        }
    }

    /// Logs an error of it, in a thread of the program.
    pub(crate) fn log_error(&self, line: fmt::Arguments<'_>) {
        let _about = About::begin(self.subject.clone());
        notice!(Error, "{line}");
    }

    /// Wakes one more thread when the threads should end; one that follows sessions also when the camera or the I2C
    /// server starts or ends.
    pub(crate) fn add_waker(&self, waker: Waker, follows: bool) {
        self.wakers.lock().push(ThreadWaker { waker, follows });
    }

    /// Reads or changes the machine as it is now.
    pub(crate) fn with_machine<R>(&self, f: impl FnOnce(&mut Machine) -> R) -> R {
        let _about = About::begin(self.subject.clone());
        let mut machine = self.machine.lock();
        machine.catch_up();
        let (run, time) = (machine.camera_run(), machine.camera_time());
        let session = machine.i2c_session();
        let result = f(&mut machine);
        let is_other_run = machine.camera_run() != run;
        let is_other_session = is_other_run || machine.i2c_session() != session;
        let is_camera_changed = is_other_run || machine.camera_time() != time;
        drop(machine);
        self.changed.notify_all();
        if is_camera_changed {
            self.camera_changed.notify_all();
        }
        if is_other_session {
            self.wake(|thread| thread.follows);
        }
        result
    }

    /// Reads the machine as it was left. Wakes no thread that waits for a change.
    pub(crate) fn read<R>(&self, f: impl FnOnce(&Machine) -> R) -> R {
        f(&self.machine.lock())
    }

    /// Waits until the condition holds, at most for the limit. Returns whether it holds.
    pub(crate) fn wait_until(
        &self,
        limit: Duration,
        mut condition: impl FnMut(&Machine) -> bool,
    ) -> bool {
        let deadline = Instant::now().checked_add(limit);
        let mut machine = self.machine.lock();
        loop {
            machine.catch_up();
            if condition(&machine) {
                return true;
            }
            let now = Instant::now();
            if deadline.is_some_and(|deadline| deadline <= now) {
                return false;
            }
            // A watchdog changes the machine without a command.
            let watchdog = machine.watchdog_limit().map(|left| now + left);
            match deadline.into_iter().chain(watchdog).min() {
                Some(wake) => drop(self.changed.wait_until(&mut machine, wake)),
                None => self.changed.wait(&mut machine),
            }
        }
    }

    /// Waits for the camera until `look` has a result. Until then it returns after which time it has to look
    /// again, if the camera does not change before.
    pub(crate) fn wait_for_camera<R>(
        &self,
        look: impl Fn(&Machine) -> Result<R, Duration>,
    ) -> Result<R, Stopped> {
        let mut machine = self.machine.lock();
        loop {
            self.check()?;
            let limit = match look(&machine) {
                Ok(result) => return Ok(result),
                Err(limit) => limit,
            };
            let deadline = Instant::now().checked_add(limit);
            self.timing.wait_until(&self.camera_changed, &mut machine, deadline);
        }
    }

    /// Tells the threads to end.
    pub(crate) fn stop(&self) {
        self.stop_until(Instant::now() + END_LIMIT);
    }

    /// The same. A script that runs has the machine, and is waited for until then.
    pub(crate) fn stop_until(&self, deadline: Instant) {
        /// Longer than a thread needs that only looks at the machine.
        const LEAST: Duration = Duration::from_millis(10);
        if mem::replace(&mut *self.stopping.lock(), true) {
            return;
        }
        self.stopped.notify_all();
        // The camera's thread may have checked this and not wait yet: it has the machine until then.
        drop(self.machine.try_lock_until(deadline.max(Instant::now() + LEAST)));
        self.camera_changed.notify_all();
        self.wake(|_| true);
    }

    /// Wakes these threads, if they wait for sockets.
    fn wake(&self, which: impl Fn(&ThreadWaker) -> bool) {
        let wakers = self.wakers.lock();
        let woken = wakers.iter().filter(|thread| which(thread)).map(|thread| thread.waker.wake());
        let failed = woken.filter_map(Result::err).last();
        drop(wakers);
        if let Some(error) = failed {
            self.log_error(format_args!("a thread of the simulated TXT can't be woken: {error}"));
        }
    }

    /// Whether the thread may go on.
    pub(crate) fn check(&self) -> Result<(), Stopped> {
        if *self.stopping.lock() {
            return Err(Stopped);
        }
        Ok(())
    }

    /// Waits for this time, or until the thread should end.
    pub(crate) fn sleep(&self, time: Duration) -> Result<(), Stopped> {
        if time.is_zero() {
            return self.check();
        }
        let deadline = Instant::now().checked_add(time);
        let mut stopping = self.stopping.lock();
        while !*stopping && !self.timing.wait_until(&self.stopped, &mut stopping, deadline) {}
        if *stopping {
            return Err(Stopped);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    const MOMENT: Duration = Duration::from_millis(5);

    #[test]
    fn a_rest_lasts_its_time_or_until_the_threads_should_end() {
        for timing in [Timing::Fine, Timing::Coarse] {
            let shared = Shared::with_timing(Machine::new(0), timing);
            let begin = Instant::now();
            for _ in 0..5 {
                shared.sleep(MOMENT).unwrap();
            }
            assert!(begin.elapsed() >= 5 * MOMENT);
            thread::scope(|scope| {
                let shared = &shared;
                let rests = [Duration::from_secs(3600), Duration::MAX]
                    .map(|time| scope.spawn(move || shared.sleep(time).is_err()));
                shared.stop();
                for rest in rests {
                    assert!(rest.join().unwrap());
                }
            });
            assert!(shared.sleep(Duration::ZERO).is_err());
        }
    }
}
