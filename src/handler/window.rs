//! The reaction window: the time after a response in which the program may answer it.

/// Who waits for a response, who is answering it, and which responses the outputs have answered.
///
/// Responses are counted over all transfers. The window of a response opens when the program is told
/// of it and closes when the outputs for the next request are taken.
#[derive(Debug, Default)]
pub(super) struct Window {
    /// The newest response whose window was opened.
    response: u64,
    open: bool,
    /// Threads that wait for the next response.
    waiting: usize,
    /// Threads that have waited for this response and have not dropped their guards.
    reacting: usize,
    /// Whether there was any such thread.
    used: bool,
    /// The newest response that was known when outputs were taken.
    answered: u64,
}

impl Window {
    /// The newest response whose window was opened.
    pub(super) fn response(&self) -> u64 {
        self.response
    }

    /// A thread begins to wait for the next response.
    pub(super) fn expect(&mut self) {
        self.waiting += 1;
    }

    /// A thread ends its wait that began when `response` was the newest, without answering.
    pub(super) fn give_up(&mut self, response: u64) {
        if self.response == response {
            self.waiting -= 1;
        } else {
            self.react(response + 1);
        }
    }

    /// Opens the window of a response: all who wait are expected to answer. Tells how many they are.
    pub(super) fn open(&mut self, response: u64) -> usize {
        self.response = response;
        self.open = true;
        self.reacting = std::mem::take(&mut self.waiting);
        self.used = self.reacting > 0;
        self.reacting
    }

    /// Has the next request wait for the calling thread; tells for which response, unless its window
    /// is closed.
    pub(super) fn join(&mut self) -> Option<u64> {
        if !self.open {
            return None;
        }
        self.reacting += 1;
        self.used = true;
        Some(self.response)
    }

    /// A guard is dropped that has waited for this response, or the thread that has does without one.
    pub(super) fn react(&mut self, response: u64) {
        if self.is_open_for(response) {
            self.reacting -= 1;
        }
    }

    /// Whether the next request waits for those who answer this response.
    pub(super) fn is_open_for(&self, response: u64) -> bool {
        self.open && response == self.response
    }

    /// Whether the outputs were taken that answer the response `newest`.
    pub(super) fn is_answered(&self, newest: u64) -> bool {
        newest <= self.answered
    }

    /// Whether threads have waited for this response and all have reacted.
    pub(super) fn is_attended(&self) -> bool {
        self.used && self.reacting == 0
    }

    /// Closes the window, because outputs are taken that answer the response `newest`.
    pub(super) fn close(&mut self, newest: u64) {
        self.open = false;
        self.reacting = 0;
        self.used = false;
        self.answered = newest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_attended_when_all_who_waited_have_reacted() {
        let mut window = Window::default();
        window.expect();
        window.expect();
        assert!(!window.is_attended());
        window.open(1);
        window.react(1);
        assert!(!window.is_attended());
        window.react(1);
        assert!(window.is_attended());
        window.close(1);
        assert!(!window.is_attended(), "it is over");
    }

    #[test]
    fn a_window_for_which_nobody_waits_is_never_attended() {
        let mut window = Window::default();
        assert_eq!(window.open(1), 0);
        assert!(!window.is_attended());
    }

    #[test]
    fn who_comes_while_it_is_open_joins_and_who_comes_later_does_not() {
        let mut window = Window::default();
        assert_eq!(window.join(), None);
        window.open(7);
        assert_eq!(window.join(), Some(7));
        assert!(!window.is_attended());
        window.react(7);
        assert!(window.is_attended());
        window.close(7);
        assert_eq!(window.join(), None);
    }

    #[test]
    fn who_reacts_too_late_is_nobody_whom_the_next_window_waits_for() {
        let mut window = Window::default();
        window.expect();
        window.open(1);
        window.close(1);
        window.expect();
        window.open(2);
        window.react(1);
        assert!(!window.is_attended());
        window.react(2);
        assert!(window.is_attended());
    }

    #[test]
    fn a_response_is_answered_when_its_window_is_closed() {
        let mut window = Window::default();
        assert!(!window.is_answered(1));
        window.open(1);
        assert!(window.is_open_for(1) && !window.is_answered(1));
        window.close(1);
        assert!(!window.is_open_for(1) && window.is_answered(1));
        assert!(!window.is_answered(2), "it has come in, and nobody was told of it yet");
    }

    #[test]
    fn who_gives_up_is_not_expected_any_more() {
        let mut window = Window::default();
        window.expect();
        window.give_up(0);
        window.expect();
        window.open(1);
        // It was told of a response and of an error at the same time, and returns the error.
        window.give_up(0);
        assert!(window.is_attended());
    }
}
