//! The thread that shows messages and frames: in a terminal, or as lines without one.

use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::display::{Common, Show};
use super::draw::{self, Frame};
use super::terminal::{Key, Terminal};

/// How often the thread looks for keys. Messages wait no longer, either.
const LOOK: Duration = Duration::from_millis(10);

/// How long a key counts as pressed after the terminal has told of it. Terminals tell of a key that is held
/// down some thirty times a second, but the second time only after about half a second.
const HELD: Duration = Duration::from_millis(100);
const FIRST_HELD: Duration = Duration::from_millis(550);

/// The thread's data.
pub(super) struct Screen {
    common: Arc<Common>,
    terminal: Option<Terminal>,
    /// Until when each button is pressed, and whether its key has repeated.
    pressed: [Option<(Instant, bool)>; 2],
    /// Of the frame that is the last thing on the screen.
    frame_lines: usize,
}

impl Screen {
    pub(super) fn new(common: Arc<Common>) -> Self {
        Self { common, terminal: Terminal::open(), pressed: [None; 2], frame_lines: 0 }
    }

    /// Shows everything, until there is nothing more to come.
    pub(super) fn run(mut self, shows: &Receiver<Show>) {
        if self.terminal.is_none() {
            return shows.iter().for_each(|show| self.show(&show));
        }
        loop {
            match shows.try_recv() {
                Ok(show) => self.show(&show),
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => self.look_for_keys(),
            }
        }
    }

    fn look_for_keys(&mut self) {
        let Some(terminal) = &mut self.terminal else { return };
        let now = Instant::now();
        if let Some(key) = terminal.key(LOOK) {
            let button = match key {
                Key::Left => 0,
                Key::Right => 1,
            };
            let repeats = self.pressed[button].is_some();
            let length = if repeats { HELD } else { FIRST_HELD };
            if !repeats {
                self.common.buttons.set(button, true);
            }
            self.pressed[button] = Some((now + length, repeats));
        }
        for (button, pressed) in self.pressed.iter_mut().enumerate() {
            if pressed.is_some_and(|(until, _)| until <= now) {
                *pressed = None;
                self.common.buttons.set(button, false);
            }
        }
    }

    fn show(&mut self, show: &Show) {
        let shown = match show {
            Show::Message { of, text } => self.show_message(*of, text),
            Show::Frame { of, frame } => self.show_frame(*of, frame),
            // What is on the screen already scrolls away.
            Show::NoMessages | Show::NoFrame => {
                self.frame_lines = 0;
                Ok(())
            }
        };
        if let Err(error) = shown {
            log::debug!("what the program shows can't be written: {error}");
        }
        self.common.is_shown();
    }

    fn show_message(&mut self, of: usize, text: &str) -> io::Result<()> {
        self.frame_lines = 0;
        let name = &self.common.names[of];
        let mut out = io::stdout().lock();
        if self.terminal.is_some() {
            write_box(&mut out, name, text.lines())?;
        } else {
            for line in text.lines() {
                writeln!(out, "{name}: {line}")?;
            }
        }
        out.flush()
    }

    /// A frame is drawn over the one before, unless something has come between them. Without a terminal only
    /// the first and the last are worth lines, and nobody knows which is the last; so there are none.
    fn show_frame(&mut self, of: usize, frame: &Frame) -> io::Result<()> {
        let Some(terminal) = &self.terminal else { return Ok(()) };
        let lines = draw::lines(frame, terminal.columns().saturating_sub(4));
        let mut out = io::stdout().lock();
        if self.frame_lines > 0 {
            terminal.move_up(&mut out, self.frame_lines)?;
        }
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        write_box(&mut out, &self.common.names[of], lines.iter().copied())?;
        self.frame_lines = lines.len() + 2;
        out.flush()
    }
}

/// Writes lines in a box with a name.
fn write_box<'a>(
    out: &mut impl Write,
    name: &str,
    lines: impl Iterator<Item = &'a str> + Clone,
) -> io::Result<()> {
    let length = |line: &str| line.chars().count();
    let width = lines.clone().map(length).max().unwrap_or(0).max(length(name) + 2);
    writeln!(out, "┌ {name} {}┐", "─".repeat(width - length(name)))?;
    for line in lines {
        writeln!(out, "│ {line}{} │", " ".repeat(width - length(line)))?;
    }
    writeln!(out, "└{}┘", "─".repeat(width + 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_a_box_with_the_name_of_its_controller() {
        let mut out = Vec::new();
        write_box(&mut out, "TX", "Hello\nöl".lines()).unwrap();
        assert_eq!(String::from_utf8(out).unwrap(), "┌ TX ───┐\n│ Hello │\n│ öl    │\n└───────┘\n");
    }
}
