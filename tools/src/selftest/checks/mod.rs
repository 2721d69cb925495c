//! The table of checks, in the order in which they run. Each file has those of one part.

mod camera;
mod commands;
mod crash;
mod ends;
mod exchange;
mod i2c;
mod ids;
mod motors;
mod restart;
mod sounds;

use super::bench::Bench;
use super::outcome::{Outcome, Trouble};

/// What a check has found.
pub(super) type Found = Result<Outcome, Trouble>;

/// What has to be asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Needs {
    Nothing,
    /// M1 turns.
    Motors,
    /// The firmware's program ends.
    Crash,
}

/// One statement about the controller.
pub(super) struct Check {
    pub(super) name: &'static str,
    /// What the maker's firmware 4.7.0 does.
    pub(super) expected: &'static str,
    pub(super) needs: Needs,
    pub(super) run: fn(&mut Bench) -> Found,
}

impl Check {
    /// A check that moves nothing.
    const fn new(name: &'static str, expected: &'static str, run: fn(&mut Bench) -> Found) -> Self {
        Self { name, expected, needs: Needs::Nothing, run }
    }

    const fn needs(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }
}

/// All checks.
pub(super) fn all() -> impl Iterator<Item = &'static Check> {
    let parts: [&'static [Check]; 10] = [
        commands::CHECKS,
        // Whoever has answered the question is still there.
        motors::CHECKS,
        exchange::CHECKS,
        sounds::CHECKS,
        i2c::CHECKS,
        ids::CHECKS,
        restart::CHECKS,
        ends::CHECKS,
        camera::CHECKS,
        crash::CHECKS,
    ];
    parts.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::all;

    #[test]
    fn each_check_has_a_name_of_its_own_and_a_sentence() {
        let names: HashSet<_> = all().map(|check| check.name).collect();
        assert_eq!(names.len(), all().count());
        for check in all() {
            assert!(check.expected.ends_with('.'), "{}", check.name);
            let is_plain =
                |letter: char| letter.is_ascii_lowercase() || matches!(letter, '-' | '0'..='9');
            assert!(check.name.chars().all(is_plain) && check.name.len() < 28, "{}", check.name);
        }
    }
}
