//! Extended motor control in a world, stepped without sockets and without a clock.

use std::collections::BTreeMap;
use std::time::Duration;

use ft_transfer_area::simulator::world::{MotorModel, World};
use ft_transfer_area::simulator::Machine;
use ft_transfer_area::tx::Motor;
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};

/// Machine time of an exchange.
const STEP: Duration = Duration::from_millis(10);

/// Pulses by which a count may miss its goal.
const FEW: i64 = 3;

/// Pulses by which synchronised motors may differ.
const APART: i64 = 6;

/// A machine with encoder motors that have these loads, from M1 on.
fn machine(loads: &[f64]) -> Machine {
    let motors = Motor::ALL.into_iter().zip(loads);
    let motors =
        motors.map(|(output, &load)| (output, MotorModel { load, ..MotorModel::with_encoder() }));
    let mut world = World::from_toml("").unwrap();
    world.master.motors = motors.collect::<BTreeMap<_, _>>();
    Machine::with_world(0, world).unwrap()
}

/// All motors forward at this duty.
fn forward(duty: i16) -> ExchangeData {
    ExchangeData { duty: [duty, 0, duty, 0, duty, 0, duty, 0], ..Default::default() }
}

/// Steps until the condition holds for what is reported.
fn run_until(
    machine: &mut Machine,
    outputs: ExchangeData,
    mut condition: impl FnMut(&ExchangeDataResponse) -> bool,
) -> ExchangeDataResponse {
    for _ in 0..100_000 {
        machine.set_outputs(0, outputs);
        machine.step(STEP);
        let report = machine.report(0).unwrap();
        if condition(&report) {
            return report;
        }
    }
    panic!("it did not come about: {:?}", machine.report(0));
}

fn steps(machine: &mut Machine, outputs: ExchangeData, count: usize) -> ExchangeDataResponse {
    let mut left = count;
    run_until(machine, outputs, |_| {
        left -= 1;
        left == 0
    })
}

#[test]
fn a_thousand_distances_end_within_a_few_pulses_and_never_early() {
    let mut machine = machine(&[0.2]);
    for command in 1..=1000_u16 {
        // Something between 1 and 400, at something between 200 and 512, either way.
        let distance = 1 + command.wrapping_mul(7919) % 400;
        let duty = 200 + (command.wrapping_mul(31) % 313) as i16;
        let mut outputs = ExchangeData::default();
        outputs.duty[usize::from(command % 2)] = duty;
        outputs.distance[0] = distance;
        outputs.motor_command_id[0] = command;
        let report = run_until(&mut machine, outputs, |report| {
            let done = report.motor_command_id[0] == command;
            let counted = report.counter[0] >= distance as i16;
            assert_eq!(done, counted, "command {command}: {report:?}");
            done
        });
        assert!(report.motor_command_id[0] == command);
        // It comes to rest and stays there, though the duty remains.
        let rest = steps(&mut machine, outputs, 50).counter[0];
        assert!(i64::from(rest) - i64::from(distance) <= FEW, "{distance} became {rest}");
        assert_eq!(steps(&mut machine, outputs, 10).counter[0], rest);
    }
}

#[test]
fn inertia_up_to_a_tenth_of_a_second_makes_no_difference() {
    for time_constant in [0.0, 0.01, 0.1] {
        let mut world = World::from_toml("").unwrap();
        let motor = MotorModel { time_constant, ..MotorModel::with_encoder() };
        world.master.motors.insert(Motor::M1, motor);
        let mut machine = Machine::with_world(0, world).unwrap();
        let outputs = ExchangeData {
            distance: [500, 0, 0, 0],
            motor_command_id: [1, 0, 0, 0],
            ..forward(512)
        };
        let count = steps(&mut machine, outputs, 1000).counter[0];
        assert!((500..=500 + FEW as i16).contains(&count), "{time_constant}: {count}");
    }
}

/// The furthest that two counters were apart, over so many pulses of the first.
fn furthest_apart(
    machine: &mut Machine,
    outputs: ExchangeData,
    pulses: i16,
    pair: [usize; 2],
) -> i64 {
    let mut furthest = 0;
    run_until(machine, outputs, |report| {
        let [first, second] = pair.map(|index| i64::from(report.counter[index]));
        furthest = furthest.max((first - second).abs());
        report.counter[pair[0]] >= pulses
    });
    furthest
}

#[test]
fn synchronised_motors_stay_together_under_different_loads() {
    for loads in [[0.0, 0.5], [0.5, 0.0], [0.1, 0.3]] {
        let outputs =
            ExchangeData { master: [0, 1, 0, 0], motor_command_id: [0, 1, 0, 0], ..forward(512) };
        let apart = furthest_apart(&mut machine(&loads), outputs, 5000, [0, 1]);
        assert!(apart <= APART, "{loads:?}: {apart}");
        let free = furthest_apart(&mut machine(&loads), forward(512), 5000, [0, 1]);
        assert!(free > 1000, "they differ without it");
    }
}

