//! The control of one motor: its command.
//!
//! The control sets the [power](Motor::allowed) of its motors and [counts](Motor::count) their
//! pulses.

use std::mem;

use ft_transfer_area::transfer_area::IZ_MOTOR;

/// A motor may turn at the speed that takes it to the end of its distance in this time, in s.
const APPROACH: f64 = 0.15;

/// But this speed is always allowed, in pulses per second.
const CREEP: f64 = 15.0;

/// What the control knows of a motor that turns.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turning {
    /// Pulses per second in either direction.
    pub(crate) pulse_rate: f64,
    /// Whether it is not slowed down before the end of a distance.
    pub(crate) runs_out: bool,
}

/// What the encoder of a motor has given.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pulses {
    pub(crate) count: u16,
    /// Its level, if it has changed. It is high in the first half of a pulse.
    pub(crate) level: Option<bool>,
}

/// One motor and its command.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motor {
    goal: Goal,
    /// Index of the motor that is followed.
    leader: Option<usize>,
    /// Id of the last command that is done.
    finished_id: u16,
}

#[derive(Clone, Copy, Debug, Default)]
enum Goal {
    /// Turn as long as there is duty.
    #[default]
    Endless,
    /// Turn until the counter has come to this distance, for which this many pulses are left; then the command with
    /// this id is done.
    Distance { distance: u16, left: u16, id: u16 },
    /// The distance is done: stand still until the next command.
    Reached,
}

/// What a command changes in where a motor that follows counts as being.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shift {
    /// To where its leader is.
    Join,
    /// On by the injected error.
    Error(i16),
    /// To where its leader is, and on by the injected error.
    JoinWithError(i16),
}

impl Motor {
    /// Begins a command. The caller resets the counter when it [has a distance](Self::has_distance), and shifts the motor
    /// if it has a [leader](Self::leader).
    pub(crate) fn begin(&mut self, id: u16, master: i16, distance: u16) -> Shift {
        let master = usize::try_from(master).unwrap_or(0);
        let injects_error = (IZ_MOTOR + 1..=2 * IZ_MOTOR).contains(&master);
        let before = mem::take(self);
        self.finished_id = before.finished_id;
        if (1..=2 * IZ_MOTOR).contains(&master) {
            self.leader = Some((master - 1) % IZ_MOTOR);
        }
        if injects_error {
            // The same 16 bits, signed. The part of others that is not made up for yet is kept.
            let error = distance as i16;
            let goes_on = before.leader == self.leader && matches!(before.goal, Goal::Endless);
            return if goes_on { Shift::Error(error) } else { Shift::JoinWithError(error) };
        }
        if distance > 0 {
            self.goal = Goal::Distance { distance, left: distance, id };
        } else if self.leader.is_none() {
            self.finished_id = id;
        }
        Shift::Join
    }

    /// Whether the motor is on its way to the end of a distance.
    pub(crate) fn has_distance(&self) -> bool {
        matches!(self.goal, Goal::Distance { .. })
    }

    /// Its counter is reset, so all of its distance is left.
    pub(crate) fn reset_counter(&mut self) {
        if let Goal::Distance { distance, left, .. } = &mut self.goal {
            *left = *distance;
        }
    }

    /// Whether the motor has come to the end of a distance.
    pub(crate) fn has_reached(&self) -> bool {
        matches!(self.goal, Goal::Reached)
    }

    /// Index of the motor that is followed.
    pub(crate) fn leader(&self) -> Option<usize> {
        self.leader
    }

    /// The part of its power that it gets for its own command. 0 brakes it.
    pub(crate) fn allowed(&self, Turning { pulse_rate, runs_out }: Turning) -> f64 {
        match self.goal {
            Goal::Reached => 0.0,
            Goal::Endless => 1.0,
            Goal::Distance { .. } if runs_out => 1.0,
            Goal::Distance { left, .. } => {
                let fastest = (f64::from(left) / APPROACH).max(CREEP);
                if pulse_rate > fastest {
                    0.0
                } else {
                    1.0
                }
            }
        }
    }

    /// It has turned by this many pulses.
    pub(crate) fn count(&mut self, pulses: u16) {
        let Goal::Distance { distance, left, id } = self.goal else { return };
        let left = left.saturating_sub(pulses);
        self.goal = Goal::Distance { distance, left, id };
        if left == 0 {
            self.goal = Goal::Reached;
            self.finished_id = id;
        }
    }

    /// Id of the last command that is done.
    pub(crate) fn finished_id(&self) -> u16 {
        self.finished_id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_is_done_when_it_is_counted_and_only_then_is_its_id_done() {
        let mut motor = Motor::default();
        motor.begin(7, 0, 5);
        motor.count(4);
        assert_eq!((motor.has_reached(), motor.finished_id()), (false, 0));
        motor.count(2);
        assert_eq!((motor.has_reached(), motor.finished_id()), (true, 7));
        assert_eq!(motor.allowed(Turning::default()), 0.0);
        motor.begin(8, 0, 0);
        assert_eq!((motor.allowed(Turning::default()), motor.finished_id()), (1.0, 8));
    }

    #[test]
    fn a_reset_begins_the_distance_again_unless_it_is_done() {
        let mut motor = Motor::default();
        motor.begin(1, 0, 5);
        motor.count(4);
        motor.reset_counter();
        motor.count(4);
        assert_eq!(motor.finished_id(), 0);
        motor.count(1);
        motor.reset_counter();
        assert!(motor.has_reached());
    }

    #[test]
    fn a_long_distance_is_not_signed() {
        let mut motor = Motor::default();
        motor.begin(1, 0, 65_535);
        motor.count(65_534);
        assert_eq!(motor.finished_id(), 0);
        motor.count(1);
        assert_eq!(motor.finished_id(), 1);
    }

    #[test]
    fn following_without_a_distance_has_no_end() {
        for master in 1..=8 {
            let mut motor = Motor::default();
            motor.begin(1, master, 0);
            assert_eq!(motor.leader(), Some([0, 1, 2, 3][(master as usize - 1) % 4]));
            motor.count(u16::MAX);
            assert_eq!(motor.finished_id(), 0);
        }
    }

    #[test]
    fn injected_errors_add_up_while_the_leader_stays_the_same() {
        let mut motor = Motor::default();
        assert_eq!(motor.begin(1, 5, 6), Shift::JoinWithError(6));
        assert_eq!(motor.begin(2, 5, (-6_i16) as u16), Shift::Error(-6));
        assert_eq!(motor.begin(3, 6, 7), Shift::JoinWithError(7));
        assert_eq!(motor.begin(4, 2, 10), Shift::Join);
        assert_eq!(motor.begin(5, 6, 8), Shift::JoinWithError(8));
        assert!(!motor.has_distance());
        assert_eq!(motor.finished_id(), 0);
    }

    #[test]
    fn a_master_that_does_not_exist_is_ignored() {
        for master in [-1, 9, i16::MIN, i16::MAX] {
            let mut motor = Motor::default();
            motor.begin(1, master, 0);
            assert_eq!((motor.leader(), motor.finished_id()), (None, 1));
        }
    }
}
