//! The terminal of a program: its keys one by one, without waiting for a line.

use std::io::{self, IsTerminal, Write};
use std::thread;
use std::time::Duration;

use crossterm::cursor::MoveToPreviousLine;
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind};
use crossterm::{terminal, QueueableCommand};

use super::keyboard;

/// A key that is a button of the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    Left,
    Right,
}

/// A terminal that reports keys immediately. Ctrl-C and what the program prints stay as they are, so this is
/// not the raw mode of `crossterm`.
pub(super) struct Terminal(());

impl Terminal {
    /// The terminal, when the program has one to itself.
    pub(super) fn open() -> Option<Self> {
        let is_one = io::stdin().is_terminal() && io::stdout().is_terminal();
        (is_one && keyboard::without_lines()).then_some(Self(()))
    }

    /// Waits for a key that is a button.
    pub(super) fn key(&mut self, limit: Duration) -> Option<Key> {
        match event::poll(limit) {
            Ok(true) => match event::read().ok()? {
                Event::Key(event) => button(event),
                _ => None,
            },
            Ok(false) => None,
            Err(_) => {
                thread::sleep(limit);
                None
            }
        }
    }

    /// How many characters a line has.
    pub(super) fn columns(&self) -> usize {
        terminal::size().map_or(80, |(columns, _)| columns.into())
    }

    /// Moves to the begin of a line further up.
    pub(super) fn move_up(&self, out: &mut impl Write, lines: usize) -> io::Result<()> {
        out.queue(MoveToPreviousLine(u16::try_from(lines).unwrap_or(u16::MAX)))?;
        Ok(())
    }
}

fn button(event: KeyEvent) -> Option<Key> {
    match event.code {
        _ if event.kind == KeyEventKind::Release => None,
        KeyCode::Left => Some(Key::Left),
        KeyCode::Right => Some(Key::Right),
        _ => None,
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        keyboard::restore();
    }
}
