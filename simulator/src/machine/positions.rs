//! How far synchronised motors are apart.

use ft_transfer_area::transfer_area::IZ_MOTOR;

use super::motor::{Pulses, Turning};

/// A motor that is this many pulses ahead of one that it is synchronised with, or will be in [`LOOK_AHEAD`], gets no
/// power.
const MOST_AHEAD: f64 = 4.0;

/// With this many pulses of an injected error left, one of the two motors stands. A published program that steers by
/// injected errors relies on it.
const STANDS: f64 = 16.0;

/// How far into the future two synchronised motors are compared, in s. A motor with inertia has to
/// be slowed down before it is too far ahead.
const LOOK_AHEAD: f64 = 0.02;

/// For each motor the index of the one that it follows.
pub(crate) type Leaders = [Option<usize>; IZ_MOTOR];

/// Where each motor is, in pulses. Only differences count.
///
/// A position is one number for each motor, not one for each pair, so of motors that follow each other in a circle one is
/// always the last, and goes on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Positions {
    at: [f64; IZ_MOTOR],
    /// What is left of the errors that were injected for each follower.
    errors: [f64; IZ_MOTOR],
}

impl Positions {
    /// A motor begins to follow its leader: it counts as being where its leader is.
    pub(crate) fn join(&mut self, follower: usize, leader: usize, leaders: &Leaders) {
        self.errors[follower] = 0.0;
        self.shift(follower, leader, leaders, self.at[leader] - self.at[follower]);
    }

    /// A follower shall get this many pulses behind its leader, or before it with less than 0.
    pub(crate) fn inject(&mut self, follower: usize, error: i16) {
        self.errors[follower] += f64::from(error);
    }

    /// The motors have given these pulses.
    pub(crate) fn count(&mut self, pulses: &[Pulses; IZ_MOTOR], leaders: &Leaders) {
        for (position, pulses) in self.at.iter_mut().zip(pulses) {
            *position += f64::from(pulses.count);
        }
        for (follower, leader) in leaders.iter().enumerate() {
            let (Some(leader), error) = (*leader, self.errors[follower]) else { continue };
            // The more of the error is left, the slower one of the two turns, as a part of the speed of the other one.
            let other = if error > 0.0 { leader } else { follower };
            let by = f64::from(pulses[other].count) * (error / STANDS).clamp(-1.0, 1.0);
            let by = by.clamp(-error.abs(), error.abs());
            self.errors[follower] -= by;
            self.shift(follower, leader, leaders, by);
        }
    }

    /// A motor counts as being this much further than it was. Those that follow it keep their distance from it.
    fn shift(&mut self, follower: usize, leader: usize, leaders: &Leaders, by: f64) {
        for motor in 0..IZ_MOTOR {
            if follows(motor, follower, leader, leaders) {
                self.at[motor] += by;
            }
        }
    }

    /// The parts of their power that a follower and its leader get, so that neither gets too far ahead.
    pub(crate) fn parts(&self, pair: (usize, usize), turning: &[Turning; IZ_MOTOR]) -> [f64; 2] {
        let soon = |motor: usize| self.at[motor] + LOOK_AHEAD * turning[motor].pulse_rate;
        let ahead = soon(pair.0) - soon(pair.1);
        [ahead, -ahead].map(|ahead| (1.0 - ahead / MOST_AHEAD).clamp(0.0, 1.0))
    }
}

/// Whether a motor is this follower, or follows it over any number of others but its leader.
fn follows(motor: usize, follower: usize, leader: usize, leaders: &Leaders) -> bool {
    let chain = std::iter::successors(Some(motor), |motor| leaders[*motor]).take(IZ_MOTOR);
    chain.take_while(|motor| *motor != leader).any(|motor| motor == follower)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: [Turning; IZ_MOTOR] = [Turning { pulse_rate: 0.0, runs_out: false }; IZ_MOTOR];

    fn at(at: [f64; IZ_MOTOR]) -> Positions {
        Positions { at, ..Positions::default() }
    }

    #[test]
    fn the_one_that_is_ahead_is_slowed_down_and_stands_from_4_pulses_on() {
        for (ahead, parts) in
            [(0.0, [1.0, 1.0]), (1.0, [0.75, 1.0]), (-2.0, [1.0, 0.5]), (4.0, [0.0, 1.0])]
        {
            assert_eq!(at([ahead, 0.0, 0.0, 0.0]).parts((0, 1), &STILL), parts, "{ahead}");
        }
    }

    #[test]
    fn an_injected_error_counts_with_the_pulses_of_the_motor_that_goes_on() {
        let leaders = [None, Some(0), None, None];
        let pulses = |count| Pulses { count, level: None };
        let (leads, follows) = ([1, 0, 0, 0].map(pulses), [0, 1, 0, 0].map(pulses));
        for (error, pulses, shift) in [
            (8, leads, 0.5),
            (16, leads, 1.0),
            (99, leads, 1.0),
            (-8, follows, -0.5),
            (8, follows, 0.0),
        ] {
            let mut positions = Positions::default();
            positions.inject(1, error);
            positions.count(&pulses, &leaders);
            let expected = f64::from(pulses[1].count) + shift;
            assert_eq!(positions.at[1], expected, "{error}");
            assert_eq!(positions.errors[1], f64::from(error) - shift);
        }
    }

    #[test]
    fn what_follows_a_motor_keeps_its_distance_from_it() {
        // M2 follows M1, M3 follows M2, M4 follows M1.
        let leaders = [None, Some(0), Some(1), Some(0)];
        let mut positions = at([100.0, 10.0, 7.0, 90.0]);
        positions.join(1, 0, &leaders);
        assert_eq!(positions.at, [100.0, 100.0, 97.0, 90.0]);
    }

    #[test]
    fn in_a_circle_the_leader_stays_where_it_is() {
        // M1, M2 and M3 follow each other, M4 follows M2.
        let leaders = [Some(1), Some(2), Some(0), Some(1)];
        let mut positions = at([1.0, 20.0, 3.0, 24.0]);
        positions.join(0, 1, &leaders);
        assert_eq!(positions.at, [20.0, 20.0, 22.0, 24.0]);
    }
}
