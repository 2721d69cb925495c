//! Ids of commands: those of the recorded program, and those of the program that runs now.

use std::collections::VecDeque;

/// How many commands are remembered on each side.
const KEPT: usize = 64;

/// The commands of one kind at one terminal since the connection was made.
///
/// Two runs of a program give the same commands, but not with the same ids: ids continue from one transfer to the
/// next. So commands are counted, and the third of one run stands for the third of the other.
#[derive(Debug, Default)]
pub(super) struct Commands {
    recorded: Ids,
    given: Ids,
    /// What was reported last.
    reported: u16,
}

/// The ids of one side, with the number of each command. The first request's is number 0.
#[derive(Debug, Default)]
struct Ids {
    newest: VecDeque<(u64, u16)>,
}

impl Ids {
    /// A request has this id. Returns whether it is a new command.
    fn note(&mut self, id: u16) -> bool {
        let number = match self.newest.back() {
            Some((_, last)) if *last == id => return false,
            Some((number, _)) => number + 1,
            None => 0,
        };
        if self.newest.len() == KEPT {
            self.newest.pop_front();
        }
        self.newest.push_back((number, id));
        true
    }

    fn number_of(&self, id: u16) -> Option<u64> {
        self.newest.iter().rev().find(|(_, known)| *known == id).map(|(number, _)| *number)
    }

    fn id_of(&self, number: u64) -> Option<u16> {
        self.newest.iter().find(|(known, _)| *known == number).map(|(_, id)| *id)
    }
}

impl Commands {
    /// The ids of a recorded request and of the program's request that stands for it. Returns whether both are
    /// new commands, or none is.
    pub(super) fn note(&mut self, recorded: u16, given: u16) -> bool {
        self.recorded.note(recorded) == self.given.note(given)
    }

    /// The id to report as done where this one was recorded. A command that the program has not given yet is not
    /// done.
    pub(super) fn report(&mut self, done: u16) -> u16 {
        let number = self.recorded.number_of(done);
        let given = number.and_then(|number| self.given.id_of(number));
        self.reported = match (number, given) {
            (_, Some(given)) => given,
            // Nothing was done yet on this connection.
            (None, None) if done == 0 => 0,
            _ => self.reported,
        };
        self.reported
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_command_has_the_id_of_the_program() {
        let mut commands = Commands::default();
        assert!(commands.note(7, 0));
        assert_eq!(commands.report(0), 0, "nothing is done");
        assert_eq!(commands.report(7), 0, "the first is done, which is 0 here");
        assert!(commands.note(8, 1));
        assert_eq!(commands.report(7), 0);
        assert_eq!(commands.report(8), 1);
    }

    #[test]
    fn a_command_that_was_not_given_yet_is_not_done() {
        let mut commands = Commands::default();
        commands.note(0, 0);
        assert!(!commands.note(1, 0), "the program is late");
        assert_eq!(commands.report(1), 0);
        assert!(!commands.note(1, 1));
        assert_eq!(commands.report(1), 1);
    }

    #[test]
    fn a_program_that_gives_more_commands_waits_for_them() {
        let mut commands = Commands::default();
        for id in 0..200 {
            commands.note(0, id);
        }
        assert_eq!(commands.report(0), 0, "it is forgotten, so it stays as it was");
        let mut commands = Commands::default();
        commands.note(0, 0);
        commands.note(0, 1);
        assert_eq!(commands.report(0), 0);
    }

    #[test]
    fn ids_that_begin_again_are_the_newest() {
        let mut commands = Commands::default();
        for (recorded, given) in [(u16::MAX, 5), (0, 6), (1, 7)] {
            commands.note(recorded, given);
        }
        assert_eq!((commands.report(u16::MAX), commands.report(0), commands.report(1)), (5, 6, 7));
    }
}
