//! What a simulated TXT logs.
//!
//! A simulated TXT that has a name for this begins each of its lines with it. A logger may block, as on a terminal after
//! Ctrl-S, so the thread of the library that writes its own lines writes these, too.

use std::cell::RefCell;
use std::fmt;
use std::sync::Arc;

use ft_transfer_area::notices;
use ft_transfer_area::wire::ExchangeData;
use log::Level;

thread_local! {
    /// The simulated TXT that this thread is busy with, if its lines begin with a name.
    static SUBJECT: RefCell<Subject> = const { RefCell::new(None) };
}

/// What the lines of a simulated TXT begin with.
pub(crate) type Subject = Option<Arc<str>>;

/// While it exists, the lines of this thread are about another simulated TXT than before.
pub(crate) struct About {
    before: Subject,
}

impl About {
    pub(crate) fn begin(subject: Subject) -> Self {
        Self { before: SUBJECT.replace(subject) }
    }
}

impl Drop for About {
    fn drop(&mut self) {
        SUBJECT.set(self.before.take());
    }
}

/// Leaves a line for the logger, with the level, as `log`'s macros do. Never blocks.
macro_rules! notice {
    ($level:ident, $($text:tt)+) => {
        $crate::machine::journal::log(log::Level::$level, module_path!(), format_args!($($text)+))
    };
}
pub(crate) use notice;

/// What `notice!` does.
pub(crate) fn log(level: Level, target: &'static str, text: fmt::Arguments<'_>) {
    SUBJECT.with_borrow(|subject| match subject {
        Some(name) => notices::leave(level, target, format_args!("{name}: {text}")),
        None => notices::leave(level, target, text),
    });
}

/// Logs what these outputs of a controller change: switched motors, new commands.
///
/// A duty is logged only when an output goes on or off, so that a control loop does not fill the log.
pub(crate) fn log_changes(controller: usize, before: &ExchangeData, now: &ExchangeData) {
    if Level::Info <= log::max_level() {
        for change in changes(before, now) {
            notice!(Info, "{}: {change}", Name(controller));
        }
    }
}

fn changes(before: &ExchangeData, now: &ExchangeData) -> Vec<String> {
    let mut changes = Vec::new();
    for (output, (old, duty)) in before.duty.into_iter().zip(now.duty).enumerate() {
        if (old == 0) != (duty == 0) {
            changes.push(format!("O{} is set to {duty}", output + 1));
        }
    }
    for (motor, id) in now.motor_command_id.into_iter().enumerate() {
        if id != before.motor_command_id[motor] {
            let distance = now.distance[motor];
            let master = match now.master[motor] {
                0 => String::new(),
                master => format!(", master {master}"),
            };
            changes.push(format!("M{} gets command {id}: distance {distance}{master}", motor + 1));
        }
    }
    for (counter, id) in now.counter_reset_id.into_iter().enumerate() {
        if id != before.counter_reset_id[counter] {
            changes.push(format!("C{} is reset, id {id}", counter + 1));
        }
    }
    let id = now.sound_command_id;
    if id != before.sound_command_id {
        let (index, repeat) = (now.sound_index, now.sound_repeat);
        changes.push(format!("sound command {id}: sound {index}, repeat {repeat}"));
    }
    changes
}

/// The name of a controller in a sentence.
pub(crate) struct Name(pub(crate) usize);

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => f.write_str("the master"),
            extension => write!(f, "extension {extension}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_logged_once() {
        let before = ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..Default::default() };
        let now = ExchangeData {
            duty: [0, 300, 0, 0, 0, 0, 0, 0],
            motor_command_id: [0, 5, 0, 0],
            distance: [0, 100, 0, 0],
            master: [0, 1, 0, 0],
            counter_reset_id: [0, 0, 0, 9],
            sound_command_id: 1,
            sound_index: 3,
            sound_repeat: 2,
        };
        let logged = changes(&before, &now);
        let expected = [
            "O1 is set to 0",
            "O2 is set to 300",
            "M2 gets command 5: distance 100, master 1",
            "C4 is reset, id 9",
            "sound command 1: sound 3, repeat 2",
        ];
        assert_eq!(logged, expected);
        assert_eq!(changes(&now, &now), [""; 0]);
        let slower = ExchangeData { duty: [0, 299, 0, 0, 0, 0, 0, 0], ..now };
        assert_eq!(changes(&now, &slower), [""; 0]);
    }
}
