//! The control of one motor: distances, synchronisation, injected errors.
//!
//! With a world, the control sets the [power](Motor::allowed) of its motors and
//! [counts](Motor::count) their pulses. Without one, an ideal motor does
//! [exactly](Motor::turn) what it is commanded.

use std::mem;

use ft_transfer_area::transfer_area::{DUTY_MAX, IZ_MOTOR};

/// Pulses per second at full duty.
const FULL_SPEED: u64 = 200;

/// One pulse, in the unit of [`Motor::part`]: duty × pulses per second × µs.
const PULSE: u64 = DUTY_MAX as u64 * 1_000_000;

/// A motor may turn at the speed that takes it to the end of its distance in this time, in s.
const APPROACH: f64 = 0.15;

/// But this speed is always allowed, in pulses per second.
const CREEP: f64 = 15.0;

/// A motor that is this many pulses ahead, or will be in [`LOOK_AHEAD`], gets no power.
const MOST_AHEAD: f64 = 4.0;

/// How far into the future two synchronised motors are compared, in s. A motor with inertia has to
/// be slowed down before it is too far ahead.
const LOOK_AHEAD: f64 = 0.02;

/// One motor and its command.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motor {
    goal: Goal,
    /// Index of the motor whose speed is followed.
    leader: Option<usize>,
    /// How many pulses this motor is behind and still has to make up for; negative when it is ahead.
    lead: i64,
    /// How far the encoder has turned since the last pulse, less than [`PULSE`].
    part: u64,
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

