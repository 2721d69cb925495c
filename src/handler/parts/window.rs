//! The reaction window: the time after a response in which the program may answer it.

/// How many threads wait for a response, how many are answering it, and which responses are answered.
///
/// A window opens when the program is woken for a response and closes when the outputs for the next request
/// are taken. Windows are counted over all transfers, and no number is left out: so a thread that waits
/// knows the number of the window that ends its wait. Responses have numbers of their own, because a
/// response may have no window.
#[derive(Debug, Default)]
pub(crate) struct Window {
    /// The newest window.
    number: u64,
    open: bool,
    /// Threads that wait for the next response.
    waiting: usize,
    /// Threads whose wait was ended by an interruption, and that have not noticed it yet.
    leaving: usize,
    /// Threads that have waited for this window and have not dropped their guards.
    reacting: usize,
    /// Whether there was any such thread.
    used: bool,
    /// Whether a thread that was woken for this response comes back for it later.
    put_off: bool,
    /// The newest response when outputs were last taken.
    answered: u64,
    /// The newest response that a guard has answered before its window closed.
    answered_in_time: u64,
}

impl Window {
    /// The newest window.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// A thread begins to wait for the next response.
    pub(crate) fn expect(&mut self) {
        self.waiting += 1;
    }

    /// A thread ends its wait that began when `window` was the newest, without answering.
    pub(crate) fn give_up(&mut self, window: u64) {
        if self.number == window {
            let counted = if self.leaving > 0 { &mut self.leaving } else { &mut self.waiting };
            *counted -= 1;
        } else {
            self.react(window + 1);
        }
    }

    /// An interruption ends the waits of all threads: they do not ask for a response any more.
    pub(crate) fn interrupt(&mut self) {
        self.leaving += std::mem::take(&mut self.waiting);
    }

    /// Opens the window of a response: all waiting threads are expected to answer. Returns how many.
    pub(crate) fn open(&mut self) -> usize {
        self.number += 1;
        self.open = true;
        self.reacting = std::mem::take(&mut self.waiting) + std::mem::take(&mut self.leaving);
        self.used = self.reacting > 0;
        self.put_off = false;
        self.reacting
    }

    /// Makes the next request wait for the calling thread; returns the window's number, unless it is closed.
    pub(crate) fn join(&mut self) -> Option<u64> {
        if !self.open {
            return None;
        }
        self.reacting += 1;
        self.used = true;
        self.put_off = false;
        Some(self.number)
    }

    /// A thread that has waited for this window drops its guard, or does not take one.
    pub(crate) fn react(&mut self, window: u64) {
        if self.is_open_for(window) {
            self.reacting -= 1;
        }
    }

    /// A thread that was woken for the response comes back for it later; the window stays open until then.
    pub(crate) fn put_off(&mut self) {
        self.reacting -= 1;
        self.put_off = true;
    }

    /// Whether this window is open.
    pub(crate) fn is_open_for(&self, window: u64) -> bool {
        self.open && window == self.number
    }

    /// A guard that showed the response `newest` is dropped; returns whether that is in time for the next
    /// request.
    pub(crate) fn note_answer(&mut self, newest: u64) -> bool {
        let in_time = !self.is_answered(newest);
        if in_time {
            self.answered_in_time = newest;
        }
        in_time
    }

    /// Whether the outputs that answer the response `newest` were taken.
    fn is_answered(&self, newest: u64) -> bool {
        newest <= self.answered
    }

    /// Whether threads have waited for this response and all have reacted.
    pub(crate) fn is_attended(&self) -> bool {
        self.used && self.reacting == 0 && !self.put_off
    }

    /// Whether a thread waits for the next response, and no thread is still answering this one or has still to
    /// learn of an interruption.
    pub(crate) fn is_next_asked_for(&self) -> bool {
        self.waiting > 0 && self.leaving == 0 && self.reacting == 0
    }

