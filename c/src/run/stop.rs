//! Stops a controller whose program has crashed or was killed: a TXT does not stop by itself.

use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::{stop_controller, Error, TimeLimits};

use crate::signals;

/// For how long it is tried again: a network may be away for a moment, the controller start its firmware again, and what
/// the program has left running leave no thread to look up a name.
pub(crate) const TRIES: Duration = Duration::from_secs(10);
const RETRY: Duration = Duration::from_millis(100);

/// Goes online, sends an exchange with all outputs off, also those of extensions, and goes offline.
/// Returns the name of the controller that has answered: another one may have this address by now.
pub(crate) fn stop(host: &str) -> Result<String, Error> {
    let stopped = until_threads_start(|| stop_controller(host, TimeLimits::default()))?;
    Ok(stopped.name().replace(char::is_control, "?"))
}

/// The same when the program has ended, and nobody tries it later: again and again for some time, unless a second signal
/// gives it up.
pub(crate) fn stop_in_time(host: &str) -> Result<String, Error> {
    let begin = Instant::now();
    loop {
        match stop(host) {
            Err(_) if begin.elapsed() < TRIES && !signals::gives_up() => thread::sleep(RETRY),
            done => return done,
        }
    }
}

fn until_threads_start<T>(attempt: impl Fn() -> Result<T, Error>) -> Result<T, Error> {
    let begin = Instant::now();
    loop {
        match attempt() {
            Err(Error::ThreadNotStarted { .. }) if begin.elapsed() < TRIES => thread::sleep(RETRY),
            done => return done,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::io;

    use super::*;

    #[test]
    fn it_is_tried_again_until_a_thread_starts_and_other_errors_are_told_at_once() {
        let tries = Cell::new(0);
        let attempt = || {
            tries.set(tries.get() + 1);
            match tries.get() {
                1 | 2 => {
                    Err(Error::ThreadNotStarted { cause: io::Error::other("too many").into() })
                }
                3 => Ok(()),
                _ => Err(Error::NotStarted),
            }
        };
        assert!(until_threads_start(attempt).is_ok());
        assert!(matches!(until_threads_start(attempt), Err(Error::NotStarted)));
        assert_eq!(tries.get(), 4);
    }
}