#[test]
fn a_group_waits_for_its_slowest() {
    let outputs =
        ExchangeData { master: [0, 1, 1, 1], motor_command_id: [0, 1, 1, 1], ..forward(512) };
    for follower in 1..4 {
        let mut machine = machine(&[0.0, 0.1, 0.6, 0.3]);
        let apart = furthest_apart(&mut machine, outputs, 3000, [0, follower]);
        assert!(apart <= APART, "M{}: {apart}", follower + 1);
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
fn an_injected_error_shifts_the_difference_by_as_much() {
    let mut machine = machine(&[0.0, 0.0]);
    let mut outputs =
        ExchangeData { master: [0, 5, 0, 0], motor_command_id: [0, 1, 0, 0], ..forward(512) };
    let mut expected = 0;
    for (id, error) in [(1, 0), (2, 40), (3, -100), (4, 25)] {
        outputs.distance[1] = error as u16;
        outputs.motor_command_id[1] = id;
        expected += i64::from(error);
        let report = steps(&mut machine, outputs, 500);
        let difference = i64::from(report.counter[1]) - i64::from(report.counter[0]);
        assert!((difference - expected).abs() <= FEW, "{difference} instead of {expected}");
        assert_eq!(report.motor_command_id[1], 0, "it is never done");
    }
}

#[test]
fn a_command_replaces_the_one_that_runs() {
    let mut machine = machine(&[0.0]);
    let mut outputs =
        ExchangeData { distance: [500, 0, 0, 0], motor_command_id: [1, 0, 0, 0], ..forward(512) };
    assert!((100..400).contains(&steps(&mut machine, outputs, 100).counter[0]));
    outputs.distance[0] = 200;
    outputs.motor_command_id[0] = 2;
    let report = run_until(&mut machine, outputs, |report| {
        assert_ne!(report.motor_command_id[0], 1);
        report.motor_command_id[0] == 2
    });
    assert!((200..=203).contains(&report.counter[0]), "{report:?}");
}

#[test]
fn distance_and_master_0_leave_the_mode() {
    let mut machine = machine(&[0.0, 0.5]);
    let mut outputs = ExchangeData {
        master: [0, 1, 0, 0],
        distance: [100, 0, 0, 0],
        motor_command_id: [1, 1, 0, 0],
        ..forward(512)
    };
    let held = steps(&mut machine, outputs, 500).counter;
    assert!(held[0] >= 100 && held[1] <= held[0] + APART as i16, "{held:?}");
    assert_eq!(steps(&mut machine, outputs, 100).counter, held, "both are held");
    outputs = ExchangeData { motor_command_id: [2; 4], ..forward(512) };
    let report = steps(&mut machine, outputs, 500);
    assert_eq!(report.motor_command_id, [2; 4]);
    let [first, second] = [0, 1].map(|index| report.counter[index] - held[index]);
    assert!(first > 800 && second < first - 300, "each turns as it can: {first}, {second}");
}

#[test]
fn a_follower_that_is_switched_off_is_not_waited_for() {
    let mut machine = machine(&[0.0, 0.0]);
    let mut outputs =
        ExchangeData { master: [0, 1, 0, 0], motor_command_id: [0, 1, 0, 0], ..forward(512) };
    outputs.duty[2] = 0;
    let counter = steps(&mut machine, outputs, 500).counter;
    assert!(counter[0] > 800 && counter[1] == 0, "{counter:?}");
}

#[test]
fn the_same_script_gives_the_same_trace_in_steps_of_any_length() {
    let trace = |step: u64| {
        let mut machine = machine(&[0.0, 0.37, 0.1]);
        let mut trace = Vec::new();
        for command in 1..=50 {
            let outputs = ExchangeData {
                master: [0, 1, 5, 0],
                distance: [command * 3, 0, 7, 0],
                motor_command_id: [command, 1, command, 0],
                ..forward(400 + 2 * command as i16)
            };
            machine.set_outputs(0, outputs);
            for _ in 0..400 / step {
                machine.step(Duration::from_millis(step));
            }
            let world = machine.world().unwrap();
            let speeds = Motor::ALL.map(|motor| world.motor_speed(0, motor));
            trace.push((machine.report(0).unwrap().counter, speeds, world.time()));
        }
        trace
    };
    let first = trace(10);
    assert_eq!(trace(10), first);
    assert_eq!(trace(1), first);
    assert_eq!(trace(400), first);
}
