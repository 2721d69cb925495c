//! Synchronised motors in a world, stepped without sockets and without a clock.

use std::time::Duration;

use ft_transfer_area::tx::Motor;
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area_simulator::world::MotorModel;
use ft_transfer_area_simulator::Machine;

use crate::stepped::{forward, machine, machine_with, run_until, steps};

/// Time constants in s, and how many pulses a follower and its leader may be apart when each gives
/// up to 200 pulses per second.
const APART: [(f64, i64); 3] = [(0.02, 5), (0.05, 6), (0.1, 11)];

/// Random numbers that are the same in every run.
struct Draw(u64);

impl Draw {
    /// A number in 0..1.
    fn part(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number in 0..count.
    fn below(&mut self, count: usize) -> usize {
        (self.part() * count as f64) as usize
    }

    /// A motor of at most 200 pulses per second: light, almost too heavy to turn, or between.
    fn motor(&mut self, time_constant: f64) -> MotorModel {
        let load = [0.0, 0.95, self.part()][self.below(3)];
        let time_constant = [time_constant, time_constant * self.part()][self.below(2)];
        let top_speed = [1.0, 0.3 + 0.7 * self.part()][self.below(2)] * 200.0 / MotorModel::ENCODER;
        MotorModel::encoder_motor().load(load).time_constant(time_constant).top_speed(top_speed)
    }
}

/// How many pulses each motor has given so far, in either direction.
#[derive(Default)]
struct Pulses {
    counter: [i16; 4],
    total: [i64; 4],
}

impl Pulses {
    fn add(&mut self, report: &ExchangeDataResponse) {
        for motor in 0..4 {
            let more = report.counter[motor].wrapping_sub(self.counter[motor]);
            self.total[motor] += i64::from(more);
        }
        self.counter = report.counter;
    }
}

/// The greatest difference between a motor and the one it follows, in 6 s. The direction changes every
/// second.
fn furthest_apart(machine: &mut Machine, mut outputs: ExchangeData, masters: [i16; 4]) -> i64 {
    let (mut pulses, mut furthest) = (Pulses::default(), 0);
    for step in 0..1200 {
        if step % 200 == 199 {
            outputs.duty.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
        }
        machine.set_outputs(0, outputs);
        machine.step(Duration::from_millis(5));
        pulses.add(&machine.report(0).unwrap());
        for (follower, master) in masters.into_iter().enumerate().filter(|(_, master)| *master > 0)
        {
            let leader = pulses.total[master as usize - 1];
            furthest = furthest.max((pulses.total[follower] - leader).abs());
        }
    }
    furthest
}

/// Motors that follow the motors with these numbers.
fn following(master: [i16; 4]) -> ExchangeData {
    ExchangeData {
        master,
        motor_command_id: master.map(|master| (master != 0).into()),
        ..forward(512)
    }
}

#[test]
fn groups_of_any_size_stay_together_under_any_load() {
    let mut draw = Draw(1);
    for ((time_constant, apart), size) in
        APART.into_iter().flat_map(|limit| [2, 3, 4].map(|size| (limit, size)))
    {
        let mut furthest = 0;
        for _ in 0..100 {
            let motors: Vec<_> = (0..size).map(|_| draw.motor(time_constant)).collect();
            // All follow the first one, or each follows the one before.
            let mut masters = [[0, 1, 1, 1], [0, 1, 2, 3]][draw.below(2)];
            masters[size..].fill(0);
            let duty = [512, 400, 200][draw.below(3)];
            let outputs = ExchangeData { duty: forward(duty).duty, ..following(masters) };
            let found = furthest_apart(&mut machine_with(&motors), outputs, masters);
            assert!(found <= apart, "{found} pulses: {motors:?} {masters:?} {duty}");
            furthest = furthest.max(found);
        }
        assert!(furthest >= 4, "only {furthest} pulses, so the loads make no difference");
    }
}

#[test]
fn motors_that_are_not_synchronised_get_far_apart() {
    let apart = furthest_apart(&mut machine(&[0.0, 0.5]), forward(512), [0, 1, 0, 0]);
    assert!(apart > 300, "{apart}");
}

#[test]
fn a_motor_that_is_synchronised_with_one_without_an_encoder_stops() {
    let motors = [MotorModel::encoder_motor(), MotorModel::default()];
    for masters in [[0, 1, 0, 0], [2, 0, 0, 0]] {
        let mut machine = machine_with(&motors);
        let counter = steps(&mut machine, following(masters), 500).counter;
        assert!((1..=6).contains(&counter[0]) && counter[1] == 0, "{counter:?}");
        let speed = |motor| machine.world().unwrap().motor_speed(0, motor).unwrap();
        assert!(speed(Motor::M1).abs() < 1e-3 && speed(Motor::M2) > 2.9);
    }
}

#[test]
fn a_synchronised_pair_ends_its_distance_together() {
    let outputs = ExchangeData {
        master: [0, 1, 0, 0],
        distance: [1000, 1000, 0, 0],
        motor_command_id: [4, 9, 0, 0],
        ..forward(512)
    };
    for loads in [[0.0, 0.4], [0.4, 0.0]] {
        let mut machine = machine(&loads);
        run_until(&mut machine, outputs, |report| {
            for (index, id) in [4, 9].into_iter().enumerate() {
                let done = report.motor_command_id[index] == id;
                assert_eq!(done, report.counter[index] >= 1000, "{report:?}");
            }
            report.motor_command_id[..2] == [4, 9]
        });
        let counter = steps(&mut machine, outputs, 100).counter;
        assert!(counter[..2].iter().all(|count| (1000..=1003).contains(count)), "{counter:?}");
    }
}

#[test]
fn an_injected_error_shifts_the_difference_by_itself_under_any_load() {
    let mut draw = Draw(2);
    for (time_constant, apart) in APART {
        for _ in 0..20 {
            let motors = [(); 2].map(|()| {
                // Light enough to catch up in time.
                let motor = draw.motor(time_constant);
                let load = motor.load.min(0.8);
                motor.load(load)
            });
            let mut machine = machine_with(&motors);
            let (mut pulses, mut expected) = (Pulses::default(), 0);
            for (id, error) in [(1, 0_i16), (2, 40), (3, -100), (4, 25)] {
                // A positive one holds the follower back.
                expected -= i64::from(error);
                let mut outputs = following([0, 5, 0, 0]);
                outputs.distance[1] = error as u16;
                outputs.motor_command_id[1] = id;
                let report = steps(&mut machine, outputs, 1500);
                pulses.add(&report);
                let missed = pulses.total[1] - pulses.total[0] - expected;
                assert!(missed.abs() <= apart, "{missed} of {expected}: {motors:?}");
                assert_eq!(report.motor_command_id[1], 0, "it is never done");
            }
        }
    }
}

#[test]
fn a_command_replaces_the_rest_of_an_injected_error() {
    let mut machine = machine(&[0.0, 0.3]);
    let mut outputs = following([0, 5, 0, 0]);
    outputs.distance[1] = (-300_i16) as u16;
    let counter = steps(&mut machine, outputs, 50).counter;
    let gained = counter[1] - counter[0];
    assert!((20..200).contains(&gained), "{gained}");
    outputs = ExchangeData { motor_command_id: [0, 2, 0, 0], ..following([0, 1, 0, 0]) };
    let counter = steps(&mut machine, outputs, 1000).counter;
    assert!((counter[1] - counter[0] - gained).abs() <= 12, "{counter:?}");
}

#[test]
fn master_and_distance_0_set_a_whole_group_free() {
    let mut machine = machine(&[0.0, 0.3, 0.5, 0.6]);
    let mut outputs = following([0, 1, 6, 1]);
    outputs.distance[2] = 50;
    let counter = steps(&mut machine, outputs, 500).counter;
    assert!(counter[0] < 500, "all wait for the slowest: {counter:?}");
    outputs = ExchangeData { motor_command_id: [2; 4], ..forward(512) };
    let report = steps(&mut machine, outputs, 1);
    assert_eq!(report.motor_command_id, [2; 4], "it is done immediately");
    let free = steps(&mut machine, outputs, 500).counter;
    for (motor, share) in [1.0, 0.7, 0.5, 0.4].into_iter().enumerate() {
        let pulses = f64::from(free[motor] - counter[motor]);
        let full = 5.0 * 3.0 * MotorModel::ENCODER;
        assert!((pulses - full * share).abs() < 0.03 * full, "M{}: {pulses}", motor + 1);
    }
}

/// The last commands of a motor, and which are done. The board knows three bits of a command's number.
#[derive(Clone, Copy, Default)]
struct Reported {
    ids: [u16; 8],
    number: usize,
    distance: Option<i16>,
    /// Number of the last command that was done.
    done: usize,
}

#[test]
fn ids_are_echoed_when_their_command_is_done_and_never_early() {
    let mut draw = Draw(3);
    let mut machine = machine(&[0.0, 0.2, 0.4, 0.1]);
    let mut outputs = forward(512);
    let mut reported = [Reported::default(); 4];
    let mut ends = 0;
    for id in 1..=1000 {
        let motor = draw.below(4);
        // Alone or following another motor; with a distance or without; some with an error.
        let master = [0, 1 + draw.below(4), 5 + draw.below(4)][draw.below(3)] as i16;
        let distance = [0, 1 + draw.below(60)][draw.below(2)] as u16;
        outputs.master[motor] = master;
        outputs.distance[motor] = distance;
        outputs.motor_command_id[motor] = id;
        let told_motor = &mut reported[motor];
        told_motor.number = (told_motor.number + 1) % 8;
        told_motor.ids[told_motor.number] = id;
        told_motor.distance = (distance > 0 && master < 5).then_some(distance as i16);
        if master == 0 && distance == 0 {
            told_motor.done = told_motor.number;
        }
        for _ in 0..=draw.below(40) {
            let report = steps(&mut machine, outputs, 1);
            for (motor, reported) in reported.iter_mut().enumerate() {
                let distance =
                    reported.distance.filter(|distance| report.counter[motor] >= *distance);
                if distance.is_some() && reported.done != reported.number {
                    reported.done = reported.number;
                    ends += 1;
                }
                let done = reported.ids[reported.done];
                assert_eq!(report.motor_command_id[motor], done, "command {id}: {report:?}");
            }
        }
    }
    assert!((100..300).contains(&ends), "{ends} distances end, and others do not");
}

#[test]
fn a_positive_error_slows_the_follower_and_more_than_16_stop_it() {
    for mut machine in [Machine::new(0), machine(&[0.0, 0.0])] {
        let mut outputs = following([0, 5, 0, 0]);
        outputs.distance[1] = 12;
        let counter = steps(&mut machine, outputs, 12).counter;
        assert!(0 < counter[1] && counter[1] < counter[0], "it is slower: {counter:?}");
        let counter = steps(&mut machine, outputs, 500).counter;
        assert!((11..=13).contains(&(counter[0] - counter[1])), "{counter:?}");
        outputs.distance[1] = (-100_i16) as u16;
        outputs.motor_command_id[1] = 2;
        steps(&mut machine, outputs, 20);
        let before = steps(&mut machine, outputs, 1).counter;
        let after = steps(&mut machine, outputs, 4).counter;
        assert!(after[0] - before[0] <= 1 && after[1] > before[1], "the leader stands: {after:?}");
        let report = steps(&mut machine, outputs, 500);
        let ahead = report.counter[1] - report.counter[0];
        assert!((87..=89).contains(&ahead), "{report:?}");
        assert_eq!(report.motor_command_id[1], 0, "it is never done");
    }
}

#[test]
fn motors_that_follow_each_other_go_on() {
    for masters in [[2, 1, 0, 0], [6, 5, 0, 0], [2, 3, 4, 1], [6, 7, 8, 5]] {
        for mut machine in [Machine::new(0), machine(&[0.0, 0.3, 0.1, 0.2])] {
            let mut outputs = ExchangeData { duty: following(masters).duty, ..Default::default() };
            for (motor, master) in masters.into_iter().enumerate().filter(|(_, master)| *master > 0)
            {
                steps(&mut machine, outputs, 30);
                outputs.master[motor] = master;
                outputs.distance[motor] = if master > 4 { 50 } else { 0 };
                outputs.motor_command_id[motor] = 1;
            }
            let before = steps(&mut machine, outputs, 100).counter;
            let after = steps(&mut machine, outputs, 400).counter;
            for motor in (0..4).filter(|motor| masters[*motor] > 0) {
                let turned = after[motor].wrapping_sub(before[motor]);
                assert!(turned > 300, "{masters:?}: M{} {turned}", motor + 1);
            }
        }
    }
}

#[test]
fn a_leader_waits_for_a_follower_that_stands() {
    for mut machine in [Machine::new(0), machine(&[0.0, 0.0])] {
        let mut outputs = following([0, 1, 0, 0]);
        outputs.duty[2] = 0;
        let counter = steps(&mut machine, outputs, 500).counter;
        assert!((1..=6).contains(&counter[0]) && counter[1] == 0, "{counter:?}");
        outputs.duty[2] = 512;
        let counter = steps(&mut machine, outputs, 500).counter;
        assert!(counter[0] > 500 && counter[0] - counter[1] <= 1, "{counter:?}");
    }
}
