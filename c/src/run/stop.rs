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
    retry(|| stop_once(host), has_no_thread)
}

/// The same when the program has ended, and nobody tries it later: again and again for some time, unless a second signal
/// gives it up.
pub(crate) fn stop_in_time(host: &str) -> Result<String, Error> {
    retry(|| stop_once(host), |_| !signals::gives_up())
}

fn stop_once(host: &str) -> Result<String, Error> {
    let stopped = stop_controller(host, TimeLimits::default())?;
    Ok(stopped.name().replace(char::is_control, "?"))
}

fn has_no_thread(error: &Error) -> bool {
    matches!(error, Error::ThreadNotStarted { .. })
}

/// Tries it again after these errors, for some time.
fn retry<T>(
    attempt: impl Fn() -> Result<T, Error>,
    is_to_retry: impl Fn(&Error) -> bool,
) -> Result<T, Error> {
    let begin = Instant::now();
    loop {
        match attempt() {
            Err(error) if begin.elapsed() < TRIES && is_to_retry(&error) => thread::sleep(RETRY),
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
        assert!(retry(attempt, has_no_thread).is_ok());
        assert!(matches!(retry(attempt, has_no_thread), Err(Error::NotStarted)));
        assert_eq!(tries.get(), 4);
    }
}
