//! What a transfer is doing, and why it should stop.

use std::time::{Duration, Instant};

use crate::error::Error;

/// Why a transfer stops although the connection works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stop {
    /// The program asks for it.
    Asked,
    /// A thread of the program panicked.
    ProgramPanicked,
}

impl Stop {
    /// How the transfer ends.
    pub(crate) fn result(self) -> Result<(), Error> {
        match self {
            Self::Asked => Ok(()),
            Self::ProgramPanicked => Err(Error::ProgramPanicked),
        }
    }
}

/// What a transfer is doing, which decides what the program may do with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    /// There is no transfer.
    #[default]
    Idle,
    /// A thread of the program connects.
    Beginning,
    /// Outputs and inputs are exchanged.
    Running,
    /// The connection was lost and is being re-established.
    Reconnecting,
    /// The last exchange is in progress.
    Ending,
}

/// The state of a transfer. Only calls here change it.
#[derive(Debug, Default)]
pub(crate) struct Transfer {
    phase: Phase,
    /// How the last one, or the attempt to begin one, has ended; until the next begins.
    error: Option<Error>,
    /// Why the current transfer is to stop.
    stop: Option<Stop>,
    /// Counts the transfers, also those that could not begin, so that a waiting thread knows its own.
    number: u64,
    began: Option<Instant>,
    /// How long the last one took.
    lasted: Duration,
}

impl Transfer {
    /// A thread begins to connect.
    pub(crate) fn begin(&mut self) -> Result<(), Error> {
        if self.phase != Phase::Idle {
            return Err(Error::AlreadyStarted);
        }
        self.phase = Phase::Beginning;
        self.error = None;
        self.number += 1;
        Ok(())
    }

    /// The connection is made; returns an error when the transfer was stopped meanwhile.
    pub(crate) fn run(&mut self, now: Instant) -> Result<(), Stop> {
        if let Some(stop) = self.stop {
            return Err(stop);
        }
        self.phase = Phase::Running;
        self.began = Some(now);
        Ok(())
    }

    /// The connection is lost, and another one is to be made.
    pub(crate) fn reconnect(&mut self) {
        self.phase = Phase::Reconnecting;
    }

    /// A response has come in, so a connection that was lost is re-established.
    pub(crate) fn resume(&mut self) {
        if self.phase == Phase::Reconnecting {
            self.phase = Phase::Running;
        }
    }

    /// The last exchange begins.
    pub(crate) fn leave(&mut self) {
        self.phase = Phase::Ending;
    }

    /// The transfer has ended, or could not begin.
    pub(crate) fn end(&mut self, now: Instant, error: Option<Error>) {
        self.lasted = self.elapsed(now);
        self.began = None;
        self.stop = None;
        self.phase = Phase::Idle;
        self.error = error;
    }

    /// Asks the current transfer, if any, to stop. The first reason counts.
    pub(crate) fn ask_to_stop(&mut self, stop: Stop) {
        if self.phase != Phase::Idle {
            self.stop.get_or_insert(stop);
        }
    }

    pub(crate) fn stop(&self) -> Option<Stop> {
        self.stop
    }

    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Whether a transfer has begun and not ended.
    pub(crate) fn is_running(&self) -> bool {
        matches!(self.phase, Phase::Running | Phase::Reconnecting | Phase::Ending)
    }

    pub(crate) fn is_beginning(&self) -> bool {
        self.phase == Phase::Beginning
    }

    /// Whether writes of any thread go out with the next request.
    pub(crate) fn is_exchanging(&self) -> bool {
        self.phase == Phase::Running
    }

    /// Returns an error with the reason if no transfer is running.
    pub(crate) fn check_running(&self) -> Result<(), Error> {
        if self.is_running() {
            return Ok(());
        }
        Err(self.error().unwrap_or(Error::NotStarted))
    }

    /// The error that ended the last transfer, until the next begins.
    pub(crate) fn error(&self) -> Option<Error> {
        self.error.clone()
    }

    /// When the transfer began, while it is running.
    pub(crate) fn began(&self) -> Option<Instant> {
        self.began
    }

    /// How long the transfer has been running, or how long the last one ran.
    pub(crate) fn elapsed(&self, now: Instant) -> Duration {
        self.began.map_or(self.lasted, |began| now.saturating_duration_since(began))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running() -> Transfer {
        let mut transfer = Transfer::default();
        transfer.begin().unwrap();
        transfer.run(Instant::now()).unwrap();
        transfer
    }

    #[test]
    fn there_can_be_only_one_transfer() {
        let mut transfer = Transfer::default();
        assert_eq!(transfer.check_running(), Err(Error::NotStarted));
        transfer.begin().unwrap();
        assert_eq!(transfer.begin(), Err(Error::AlreadyStarted));
        assert!(!transfer.is_running());
        transfer.run(Instant::now()).unwrap();
        assert_eq!(transfer.begin(), Err(Error::AlreadyStarted));
        transfer.leave();
        assert_eq!(transfer.begin(), Err(Error::AlreadyStarted));
        assert!(transfer.is_running());
        transfer.end(Instant::now(), None);
        assert_eq!(transfer.begin(), Ok(()));
    }

    #[test]
    fn a_panic_while_it_begins_is_not_forgotten() {
        let mut transfer = Transfer::default();
        transfer.begin().unwrap();
        transfer.ask_to_stop(Stop::ProgramPanicked);
        assert_eq!(transfer.run(Instant::now()), Err(Stop::ProgramPanicked));
        assert!(!transfer.is_running());
    }

    #[test]
    fn the_first_reason_to_stop_counts_and_ends_with_its_transfer() {
        let mut transfer = running();
        transfer.ask_to_stop(Stop::Asked);
        transfer.ask_to_stop(Stop::ProgramPanicked);
        assert_eq!(transfer.stop(), Some(Stop::Asked));
        transfer.end(Instant::now(), None);
        transfer.ask_to_stop(Stop::ProgramPanicked);
        assert_eq!(transfer.stop(), None, "there is nothing to stop");
    }

    #[test]
    fn the_error_of_the_end_stays_until_the_next_begin() {
        let mut transfer = running();
        transfer.end(Instant::now(), Some(Error::ProgramPanicked));
        assert_eq!(transfer.check_running(), Err(Error::ProgramPanicked));
        transfer.begin().unwrap();
        assert_eq!(transfer.error(), None);
    }

    #[test]
    fn its_time_stops_at_the_end() {
        let (begin, ms) = (Instant::now(), Duration::from_millis);
        let mut transfer = Transfer::default();
        transfer.begin().unwrap();
        transfer.run(begin).unwrap();
        assert_eq!(transfer.elapsed(begin + ms(5)), ms(5));
        transfer.end(begin + ms(7), None);
        assert_eq!(transfer.elapsed(begin + ms(9)), ms(7));
    }
}
