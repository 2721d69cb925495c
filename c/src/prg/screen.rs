//! The thread that shows messages and frames: in a terminal, or as lines without one.

use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, TryRecvError};

use super::draw::{self, Frame};
use super::terminal::{Key, Terminal};

/// How often the thread looks for keys. Messages wait no longer, either.
const LOOK: Duration = Duration::from_millis(10);

/// How long a key counts as pressed after the terminal has reported it. Terminals report a key that is held
/// down some thirty times a second, but the second time only after about half a second.
const HELD: Duration = Duration::from_millis(100);
const FIRST_HELD: Duration = Duration::from_millis(550);

/// What is to be shown.
pub(super) enum Show {
    Message { of: usize, text: String },
    NoMessages,
    Frame { of: usize, frame: Box<Frame> },
    NoFrame,
}

/// What the thread that shows things and the program share.
pub(super) struct ShowState {
    /// Of each controller, with the master first.
    names: Vec<String>,
    /// How much is still to be shown.
    waiting: AtomicUsize,
    /// What is not shown, because too much was waiting.
    left_out: AtomicUsize,
    pub(super) buttons: Buttons,
}

impl ShowState {
    pub(super) fn new(names: Vec<String>) -> Self {
        let (waiting, left_out) = Default::default();
        Self { names, waiting, left_out, buttons: Buttons::new() }
    }

    /// Something is to be shown.
    pub(super) fn add_show(&self) {
        self.waiting.fetch_add(1, Ordering::AcqRel);
    }

    /// Whether something is still to be shown.
    pub(super) fn is_busy(&self) -> bool {
        self.waiting.load(Ordering::Acquire) > 0
    }

    /// Something that was waiting is not shown.
    pub(super) fn leave_out(&self) {
        self.left_out.fetch_add(1, Ordering::AcqRel);
        self.show_is_done();
    }

    /// Something is shown.
    pub(super) fn show_is_done(&self) {
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
    fn set(&self, button: usize, pressed: bool) {
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

/// The thread's data.
pub(super) struct Screen {
    state: Arc<ShowState>,
    terminal: Option<Terminal>,
    /// Until when each button is pressed, and whether its key has repeated.
    pressed: [Option<(Instant, bool)>; 2],
    /// Of the frame that is the last thing on the screen.
    frame_lines: usize,
}

impl Screen {
    pub(super) fn new(state: Arc<ShowState>) -> Self {
        Self { state, terminal: Terminal::open(), pressed: [None; 2], frame_lines: 0 }
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
                self.state.buttons.set(button, true);
            }
            self.pressed[button] = Some((now + length, repeats));
        }
        for (button, pressed) in self.pressed.iter_mut().enumerate() {
            if pressed.is_some_and(|(until, _)| until <= now) {
                *pressed = None;
                self.state.buttons.set(button, false);
            }
        }
    }

    fn show(&mut self, show: &Show) {
        let left_out = self.state.left_out.swap(0, Ordering::AcqRel);
        if left_out > 0 {
            log::warn!("{left_out} messages and frames are not shown: the output takes too long");
        }
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
        self.state.show_is_done();
    }

    fn show_message(&mut self, of: usize, text: &str) -> io::Result<()> {
        self.frame_lines = 0;
        let name = &self.state.names[of];
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
        write_box(&mut out, &self.state.names[of], lines.iter().copied())?;
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
    fn a_button_counts_from_1_while_it_is_pressed() {
        let buttons = Buttons::new();
        assert_eq!(buttons.held(1), 0);
        buttons.set(1, true);
        assert!(buttons.held(1) >= 1);
        assert_eq!(buttons.held(0), 0);
        buttons.set(1, false);
        assert_eq!(buttons.held(1), 0);
    }

    #[test]
    fn a_message_has_a_box_with_the_name_of_its_controller() {
        let mut out = Vec::new();
        write_box(&mut out, "TX", "Hello\nöl".lines()).unwrap();
        assert_eq!(String::from_utf8(out).unwrap(), "┌ TX ───┐\n│ Hello │\n│ öl    │\n└───────┘\n");
    }
}
