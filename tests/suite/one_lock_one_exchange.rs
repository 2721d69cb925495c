//! What a program writes under one lock goes out in the same request, never torn.

use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::ExchangeData;

use crate::support::{handler_for, strict, wait_until, Record};

#[test]
fn distance_and_command_id_written_under_one_lock_are_never_seen_apart() {
    const EXCHANGES: usize = 5000;
    const DIFFERENT: usize = 100;
    let record = Record::default();
    let txt = strict().on_exchange({
        let record = record.clone();
        move |machine| record.note(machine)
    });
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();

    let mut number = 0_u16;
    let mut seen = Vec::new();
    // The operating system decides how often the two threads take turns.
    while seen.len() < EXCHANGES || different(&seen) < DIFFERENT {
        for _ in 0..1000 {
            number = number.wrapping_add(1);
            let mut areas = handler.areas().lock();
            let output = &mut areas[LOCAL_IO].output;
            *output.distance = [number; 4];
            // Enough time for a request to leave in between, if it could.
            std::hint::black_box(&mut *output);
            thread::yield_now();
            *output.motor_ex_cmd_id = [number; 4];
        }
        assert_eq!(handler.areas().error(), None);
        seen = record.outputs();
    }
    for outputs in &seen {
        // Of many commands without an answer, some go out with another high bit first.
        let low = |numbers: [u16; 4]| numbers.map(|number| number & 0x3FFF);
        assert_eq!(low(outputs.distance), low(outputs.motor_command_id), "torn outputs");
    }
    handler.end_transfer().unwrap();
}

/// How often the outputs have changed from one exchange to the next.
fn different(seen: &[ExchangeData]) -> usize {
    seen.windows(2).filter(|pair| pair[0].distance != pair[1].distance).count()
}

#[test]
fn writes_under_a_guard_stay_back_until_it_is_dropped_while_the_exchange_goes_on() {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut areas = handler.areas().lock();
    areas[LOCAL_IO].output.duty[0] = 77;
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "further exchanges", |machine| machine.exchanges() > begin + 10);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 0);
    drop(areas);
    wait_until(&txt, "the duty", |machine| machine.controllers[0].outputs.duty[0] == 77);
}
