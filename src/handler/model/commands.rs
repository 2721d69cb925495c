//! Commands that are ordered while the outputs are stopped are never reported as done.

use std::sync::Arc;
use std::time::Duration;

use super::controller::Controller;
use super::{check, handler, program, NO_END};
use crate::handler::program::area::TransferAreas;
use crate::handler::settings::Settings;
use crate::handler::sync::pass;
use crate::terminals::Motor;
use crate::transfer_area::{FishX1Transfer, LOCAL_IO};

const ORDERS: usize = 700;

const LIMIT: Duration = Duration::from_millis(100);

/// Orders command after command, each with a number of its own, whatever happens to the transfer. What is reported as done
/// must have come to the controller.
fn order(area: &TransferAreas, controller: &Controller, longer: Duration) {
    let check = |areas: &[FishX1Transfer], number: u16| {
        let area = &areas[LOCAL_IO];
        let driven = !area.is_motor_ex_ready(Motor::M1) || controller.has_driven(number);
        assert!(driven, "M1 was not sent to {number}");
        let played = !area.is_sound_ready() || controller.has_played(number);
        assert!(played, "sound {number} was not played");
    };
    for number in 1..=3 {
        let mut areas = area.lock();
        let master = &mut areas[LOCAL_IO];
        master.output.distance[0] = number;
        master.raise_motor_ex_cmd_id(Motor::M1);
        master.set_sound(number, 1).unwrap();
        pass(longer);
        drop(areas);
        check(&area.lock(), number);
        for _ in 0..2 {
            match area.wait_cycle() {
                Ok(areas) => check(&areas, number),
                Err(_) => check(&area.lock(), number),
            }
        }
    }
}

/// Two threads order, and another one ends the transfer some time.
fn ends(set: impl FnOnce(&mut Settings), losing: &[usize], longer: Duration) {
    let (handler, controller) = handler(set);
    controller.lose(losing);
    handler.begin_transfer().unwrap();
    let orders = {
        let controller = Arc::clone(&controller);
        program(&handler, move |area| order(&area, &controller, longer))
    };
    let locks = program(&handler, |area| drop(area.lock()));
    controller.wait_for(|_| true);
    // The last exchange may be one that is lost.
    let _ = handler.end_transfer();
    // A new transfer sends ids again that a stop has taken.
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle());
    let _ = handler.end_transfer();
    orders.join().unwrap();
    locks.join().unwrap();
}

#[test]
fn no_command_that_the_end_refuses_is_reported_as_done() {
    check(ORDERS, || ends(|_| (), &[], Duration::ZERO));
}

#[test]
fn no_command_that_a_gap_refuses_is_reported_as_done() {
    let reconnect = |settings: &mut Settings| settings.reconnect = Some(NO_END);
    check(ORDERS, move || ends(reconnect, &[2, 4], Duration::ZERO));
}

#[test]
fn no_command_that_the_watchdog_refuses_is_reported_as_done() {
    let watchdog = |settings: &mut Settings| settings.watchdog = Some(LIMIT);
    check(ORDERS, move || ends(watchdog, &[], LIMIT));
}
