//! `txt compare`: the first cycle in which two recordings differ.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{InputMode, LOCAL_IO};
use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::{FishX1Transfer, LoggedCycle, TransferAreaComHandler};
use ft_transfer_area_recorder::{Options, Recorder, Transfer};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::recording::{in_folder, run, said, DEADLINE};

/// The first cycle in which the motor may have another duty.
const LATER: usize = 20;

/// A transfer on the slide: M1 has this duty from a cycle on, and gets a command.
struct Plan {
    duty: i16,
    cycles: usize,
    /// How many transfers were before it.
    before: usize,
    fault: Option<Fault>,
}

impl Default for Plan {
    fn default() -> Self {
        Self { duty: 300, cycles: 40, before: 0, fault: None }
    }
}

/// Records the last transfer.
fn record(path: &str, plan: &Plan) {
    let txt = SimulatedTxt::builder().world(World::shipped("slide").unwrap()).lock_step();
    let txt = plan.fault.iter().cloned().fold(txt, |txt, fault| txt.fault(fault)).start().unwrap();
    let builder = TransferAreaComHandler::builder(txt.address()).lock_step();
    let handler = builder.reconnect(DEADLINE).build().unwrap();
    for _ in 0..plan.before {
        handler.begin_transfer().unwrap();
        handler.areas().lock()[LOCAL_IO].raise_motor_ex_cmd_id(Motor::M2);
        handler.areas().wait_cycle().map(drop).unwrap();
        handler.end_transfer().unwrap();
    }
    let options = Options::default().capacity(6_000);
    let recorder = Recorder::start(&handler, Path::new(path), options).unwrap();
    handler.begin_transfer().unwrap();
    for cycle in 1..=plan.cycles {
        // A gap stops the motors.
        let Ok(mut areas) = handler.areas().wait_cycle() else { continue };
        let area = &mut areas[LOCAL_IO];
        area.output.duty[0] = if cycle + 1 < LATER { 512 } else { plan.duty };
        if cycle == 10 {
            area.raise_motor_ex_cmd_id(Motor::M2);
        }
    }
    handler.end_transfer().unwrap();
    assert_eq!(recorder.finish().unwrap().lost, 0);
}

/// Compares recordings of two plans; returns status and text.
fn compare(plans: [&Plan; 2], options: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["one.mcap", "other.mcap"].map(|name| in_folder(&folder, name));
    for (path, plan) in paths.iter().zip(plans) {
        record(path, plan);
    }
    let output = run(&[&["compare", &paths[0], &paths[1]], options].concat());
    (output.status.code(), said(&output))
}

#[test]
fn two_runs_of_a_program_are_the_same_whatever_ids_they_begin_with() {
    let first = Plan::default();
    let (status, said) = compare([&first, &Plan { before: 2, ..Plan::default() }], &[]);
    assert_eq!(status, Some(0), "{said}");
    assert!(said.starts_with("All ") && said.contains(" cycles are the same."), "{said}");
}

#[test]
fn the_first_cycle_that_differs_is_told_with_both_values() {
    let (status, said) = compare([&Plan::default(), &Plan { duty: 400, ..Plan::default() }], &[]);
    assert_eq!(status, Some(1), "{said}");
    assert!(
        said.contains(&format!("{} cycles are the same. Cycle {LATER} differs, ", LATER - 1)),
        "{said}"
    );
    let values = |name: &str| {
        let line = said
            .lines()
            .find(|line| line.contains(name))
            .unwrap_or_else(|| panic!("{name}: {said}"));
        line.split_whitespace().rev().take(2).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(values("/TXT/outputs O1 "), ["400", "300"]);
    assert_eq!(values("/TXT/outputs M1 "), ["400", "300"]);
    assert!(!said.contains("/TXT/outputs M2"), "{said}");
    // What is not named is not compared.
    let (status, said) =
        compare([&Plan::default(), &Plan { duty: 400, ..Plan::default() }], &["M2", "I1"]);
    assert_eq!(status, Some(0), "{said}");
}

#[test]
fn the_same_number_in_another_unit_differs() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["one.mcap", "other.mcap"].map(|name| in_folder(&folder, name));
    for (path, mode) in paths.iter().zip([InputMode::Resistance, InputMode::Voltage]) {
        let (recorder, mut feed) = Recorder::fed(path, Options::default()).unwrap();
        let mut area = FishX1Transfer::default();
        area.set_ft_uni_config(Input::I1, mode, false);
        area.input.uni[0] = 1000;
        feed.cycle(LoggedCycle::new(1, &[area]));
        area.set_ft_uni_config(Input::I1, InputMode::Ultrasonic, false);
        area.input.uni[0] = 30;
        feed.cycle(LoggedCycle::new(2, &[area]));
        drop(feed);
        recorder.finish().unwrap();
    }
    let output = run(&["compare", &paths[0], &paths[1], "I1"]);
    let told = said(&output);
    assert!(output.status.code() == Some(1) && told.contains("1000 Ω"), "{told}");
    assert!(told.contains("1000 mV"), "{told}");
    // A table says so.
    let told = said(&run(&["csv", &paths[0], "I1"]));
    assert!(told.contains("s on I1 has cm in place of Ω"), "{told}");
    assert!(!said(&run(&["csv", &paths[0], "I2"])).contains("in place of"));
}