    /// Closes the window, because the outputs that answer the response `newest` are taken; returns whether
    /// no guard has answered that response in time.
    pub(crate) fn close(&mut self, newest: u64) -> bool {
        let missed = self.answered_in_time < newest && self.answered < newest;
        self.open = false;
        self.reacting = 0;
        self.used = false;
        self.answered = newest;
        missed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_attended_when_all_waiting_threads_have_reacted() {
        let mut window = Window::default();
        window.expect();
        window.expect();
        assert!(!window.is_attended());
        window.open();
        window.react(1);
        assert!(!window.is_attended());
        window.react(1);
        assert!(window.is_attended());
        window.close(1);
        assert!(!window.is_attended(), "it is over");
    }

    #[test]
    fn a_window_without_waiting_threads_is_never_attended() {
        let mut window = Window::default();
        assert_eq!(window.open(), 0);
        assert!(!window.is_attended());
    }

    #[test]
    fn a_thread_joins_a_window_only_while_it_is_open() {
        let mut window = Window::default();
        assert_eq!(window.join(), None);
        window.open();
        assert_eq!(window.join(), Some(1));
        assert!(!window.is_attended());
        window.react(1);
        assert!(window.is_attended());
        window.close(7);
        assert_eq!(window.join(), None);
    }

    #[test]
    fn a_window_stays_open_until_a_thread_that_put_its_reaction_off_has_come_back() {
        let mut window = Window::default();
        window.expect();
        window.expect();
        window.open();
        window.put_off();
        window.react(1);
        assert!(!window.is_attended());
        assert_eq!(window.join(), Some(1));
        assert!(!window.is_attended());
        window.react(1);
        assert!(window.is_attended());
    }

    #[test]
    fn the_next_response_is_asked_for_when_a_thread_waits_and_none_is_answering() {
        let mut window = Window::default();
        assert!(!window.is_next_asked_for());
        window.expect();
        assert!(window.is_next_asked_for());
        window.open();
        window.expect();
        assert!(!window.is_next_asked_for(), "another thread is answering");
        window.react(1);
        assert!(window.is_next_asked_for());
        window.give_up(1);
        assert!(!window.is_next_asked_for());
    }

    #[test]
    fn a_thread_that_has_not_noticed_an_interruption_asks_for_nothing() {
        let mut window = Window::default();
        window.expect();
        window.interrupt();
        assert!(!window.is_next_asked_for());
        window.expect();
        assert!(!window.is_next_asked_for(), "the first one has still to learn of it");
        window.give_up(0);
        assert!(window.is_next_asked_for());
        window.interrupt();
        window.open();
        assert!(!window.is_attended(), "it is expected until it has left");
        window.give_up(0);
        assert!(window.is_attended());
    }

    #[test]
    fn the_next_window_does_not_wait_for_a_late_reaction_to_the_last_one() {
        let mut window = Window::default();
        window.expect();
        window.open();
        window.close(1);
        window.expect();
        window.open();
        window.react(1);
        assert!(!window.is_attended());
        window.react(2);
        assert!(window.is_attended());
    }

    #[test]
    fn an_answer_is_late_when_the_window_of_its_response_is_closed() {
        let mut window = Window::default();
        window.open();
        assert!(window.note_answer(7));
        assert!(!window.close(7), "it was answered in time");
        assert!(!window.note_answer(7));
        assert!(window.note_answer(8), "it has come in, and no thread was woken for it yet");
    }

    #[test]
    fn a_response_is_missed_when_no_guard_has_answered_it_in_time() {
        let mut window = Window::default();
        window.open();
        assert!(window.note_answer(7));
        window.open();
        assert!(window.note_answer(7), "of the response before");
        assert!(window.close(8));
        assert!(!window.close(8), "once");
        assert!(!window.note_answer(8));
        window.open();
        assert!(window.close(9));
    }

    #[test]
    fn a_thread_that_gives_up_is_not_expected_any_more() {
        let mut window = Window::default();
        window.expect();
        window.give_up(0);
        window.expect();
        window.open();
        // The thread was woken for a response and an error together, and returns the error.
        window.give_up(0);
        assert!(window.is_attended());
    }
}