impl Motor {
    /// Begins a command. The caller resets the counter when it [has a distance](Self::has_distance).
    pub(crate) fn begin(&mut self, id: u16, master: i16, distance: u16) {
        let master = usize::try_from(master).unwrap_or(0);
        let injects_error = (IZ_MOTOR + 1..=2 * IZ_MOTOR).contains(&master);
        let before = mem::take(self);
        self.part = before.part;
        self.finished_id = before.finished_id;
        if (1..=2 * IZ_MOTOR).contains(&master) {
            self.leader = Some((master - 1) % IZ_MOTOR);
        }
        if injects_error {
            // The part that is not made up for yet is kept.
            let goes_on = before.leader == self.leader && matches!(before.goal, Goal::Endless);
            let lead = if goes_on { before.lead } else { 0 };
            // The same 16 bits, signed.
            self.lead = lead.saturating_add(i64::from(distance as i16));
        } else if distance > 0 {
            self.goal = Goal::Distance { distance, left: distance, id };
            self.part = 0;
        } else if self.leader.is_none() {
            self.finished_id = id;
        }
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

    /// Index of the motor whose speed is followed.
    pub(crate) fn leader(&self) -> Option<usize> {
        self.leader
    }

    /// The part of its power that a motor of a world gets for its own command, at these pulses per
    /// second. 0 brakes it.
    pub(crate) fn allowed(&self, pulse_rate: f64) -> f64 {
        match self.goal {
            Goal::Endless => 1.0,
            Goal::Reached => 0.0,
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

    /// The parts of their power that it and its leader get at these pulses per second, so that
    /// neither gets too far ahead.
    pub(crate) fn allowed_together(&self, own_rate: f64, leader_rate: f64) -> [f64; 2] {
        let behind = self.lead as f64 + LOOK_AHEAD * (leader_rate - own_rate);
        [-behind, behind].map(|ahead| (1.0 - ahead / MOST_AHEAD).clamp(0.0, 1.0))
    }

    /// A motor of a world has turned by this many pulses.
    pub(crate) fn count(&mut self, pulses: u16) {
        self.finish(u64::from(pulses));
    }

    /// Compares the pulses that it and its leader have turned.
    pub(crate) fn compare(&mut self, own: u16, leader: u16) {
        self.lead = self.lead.saturating_add(i64::from(leader) - i64::from(own));
    }

    /// Id of the last command that is done.
    pub(crate) fn finished_id(&self) -> u16 {
        self.finished_id
    }

    /// Turns with `duty` (0..=512) for this many µs. Returns the pulses.
    pub(crate) fn turn(&mut self, duty: u16, micros: u64) -> u64 {
        if matches!(self.goal, Goal::Reached) {
            return 0;
        }
        let turned = (u64::from(duty) * FULL_SPEED).saturating_mul(micros);
        self.part = self.part.saturating_add(turned);
        let pulses = self.part / PULSE;
        self.part %= PULSE;
        let pulses = self.catch_up(pulses);
        self.finish(pulses)
    }

    /// Makes up for [`lead`](Self::lead): twice the pulses while this motor is behind, none while it
    /// is ahead.
    fn catch_up(&mut self, pulses: u64) -> u64 {
        let extra = self.lead.unsigned_abs().min(pulses);
        if self.lead < 0 {
            self.lead = self.lead.saturating_add_unsigned(extra);
            pulses - extra
        } else {
            self.lead = self.lead.saturating_sub_unsigned(extra);
            pulses + extra
        }
    }

    /// Stops at the end of the distance. Returns how many of the pulses are made until then.
    fn finish(&mut self, pulses: u64) -> u64 {
        let Goal::Distance { distance, left, id } = self.goal else { return pulses };
        match u16::try_from(pulses).ok().and_then(|pulses| left.checked_sub(pulses)) {
            Some(left) if left > 0 => {
                self.goal = Goal::Distance { distance, left, id };
                pulses
            }
            _ => {
                self.goal = Goal::Reached;
                self.finished_id = id;
                u64::from(left)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: u64 = 10_000;

    fn turn(motor: &mut Motor, duty: u16, steps: u64) -> u64 {
        (0..steps).map(|_| motor.turn(duty, STEP)).sum()
    }

    #[test]
    fn duty_gives_pulses_in_proportion() {
        for (duty, pulses) in [(512, 200), (256, 100), (1, 0), (0, 0)] {
            assert_eq!(turn(&mut Motor::default(), duty, 100), pulses, "duty {duty}");
        }
        assert_eq!(turn(&mut Motor::default(), 1, 256), 1, "fractions accumulate");
    }

    #[test]
    fn a_distance_ends_exactly_and_only_then_is_its_id_done() {
        let mut motor = Motor::default();
        motor.begin(7, 0, 5);
        assert_eq!((turn(&mut motor, 512, 2), motor.finished_id()), (4, 0));
        assert_eq!((turn(&mut motor, 512, 1), motor.finished_id()), (1, 7));
        assert_eq!(turn(&mut motor, 512, 10), 0);
        motor.begin(8, 0, 0);
        assert_eq!((turn(&mut motor, 512, 1), motor.finished_id()), (2, 8));
    }

    #[test]
    fn a_distance_begins_with_a_whole_pulse() {
        let mut motor = Motor::default();
        assert_eq!(turn(&mut motor, 128, 1), 0, "half a pulse");
        motor.begin(1, 0, 1);
        assert_eq!(turn(&mut motor, 128, 1), 0);
        assert_eq!(turn(&mut motor, 128, 1), 1);
    }

    #[test]
    fn a_long_distance_is_not_signed() {
        let mut motor = Motor::default();
        motor.begin(1, 0, 65_535);
        assert_eq!(motor.turn(512, 1_000_000_000), 65_535);
        assert_eq!(motor.finished_id(), 1);
    }

    #[test]
    fn following_without_a_distance_has_no_end() {
        for master in 1..=8 {
            let mut motor = Motor::default();
            motor.begin(1, master, 0);
            assert_eq!(motor.leader(), Some([0, 1, 2, 3][(master as usize - 1) % 4]));
            turn(&mut motor, 512, 1000);
            assert_eq!(motor.finished_id(), 0);
        }
    }

    #[test]
    fn an_injected_error_is_made_up_for_once() {
        let mut motor = Motor::default();
        motor.begin(1, 5, 6);
        assert_eq!(turn(&mut motor, 512, 100), 206);
        motor.begin(2, 5, (-6_i16) as u16);
        assert_eq!(turn(&mut motor, 512, 1), 0);
        assert_eq!(turn(&mut motor, 512, 99), 194);
        assert!(!motor.has_distance());
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
