//! The controllers' displays: messages, frames, and the two buttons below.

use std::sync::mpsc::{self, Sender};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use parking_lot::Mutex;

use super::draw::Frame;
use super::screen::{Screen, Show, ShowState};
use crate::memory::AREAS;

/// Shows what programs want to be shown, by a thread of its own: the next tic does not wait for a terminal.
pub(super) struct Display {
    state: Arc<ShowState>,
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
        let state = Arc::new(ShowState::new(names));
        let (sender, shows) = mpsc::channel();
        let screen = Screen::new(Arc::clone(&state));
        let thread =
            thread::Builder::new().name("display".into()).spawn(move || screen.run(&shows))?;
        Ok(Self { state, sender: Mutex::new(Some(sender)), thread: Mutex::new(Some(thread)) })
    }

    fn show(&self, show: Show) {
        if let Some(sender) = &*self.sender.lock() {
            self.state.add_show();
            if sender.send(show).is_err() {
                self.state.show_is_done();
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
        self.state.is_busy()
    }

    /// For how long the left (0) and the right button (1) have been pressed.
    pub(super) fn button_held(&self, button: usize) -> i16 {
        self.state.buttons.held(button)
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
