//! What the threads of a simulated TXT and its owner share.

use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use parking_lot::{Condvar, Mutex};

use super::machine::Machine;
use crate::pause::Clock;

/// How often a thread that waits for its socket checks whether it should end.
pub(super) const POLL: Duration = Duration::from_millis(5);

/// The simulated TXT is being dropped, and its threads should end.
#[derive(Debug)]
pub(super) struct Stopped;

/// What the threads and their owner share.
pub(super) struct Shared {
    machine: Mutex<Machine>,
    /// The machine may have changed.
    changed: Condvar,
    stopping: Mutex<bool>,
    stopped: Condvar,
    /// The clock for the pace.
    clock: Clock,
}

impl Shared {
    pub(super) fn new(machine: Machine) -> Self {
        Self::with_clock(machine, Clock::OF_SYSTEM)
    }

    fn with_clock(machine: Machine, clock: Clock) -> Self {
        Self {
            machine: Mutex::new(machine),
            changed: Condvar::new(),
            stopping: Mutex::new(false),
            stopped: Condvar::new(),
            clock,
        }
    }

    /// Reads or changes the machine.
    pub(super) fn with_machine<R>(&self, f: impl FnOnce(&mut Machine) -> R) -> R {
        let result = f(&mut self.machine.lock());
        self.changed.notify_all();
        result
    }

    /// Reads the machine. Wakes no thread that waits for a change.
    pub(super) fn look<R>(&self, f: impl FnOnce(&Machine) -> R) -> R {
        f(&self.machine.lock())
    }

    /// Waits until the condition holds, at most for the limit. Returns whether it holds.
    pub(super) fn wait_until(
        &self,
        limit: Duration,
        mut condition: impl FnMut(&Machine) -> bool,
    ) -> bool {
        let mut machine = self.machine.lock();
        let waited =
            self.changed.wait_while_for(&mut machine, |machine| !condition(machine), limit);
        !waited.timed_out() || condition(&machine)
    }

    /// Tells the threads to end.
    pub(super) fn stop(&self) {
        *self.stopping.lock() = true;
        self.stopped.notify_all();
    }

    /// Waits for this time, or until the thread should end.
    pub(super) fn rest(&self, time: Duration) -> Result<(), Stopped> {
        let mut stopping = self.stopping.lock();
        self.clock.wait_while_for(&self.stopped, &mut stopping, time, |stopping| !*stopping);
        if *stopping {
            return Err(Stopped);
        }
        Ok(())
    }

    /// Waits for a client of a listener that does not block. `port` is its name in the log.
    ///
    /// Reading from the connection times out after [`POLL`].
    pub(super) fn accept(&self, listener: &TcpListener, port: &str) -> Result<TcpStream, Stopped> {
        loop {
            if let Some((stream, client)) = try_accept(listener) {
                log::info!("{client} connects to the {port} port");
                return Ok(stream);
            }
            self.rest(POLL)?;
        }
    }
}

/// A client that waits to be accepted, if there is one. The listener does not block.
pub(super) fn try_accept(listener: &TcpListener) -> Option<(TcpStream, SocketAddr)> {
    match accept(listener) {
        Ok(accepted) => Some(accepted),
        Err(error) if is_due_to_waiting(&error) => None,
        // A client that has closed again, or too many open files: the next client may succeed.
        Err(error) => {
            log::warn!("a client could not be accepted: {error}");
            None
        }
    }
}

fn accept(listener: &TcpListener) -> io::Result<(TcpStream, SocketAddr)> {
    let (stream, client) = listener.accept()?;
    // Some systems pass the listener's mode on.
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(POLL))?;
    Ok((stream, client))
}

/// Whether nothing has arrived yet, or a signal came instead.
pub(super) fn is_due_to_waiting(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};

    matches!(error.kind(), Interrupted | TimedOut | WouldBlock)
}

#[cfg(test)]
mod tests {
    use std::thread;
    use std::time::Instant;

    use super::*;

    #[test]
    fn a_rest_lasts_its_time_or_until_the_threads_should_end() {
        for clock in [Clock::Fine, Clock::Coarse] {
            let shared = Shared::with_clock(Machine::new(0), clock);
            let begin = Instant::now();
            for _ in 0..5 {
                shared.rest(POLL).unwrap();
            }
            assert!(begin.elapsed() >= 5 * POLL);
            thread::scope(|scope| {
                let shared = &shared;
                let rests = [Duration::from_secs(3600), Duration::MAX]
                    .map(|time| scope.spawn(move || shared.rest(time).is_err()));
                shared.stop();
                for rest in rests {
                    assert!(rest.join().unwrap());
                }
            });
            assert!(shared.rest(Duration::ZERO).is_err());
        }
    }
}
