//! Which response a guard and an event belong to, and when it came in.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::{EventKind, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::support::{handler_for, unpaced, DEADLINE};

/// A simulated TXT that numbers its responses in I2, and presses I1 in every tenth.
fn numbering() -> SimulatedTxt {
    let mut number = 0;
    let txt = unpaced().on_exchange(move |machine| {
        if !machine.connected() {
            number = 0;
        }
        number += 1;
        machine.controllers[0].uni[0] = i16::from(number % 10 == 0);
        machine.controllers[0].uni[1] = number;
    });
    txt.start().unwrap()
}

fn handler(txt: &SimulatedTxt) -> TransferAreaComHandler {
    let handler = handler_for(txt).build().unwrap();
    handler.areas().lock()[LOCAL_IO].config.uni[1] = UniConfig::analog(InputMode::Voltage);
    handler
}

#[test]
fn a_guard_knows_the_number_and_the_time_of_the_response_in_its_areas() {
    let txt = numbering();
    let before = Instant::now();
    let handler = handler(&txt);
    assert_eq!(handler.areas().lock().cycle(), 0);
    handler.begin_transfer().unwrap();
    let begun = handler.areas().lock().arrived();
    assert!(begun >= before && begun <= Instant::now());
    // The first response may have been in the areas already.
    let mut last = before;
    for _ in 0..100 {
        let areas = handler.areas().wait_cycle().unwrap();
        assert_eq!(areas.cycle(), areas[LOCAL_IO].input.uni[1] as u64);
        assert!(areas.arrived() > last && areas.arrived() <= Instant::now());
        last = areas.arrived();
    }
    let areas =
        handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[0] == 1, DEADLINE).unwrap();
    assert_eq!(areas.cycle() % 10, 0);
    drop(areas);
    handler.end_transfer().unwrap();
    assert_eq!(
        handler.areas().lock().cycle(),
        handler.areas().statistics().cycles,
        "the last exchange's"
    );
    handler.begin_transfer().unwrap();
    let areas = handler.areas().wait_cycle().unwrap();
    assert!(areas.cycle() < 100, "it starts from 0 in each transfer");
}

#[test]
fn the_time_between_two_responses_is_known_to_a_program_that_is_late() {
    let txt = SimulatedTxt::builder().pace(Duration::from_millis(10)).start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    let (cycle, arrived) = {
        let areas = handler.areas().wait_cycle().unwrap();
        (areas.cycle(), areas.arrived())
    };
    std::thread::sleep(Duration::from_millis(60));
    let areas = handler.areas().wait_cycle().unwrap();
    let missed = (areas.cycle() - cycle) as u32;
    assert!(missed >= 2, "there were responses meanwhile");
    let statistics = handler.areas().statistics();
    let dt = areas.arrived() - arrived;
    assert!(dt >= statistics.shortest_cycle * missed && dt <= statistics.longest_cycle * missed);
}

#[test]
fn an_event_knows_the_number_and_the_time_of_the_response_that_told_it() {
    let txt = numbering();
    let handler = handler(&txt);
    let kinds = [EventKind::InputChanged, EventKind::TransferEnded];
    let events = handler.areas().events(&kinds, 10_000).unwrap();
    handler.begin_transfer().unwrap();
    let mut arrivals = Vec::new();
    while arrivals.len() < 50 {
        let areas = handler.areas().wait_cycle().unwrap();
        arrivals.push((areas.cycle(), areas.arrived()));
    }
    handler.end_transfer().unwrap();
    let cycles = handler.areas().statistics().cycles;
    let mut reported: Vec<_> = events.receiver().try_iter().collect();
    let end = reported.pop().unwrap();
    assert_eq!(end.cycle, cycles);
    assert!(end.arrived >= handler.areas().lock().arrived());
    assert!(reported.len() >= 8, "{reported:?}");
    for event in reported {
        assert!(matches!(event.cycle % 10, 0 | 1), "{event:?}");
        if let Some((_, arrived)) = arrivals.iter().find(|(cycle, _)| *cycle == event.cycle) {
            assert_eq!(event.arrived, *arrived);
        }
    }
}
