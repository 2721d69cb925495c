//! Extended motor control in a world, stepped without sockets and without a clock.

use std::time::Duration;

use ft_transfer_area::tx::Motor;
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::world::{MotorModel, World};
use ft_transfer_area_simulator::Machine;

use crate::stepped::{forward, machine, machine_with, run_until, steps};

/// How many pulses a count may be away from its goal.
const FEW: i64 = 3;

#[test]
fn a_thousand_distances_end_within_a_few_pulses_and_never_early() {
    let mut machine = machine(&[0.2]);
    for command in 1..=1000_u16 {
        // A distance from 1 to 400 at a duty from 200 to 512, in both directions.
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
        // It stops and stays there, although the duty remains.
        let rest = steps(&mut machine, outputs, 50).counter[0];
        assert!(i64::from(rest) - i64::from(distance) <= FEW, "{distance} became {rest}");
        assert_eq!(steps(&mut machine, outputs, 10).counter[0], rest);
    }
}

#[test]
fn distances_end_within_a_few_pulses_up_to_a_tenth_of_a_second_of_inertia() {
    for (time_constant, pulses_per_second, load) in
        product([0.0, 0.03, 0.1], [50.0, 200.0, 1000.0], [0.0, 0.35])
    {
        let top_speed = pulses_per_second / MotorModel::ENCODER;
        let motor = MotorModel::encoder_motor()
            .load(load)
            .time_constant(time_constant)
            .top_speed(top_speed);
        let mut machine = machine_with(&[motor]);
        let full = pulses_per_second * (1.0 - load);
        for (id, distance) in (1..).zip([1, 2, 7, 30, 400]) {
            let outputs = ExchangeData {
                distance: [distance, 0, 0, 0],
                motor_command_id: [id, 0, 0, 0],
                ..forward(512)
            };
            let count = steps(&mut machine, outputs, 2000).counter[0];
            let wanted = distance as i16..=distance as i16 + FEW as i16;
            assert!(wanted.contains(&count), "{time_constant} {full} {distance}: {count}");
        }
        // The same while it turns, if it has a fifth of a second to slow down.
        let outputs = ExchangeData { motor_command_id: [9, 0, 0, 0], ..forward(512) };
        steps(&mut machine, outputs, 100);
        let distance = (full / 5.0).ceil() as u16;
        let outputs = ExchangeData {
            distance: [distance, 0, 0, 0],
            motor_command_id: [10, 0, 0, 0],
            ..forward(512)
        };
        let count = steps(&mut machine, outputs, 2000).counter[0];
        let wanted = distance as i16..=distance as i16 + FEW as i16;
        assert!(wanted.contains(&count), "{time_constant} {full}, turning: {count}");
    }
}

/// All combinations.
fn product<const A: usize, const B: usize, const C: usize>(
    first: [f64; A],
    second: [f64; B],
    third: [f64; C],
) -> impl Iterator<Item = (f64, f64, f64)> {
    let pairs = first.into_iter().flat_map(move |a| second.map(|b| (a, b)));
    pairs.flat_map(move |(a, b)| third.map(|c| (a, b, c)))
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
    assert!(held[0] >= 100 && held[1] <= held[0] + 5, "{held:?}");
    assert_eq!(steps(&mut machine, outputs, 100).counter, held, "both are held");
    outputs = ExchangeData { motor_command_id: [2; 4], ..forward(512) };
    let report = steps(&mut machine, outputs, 500);
    assert_eq!(report.motor_command_id, [2; 4]);
    let [first, second] = [0, 1].map(|index| report.counter[index] - held[index]);
    assert!(first > 800 && second < first - 300, "each turns as it can: {first}, {second}");
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

/// A machine without a world, and one with an encoder motor.
fn both_kinds() -> [Machine; 2] {
    [Machine::new(0), machine(&[0.1])]
}

#[test]
fn a_counter_reset_during_a_distance_moves_its_end_on() {
    for mut machine in both_kinds() {
        let mut outputs = ExchangeData {
            distance: [100, 0, 0, 0],
            motor_command_id: [1, 0, 0, 0],
            ..forward(512)
        };
        let before = steps(&mut machine, outputs, 40).counter[0];
        assert!((30..100).contains(&before), "{before}");
        outputs.counter_reset_id[0] = 1;
        let report = run_until(&mut machine, outputs, |report| {
            assert_eq!(report.motor_command_id[0] == 1, report.counter[0] >= 100, "{report:?}");
            report.motor_command_id[0] == 1
        });
        assert!((100..=103).contains(&report.counter[0]), "{report:?}");
        // A reset at the end begins nothing.
        outputs.counter_reset_id[0] = 2;
        let rest = steps(&mut machine, outputs, 50).counter[0];
        assert!((0..=3).contains(&rest), "{rest}");
    }
}

#[test]
fn a_counter_counts_when_its_level_rises() {
    for mut machine in both_kinds() {
        machine.set_outputs(0, forward(512));
        let (mut level, mut rises, mut falls) = (0, 0, 0);
        for _ in 0..1000 {
            machine.step(Duration::from_millis(1));
            let report = machine.report(0).unwrap();
            match report.counter_input[0] - level {
                1 => rises += 1,
                -1 => falls += 1,
                _ => {}
            }
            level = report.counter_input[0];
            assert_eq!(report.counter[0], rises);
        }
        assert!(rises > 100 && (rises - falls) == level, "{rises} rises, {falls} falls");
    }
}

/// Where 63 pulses end at this duty.
fn end_of_63(world: &str, duty: i16) -> i16 {
    let world = World::from_toml(world).unwrap();
    let mut machine = Machine::with_world(0, world).unwrap();
    let outputs =
        ExchangeData { distance: [63, 0, 0, 0], motor_command_id: [1, 0, 0, 0], ..forward(duty) };
    let at_once = run_until(&mut machine, outputs, |report| report.motor_command_id[0] == 1);
    assert!((63..=65).contains(&at_once.counter[0]), "it is done when it is counted: {at_once:?}");
    steps(&mut machine, outputs, 100).counter[0]
}

#[test]
fn a_motor_with_run_out_turns_beyond_its_distance_like_a_real_one() {
    const WORLD: &str = "[master.motors]\nM1 = { pulses_per_turn = 63.3, run_out = 5 }";
    // Speeds 5 and 8 of the maker's scale.
    let ends = [320, 512].map(|duty| end_of_63(WORLD, duty));
    assert!((64..=65).contains(&ends[0]) && (67..=68).contains(&ends[1]), "{ends:?}");
    let without = WORLD.replace(", run_out = 5", "");
    let exactly = WORLD.replace("run_out = 5", "run_out = 0");
    assert!((63..=66).contains(&end_of_63(&without, 512)));
    assert_eq!([320, 512].map(|duty| end_of_63(&exactly, duty)), [63, 63]);
}
