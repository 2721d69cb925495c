//! The sample that goes on after a lost connection.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::checks::GAP;
use super::run::{assert_in_order, Run};
use crate::ports::unused_ports;
use crate::program::DEADLINE;

/// The default world with its slide in the middle.
fn away_from_the_start() -> World {
    let mut world = World::default();
    for slide in world.master.motors.values_mut().filter_map(|motor| motor.slide.as_mut()) {
        slide.position = 200.0;
    }
    world
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn after_a_gap_the_motor_stands_until_the_program_looks_for_the_start_and_the_way_is_not_done() {
    let record: Arc<Mutex<Vec<(bool, ExchangeData)>>> = Arc::default();
    let first_port = unused_ports();
    let start = || {
        let noted = Arc::clone(&record);
        let note = move |machine: &mut Machine| {
            let is_at_start = machine.controllers[0].uni[3] != 0;
            noted.lock().unwrap().push((is_at_start, machine.controllers[0].outputs));
        };
        let unpaced = SimulatedTxt::builder().pace(Duration::ZERO);
        let txt = unpaced.port(first_port).world(away_from_the_start());
        txt.on_exchange(note).start().unwrap()
    };
    let drives = |machine: &Machine| {
        let controller = &machine.controllers[0];
        controller.outputs.distance[2] > 0 && controller.counter[2] > 20
    };
    let txt = start();
    let mut run = Run::start("wifi", &[&txt.address().to_string()]);
    assert!(txt.wait_until(drives, DEADLINE), "it does not drive");
    drop(txt);
    run.wait_for("Lost: ");
    record.lock().unwrap().clear();
    let txt = start();
    assert!(txt.wait_until(drives, DEADLINE), "it does not drive again");
    run.interrupt();
    let lines = run.finish();
    assert_in_order(&lines, &GAP);
    // Between the interrupted movement and the next one, none is reported as done.
    let lost = lines.iter().position(|line| line.starts_with("Lost: ")).unwrap();
    let again = lost + lines[lost..].iter().position(|line| line.contains("looks for")).unwrap();
    let cut_off = lines[..lost].iter().rposition(|line| line.contains("M3 runs")).unwrap();
    assert!(!lines[cut_off..again].iter().any(|line| line.contains("  done")), "{lines:#?}");

    let record = record.lock().unwrap();
    assert_eq!((record[0].1.duty, record[0].1.distance), ([0; 8], [0; 4]), "the first request");
    let runs = record.iter().position(|(_, outputs)| outputs.duty != [0; 8]).unwrap();
    let arrives = record.iter().position(|(is_at_start, _)| *is_at_start).unwrap();
    assert!(runs < arrives, "it must look for its start");
    for (_, outputs) in &record[..arrives] {
        assert_eq!(outputs.distance, [0; 4]);
        assert!(outputs.duty[4] == 0, "the interrupted movement goes on: {outputs:?}");
    }
}
