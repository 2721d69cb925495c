//! The controllers' displays: messages, frames, and the two buttons below.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use crossbeam_channel::{Receiver, Sender, TrySendError};
use parking_lot::Mutex;

use super::draw::Frame;
use super::screen::{Screen, Show, ShowState};
use crate::memory::AREAS;

/// How much may wait for a terminal that takes nothing. More replaces the oldest.
const WAITING: usize = 256;

/// Shows what programs want to be shown, by a thread of its own: the next tic does not wait for a terminal.
pub(super) struct Display {
    state: Arc<ShowState>,
    sender: Mutex<Option<Sender<Show>>>,
    /// What waits, to take the oldest away.
    waiting: Receiver<Show>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Display {
    /// A display for each of the controllers, the first of which has this name.
    pub(super) fn new(name: &str) -> std::io::Result<Self> {
        let names = (0..AREAS)
            .map(|index| match index {
                0 => name.to_owned(),
                _ => format!("{name}, extension {index}"),
            })
            .collect();
        let state = Arc::new(ShowState::new(names));
        let (sender, shows) = crossbeam_channel::bounded(WAITING);
        let waiting = shows.clone();
        let screen = Screen::new(Arc::clone(&state));
        let thread =
            thread::Builder::new().name("display".into()).spawn(move || screen.run(&shows))?;
        let (sender, thread) = (Mutex::new(Some(sender)), Mutex::new(Some(thread)));
        Ok(Self { state, sender, waiting, thread })
    }

    fn show(&self, show: Show) {
        let sender = self.sender.lock();
        let Some(sender) = &*sender else { return };
        self.state.add_show();
        push(sender, &self.waiting, show, || self.state.leave_out());
    }

    /// Shows a message; `None` takes all messages away.
    pub(super) fn show_message(&self, of: usize, text: Option<String>) {
        self.show(match text {
            Some(text) => Show::Message { of, text },
            None => Show::NoMessages,
        });
    }

    /// Shows a frame; `None` gives the display back.
    pub(super) fn show_frame(&self, of: usize, frame: Option<Box<Frame>>) {
        self.show(match frame {
            Some(frame) => Show::Frame { of, frame },
            None => Show::NoFrame,
        });
    }

    /// Whether something is still to be shown.
    pub(super) fn is_busy(&self) -> bool {
        self.state.is_busy()
    }

    /// For how long the left (0) and the right button (1) have been pressed.
    pub(super) fn button_held(&self, button: usize) -> i16 {
        self.state.buttons.held(button)
    }
}

/// Adds to a queue; `left_out` is called for each that has to make room.
fn push<T>(sender: &Sender<T>, waiting: &Receiver<T>, what: T, left_out: impl Fn()) {
    let mut result = sender.try_send(what);
    while let Err(TrySendError::Full(what)) = result {
        // Another thread may have taken it meanwhile, and there is room.
        if waiting.try_recv().is_ok() {
            left_out();
        }
        result = sender.try_send(what);
    }
}

/// Shows what is left, and leaves the terminal as it was.
impl Drop for Display {
    fn drop(&mut self) {
        drop(self.sender.lock().take());
        if let Some(thread) = self.thread.lock().take() {
            // A panic of it is in the log, and the program is over.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn what_waits_has_a_limit_and_the_oldest_makes_room() {
        let (sender, waiting) = crossbeam_channel::bounded(WAITING);
        let left_out = Cell::new(0);
        for number in 0..1000 {
            push(&sender, &waiting, number, || left_out.set(left_out.get() + 1));
        }
        assert_eq!(left_out.get(), 1000 - WAITING);
        let kept: Vec<_> = waiting.try_iter().collect();
        assert_eq!((kept.len(), kept[0], kept[WAITING - 1]), (WAITING, 1000 - WAITING, 999));
    }
}
