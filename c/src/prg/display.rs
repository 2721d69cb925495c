//! The controllers' displays: messages, frames, and the two buttons below.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Instant;

use parking_lot::Mutex;

use super::draw::Frame;
use super::screen::Screen;
use crate::memory::AREAS;

/// What is to be shown.
pub(super) enum Show {
    Message { of: usize, text: String },
    NoMessages,
    Frame { of: usize, frame: Box<Frame> },
    NoFrame,
}

/// What the thread that shows things and the program share.
pub(super) struct Common {
    /// Of each controller, with the master first.
    pub(super) names: Vec<String>,
    /// How much is still to be shown.
    waiting: AtomicUsize,
    pub(super) buttons: Buttons,
}

impl Common {
    /// Something is shown.
    pub(super) fn is_shown(&self) {
        self.waiting.fetch_sub(1, Ordering::AcqRel);
    }
}

/// The buttons of the master's display: since when they are pressed.
pub(super) struct Buttons {
    begun: Instant,
    /// Milliseconds since `begun`, and 1; 0 for a button that is not pressed.
    pressed: [AtomicU64; 2],
}

impl Buttons {
    fn new() -> Self {
        Self { begun: Instant::now(), pressed: Default::default() }
    }

    fn now(&self) -> u64 {
        self.begun.elapsed().as_millis() as u64 + 1
    }

    /// Presses a button, or lets it go.
    pub(super) fn set(&self, button: usize, pressed: bool) {
        let since = if pressed { self.now() } else { 0 };
        self.pressed[button].store(since, Ordering::Release);
    }

    /// For how long a button has been pressed, in milliseconds, from 1; 0 when it is not.
    pub(super) fn held(&self, button: usize) -> i16 {
        match self.pressed[button].load(Ordering::Acquire) {
            0 => 0,
            since => i16::try_from(self.now() - since + 1).unwrap_or(i16::MAX),
        }
    }
}

/// Shows what programs want to be shown, by a thread of its own: the next tic does not wait for a terminal.
pub(super) struct Display {
    common: Arc<Common>,
    sender: Mutex<Option<Sender<Show>>>,
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
        let common =
            Arc::new(Common { names, waiting: AtomicUsize::new(0), buttons: Buttons::new() });
        let (sender, shows) = mpsc::channel();
        let screen = Screen::new(Arc::clone(&common));
        let thread =
            thread::Builder::new().name("display".into()).spawn(move || screen.run(&shows))?;
        Ok(Self { common, sender: Mutex::new(Some(sender)), thread: Mutex::new(Some(thread)) })
    }

    fn show(&self, show: Show) {
        if let Some(sender) = &*self.sender.lock() {
            self.common.waiting.fetch_add(1, Ordering::AcqRel);
            if sender.send(show).is_err() {
                self.common.is_shown();
            }
        }
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
        self.common.waiting.load(Ordering::Acquire) > 0
    }

    /// For how long the left (0) and the right button (1) have been pressed.
    pub(super) fn button_held(&self, button: usize) -> i16 {
        self.common.buttons.held(button)
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
    use super::*;

    #[test]
    fn a_button_counts_from_1_while_it_is_pressed() {
        let buttons = Buttons::new();
        assert_eq!(buttons.held(1), 0);
        buttons.set(1, true);
        assert!(buttons.held(1) >= 1);
        assert_eq!(buttons.held(0), 0);
        buttons.set(1, false);
        assert_eq!(buttons.held(1), 0);
    }
}
