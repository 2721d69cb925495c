//! The sample that rides out a lost connection.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{Machine, SimulatedTxt};
use ft_transfer_area::wire::ExchangeData;

use crate::ports::unused_ports;
use crate::program::DEADLINE;
use crate::samples::Run;

/// What stands in these lines, in this order.
fn assert_in_order(lines: &[String], parts: &[&str]) {
    let mut rest = lines.iter();
    for part in parts {
        assert!(rest.any(|line| line.contains(part)), "no {part:?} in its place: {lines:#?}");
    }
}

#[test]
fn it_tells_of_the_gap_and_works_on_and_the_way_that_was_cut_off_is_never_done() {
    let mut run = Run::simulated("wlan");
    run.wait_for("is restored after");
    run.wait_for("done after");
    run.interrupt();
    let lines = run.finish();
    let stopped = "M1 has duty 0 and 0; its last way reads as not done.";
    assert_in_order(
        &lines,
        &[
            "M1 looks for the start.",
            "M1 runs 50 pulses there.",
            "  done after 5",
            "M1 runs 250 pulses",
            "is switched off",
            "Lost: the connection to the controller was lost and is being made again",
            stopped,
            "is switched on again",
            "is restored after",
            stopped,
            "M1 looks for the start.",
            "M1 runs 50 pulses there.",
            "  done after 5",
            "Connections that were lost and made again: 1.",
        ],
    );
    // From the way that was cut off to the next one nothing is done.
    let off = lines.iter().position(|line| line.contains("is switched off")).unwrap();
    let again = off + lines[off..].iter().position(|line| line.contains("looks for")).unwrap();
    let cut_off = lines[..off].iter().rposition(|line| line.contains("M1 runs")).unwrap();
    assert!(!lines[cut_off..again].iter().any(|line| line.contains("  done")), "{lines:#?}");
    let seconds =
        lines.iter().find_map(|line| line.strip_prefix("The connection is restored after "));
    let seconds: f64 = seconds.unwrap().strip_suffix(" s.").unwrap().parse().unwrap();
    assert!(seconds >= 3.0, "{seconds}");
}

#[test]
fn after_a_gap_the_motor_stands_until_the_program_looks_for_the_start() {
    let record: Arc<Mutex<Vec<(bool, ExchangeData)>>> = Arc::default();
    let first_port = unused_ports();
    let start = || {
        let noted = Arc::clone(&record);
        let world = format!("{}/examples/worlds/slide.toml", env!("CARGO_MANIFEST_DIR"));
        let note = move |machine: &mut Machine| {
            let is_at_start = machine.controllers[0].uni[0] != 0;
            noted.lock().unwrap().push((is_at_start, machine.controllers[0].outputs));
        };
        let unpaced = SimulatedTxt::builder().pace(Duration::ZERO);
        let txt = unpaced.port(first_port).world(World::load(world).unwrap());
        txt.on_exchange(note).start().unwrap()
    };
    let drives = |machine: &Machine| {
        let controller = &machine.controllers[0];
        controller.outputs.distance[0] > 0 && controller.counter[0] > 20
    };
    let txt = start();
    let mut run = Run::start("wlan", &["--seconds", "3600", &txt.address().to_string()]);
    assert!(txt.wait_until(DEADLINE, drives), "it does not drive");
    drop(txt);
    run.wait_for("Lost: ");
    record.lock().unwrap().clear();
    let txt = start();
    assert!(txt.wait_until(DEADLINE, drives), "it does not drive again");
    run.interrupt();
    run.finish();

    let record = record.lock().unwrap();
    assert_eq!((record[0].1.duty, record[0].1.distance), ([0; 8], [0; 4]), "the first request");
    let runs = record.iter().position(|(_, outputs)| outputs.duty != [0; 8]).unwrap();
    let arrives = record.iter().position(|(is_at_start, _)| *is_at_start).unwrap();
    assert!(runs < arrives, "it has to look for its start");
    for (_, outputs) in &record[..arrives] {
        assert_eq!(outputs.distance, [0; 4]);
        assert!(outputs.duty[0] == 0, "the way that was cut off goes on: {outputs:?}");
    }
}
