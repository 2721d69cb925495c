//! What a program writes under one lock goes out in the same request, never torn.

use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;

use crate::support::{handler_for, unpaced, wait_until, Record};

#[test]
fn distance_and_command_id_written_under_one_lock_are_never_seen_apart() {
    const EXCHANGES: u64 = 5000;
    let record = Record::default();
    let txt = unpaced().on_exchange({
        let record = record.clone();
        move |machine| record.note(machine)
    });
    let txt = txt.start().unwrap();
    let mut handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();

    let mut number = 0_u16;
    while txt.with_machine(|machine| machine.exchanges()) < EXCHANGES {
        number = number.wrapping_add(1);
        let mut areas = handler.lock();
        let output = &mut areas[LOCAL_IO].output;
        output.distance = [number; 4];
        // Time enough for a request to leave in between, if it could.
        std::hint::black_box(&mut *output);
        std::thread::yield_now();
        output.motor_ex_cmd_id = [number; 4];
    }
    let seen = record.outputs();
    for outputs in &seen {
        assert_eq!(outputs.distance, outputs.motor_command_id, "torn outputs");
    }
    let mut numbers: Vec<u16> = seen.iter().map(|outputs| outputs.distance[0]).collect();
    numbers.dedup();
    assert!(numbers.len() > 100, "only {} different outputs were seen", numbers.len());
    handler.end_transfer().unwrap();
}

#[test]
fn a_guard_that_is_held_keeps_its_writes_to_itself_while_the_exchange_goes_on() {
    let txt = unpaced().start().unwrap();
    let mut handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut areas = handler.lock();
    areas[LOCAL_IO].output.duty[0] = 77;
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "further exchanges", |machine| machine.exchanges() > begin + 10);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 0);
    drop(areas);
    wait_until(&txt, "the duty", |machine| machine.controllers[0].outputs.duty[0] == 77);
}