#[test]
fn one_that_goes_on_or_is_connected_again_differs() {
    let (status, said) =
        compare([&Plan::default(), &Plan { cycles: 60, ..Plan::default() }], &["I8"]);
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("Then only ") && said.contains("other.mcap has a cycle "), "{said}");
    let fault = Some(Fault::at_exchange(15, FaultKind::WrongCrc));
    let (status, said) = compare([&Plan::default(), &Plan { fault, ..Plan::default() }], &[]);
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("Cycle 16 differs") && said.contains("connection"), "{said}");
}

#[test]
fn both_are_drawn_over_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let [one, other, svg] =
        ["one.mcap", "other.mcap", "both.svg"].map(|name| in_folder(&folder, name));
    record(&one, &Plan::default());
    record(&other, &Plan { duty: 400, ..Plan::default() });
    let output = run(&["compare", &one, &other, "M1", "C1", "--plot", &svg]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let picture = fs::read_to_string(&svg).unwrap();
    for text in ["one.mcap wide, other.mcap thin", "first difference", "time since the first cycle"]
    {
        assert_eq!(picture.matches(text).count(), 1, "{text}");
    }
    let lines: Vec<&str> = picture
        .lines()
        // Those with a width of 3 are beside the names.
        .filter(|line| line.starts_with("<polyline") && line.contains("#0969DA"))
        .filter(|line| !line.contains("stroke-width=\"3\""))
        .collect();
    let wide = |line: &&&str| line.contains("stroke-width=\"7\"");
    // M1 and C1, each in its panel, of both.
    assert_eq!(lines.iter().filter(wide).count(), 2, "{lines:?}");
    assert_eq!(lines.len(), 4, "{lines:?}");
}

#[test]
fn mistakes_are_no_differences() {
    let folder = tempfile::tempdir().unwrap();
    let [one, empty, missing] =
        ["one.mcap", "empty.mcap", "missing.mcap"].map(|name| in_folder(&folder, name));
    record(&one, &Plan::default());
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    Recorder::start(&handler, &empty, Options::default()).unwrap().finish().unwrap();
    for args in [
        &["compare", &one, &missing][..],
        &["compare", &one],
        &["compare", &one, &one, "I9"],
        &["compare", &one, &one, "--plot", &one],
        &["compare", &one, &one, "E4.I1"],
        &["compare", &one, &one, "M1", "--plot", "/no/such/folder/both.svg"],
        &["compare", &empty, &empty],
    ] {
        let output = run(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
    }
    assert!(run(&["info", &one]).status.success());
}

/// Where the disk was too slow for one of the two, only the others are compared.
#[test]
fn cycles_that_one_has_lost_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let [one, other] = ["one.mcap", "other.mcap"].map(|name| in_folder(&folder, name));
    let txt = SimulatedTxt::builder().pace(Duration::ZERO).lock_step().start().unwrap();
    let builder = TransferAreaComHandler::builder(txt.address()).lock_step();
    let handler = builder.build().unwrap();
    let all = Recorder::start(&handler, &one, Options::default().capacity(6_000)).unwrap();
    // Checked too rarely for so few places.
    let some = Recorder::start(&handler, &other, Options::default().capacity(1)).unwrap();
    handler.begin_transfer().unwrap();
    for number in 0..3_000 {
        handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[2] = number % 512;
    }
    handler.end_transfer().unwrap();
    assert_eq!(all.finish().unwrap().lost, 0);
    let lost = some.finish().unwrap().lost;
    assert!(lost > 0, "nothing was lost");
    let output = run(&["compare", &one, &other]);
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("cycles are left out"), "{}", said(&output));
}

/// Those before the end of a transfer, too, which no cycle has as lost.
#[test]
fn cycles_that_one_has_lost_at_an_end_are_left_out_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let [one, other] = ["one.mcap", "other.mcap"].map(|name| in_folder(&folder, name));
    for (path, lost) in [(&one, 0), (&other, 5)] {
        let (recorder, mut feed) = Recorder::fed(path, Options::default()).unwrap();
        for _ in 0..2 {
            let began = Transfer::Began {
                device_name: "SLIDE".to_owned(),
                firmware: "4.7.0".to_owned(),
                address: String::new(),
                areas: 1,
            };
            feed.transfer(Instant::now(), began);
            for number in 1..=20 - lost {
                feed.cycle(LoggedCycle::new(number, &[FishX1Transfer::default()]));
            }
            if lost > 0 {
                feed.transfer(Instant::now(), Transfer::NotRecorded { entries: lost });
            }
            feed.transfer(Instant::now(), Transfer::Ended);
        }
        assert_eq!(recorder.finish().unwrap().lost, 0);
    }
    let output = run(&["compare", &one, &other]);
    assert!(output.status.success(), "{}", said(&output));
    let left_out = "10 cycles are left out: they are not in one of the two.";
    assert!(said(&output).contains(left_out), "{}", said(&output));
    let info = run(&["info", &other, "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!((&info["lost"], &info["transfers"]), (&10.into(), &2.into()));
    assert_eq!(info["unusual_counts"]["not_recorded"], 10);
}
