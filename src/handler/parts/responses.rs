//! The newest response, and its reaction window.

use std::time::Instant;

/// The number of the newest response, when it came in, and whether the program may still answer it.
///
/// Its window opens when the program is woken for it, and closes when the outputs for the next request are taken.
#[derive(Debug)]
pub(crate) struct Responses {
    /// Counts the responses of all transfers.
    newest: u64,
    /// When the newest response came in; before the first of a transfer, when the transfer began.
    arrived: Instant,
    /// Whether the newest response came in on this connection.
    of_connection: bool,
    /// Whether the window of the newest response is open.
    open: bool,
    /// The newest response when outputs were last taken.
    taken: u64,
    /// The newest response that a guard has answered before its window closed.
    answered_in_time: u64,
}

impl Responses {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            newest: 0,
            arrived: now,
            of_connection: false,
            open: false,
            taken: 0,
            answered_in_time: 0,
        }
    }

    /// A transfer begins.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.arrived = now;
        self.of_connection = false;
    }

    /// The connection is lost.
    pub(crate) fn lose_connection(&mut self) {
        self.of_connection = false;
    }

    /// A response has come in. Returns when the one before it came in on this connection.
    pub(crate) fn arrive(&mut self, now: Instant) -> Option<Instant> {
        let before = self.last();
        self.newest += 1;
        self.arrived = now;
        self.of_connection = true;
        before
    }

    pub(crate) fn newest(&self) -> u64 {
        self.newest
    }

    pub(crate) fn arrived(&self) -> Instant {
        self.arrived
    }

    /// When the newest response of this connection came in.
    pub(crate) fn last(&self) -> Option<Instant> {
        self.of_connection.then_some(self.arrived)
    }

    /// Opens the window of the newest response.
    pub(crate) fn open(&mut self) {
        self.open = true;
    }

    /// The response whose window is open.
    pub(crate) fn opened(&self) -> Option<u64> {
        self.open.then_some(self.newest)
    }

    /// A guard that showed this response is dropped; returns whether that is in time for the next request.
    pub(crate) fn answer(&mut self, response: u64) -> bool {
        let in_time = response > self.taken;
        if in_time {
            self.answered_in_time = response;
        }
        in_time
    }

    /// Closes the window, because the outputs for the next request are taken; returns whether no guard has answered
    /// the newest response in time.
    pub(crate) fn close(&mut self) -> bool {
        let missed = self.answered_in_time < self.newest && self.taken < self.newest;
        self.open = false;
        self.taken = self.newest;
        missed
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use std::time::Duration;

    use super::*;

    fn opened() -> Responses {
        let mut responses = Responses::new(Instant::now());
        responses.arrive(Instant::now());
        responses.open();
        responses
    }

    #[test]
    fn a_response_is_answered_in_time_until_its_window_closes() {
        let mut responses = opened();
        assert_eq!(responses.opened(), Some(1));
        assert!(responses.answer(1));
        assert!(!responses.close(), "missed");
        assert_eq!(responses.opened(), None);
        assert!(!responses.answer(1), "late");
    }

    #[test]
    fn a_response_that_nobody_has_answered_is_missed_once() {
        let mut responses = opened();
        assert!(responses.close());
        assert!(!responses.close(), "another request without a response between");
        responses.arrive(Instant::now());
        responses.open();
        responses.answer(1);
        assert!(responses.close(), "that answered the one before");
    }

    #[test]
    fn the_time_between_two_responses_is_known_within_a_connection() {
        let (start, ms) = (Instant::now(), Duration::from_millis);
        let mut responses = Responses::new(start);
        assert_eq!(responses.arrive(start + ms(1)), None);
        assert_eq!(responses.arrive(start + ms(2)), Some(start + ms(1)));
        responses.lose_connection();
        assert_eq!(responses.last(), None);
        assert_eq!(responses.arrive(start + ms(3)), None);
        responses.begin(start + ms(4));
        assert_eq!((responses.arrived(), responses.last()), (start + ms(4), None));
        assert_eq!(responses.newest(), 3);
    }
}
