//! Gaps: a new connection that is lost again, and threads that wait meanwhile.

use std::sync::Arc;

use super::{check, handler, program, wait_to_the_end, NO_END, WINDOW};
use crate::error::Error;
use crate::events::EventKind;
use crate::exchange::{Inputs, Outgoing};
use crate::handler::parts::phase::Stop;
use crate::handler::program::known::Known;
use crate::handler::shared::Shared;
use crate::handler::sync::now;
use crate::handler::TransferAreas;

const ORDERS: usize = 700;

fn deliver(shared: &Shared) {
    let (before, now) = (&mut Inputs::default(), &mut Inputs::default());
    shared.deliver(&Inputs::default(), before, now);
}

/// The response of a new connection is delivered, and the connection is lost before anything else happens. With a
/// listener in lock-step, its window does not open then.
fn lost_at_once(lock_step: bool) {
    let shared = Arc::new(Shared::running(None, lock_step));
    let area = TransferAreas::new(Arc::clone(&shared));
    let _listener = area.events(EventKind::ALL, 100).unwrap();
    let waits = [0, 1].map(|_| {
        let area = area.clone();
        shuttle::thread::spawn(move || wait_to_the_end(&area, |_| ()).len())
    });
    let ends = {
        let shared = Arc::clone(&shared);
        shuttle::thread::spawn(move || {
            let known = &mut Known::default();
            let mut answered = 0;
            while answered < 3 {
                if let Ok(lease) = shared.wait_cycle(known, known.returned, None) {
                    let mut lease = lease.unwrap();
                    known.returned = lease.response;
                    shared.release(&mut lease, false);
                    answered += 1;
                }
            }
            shared.ask_to_stop(Stop::Asked);
        })
    };
    let areas = &mut [Outgoing::default()];
    let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
    for _ in 0..2 {
        deliver(&shared);
        shared.lose_connection(&error, areas);
    }
    deliver(&shared);
    shared.resume(now());
    loop {
        if shared.lock_step {
            shared.open_window();
        }
        if shared.hold_window(None, WINDOW, areas).is_some() {
            break;
        }
        shuttle::thread::yield_now();
        deliver(&shared);
    }
    shared.leave(areas);
    shared.finish(None);
    ends.join().unwrap();
    for reported in waits.map(|waits| waits.join().unwrap()) {
        assert!(reported <= 2, "reported {reported} times");
    }
}

#[test]
fn a_connection_that_is_lost_with_its_first_response_confuses_no_wait() {
    check(ORDERS, || lost_at_once(false));
}

#[test]
fn in_lock_step_a_connection_that_is_lost_with_its_first_response_confuses_no_wait() {
    check(ORDERS, || lost_at_once(true));
}

/// Each handle learns of each gap, and nothing that was written before moves anything after it.
fn lost_twice(lock_step: bool, others: usize) {
    let (handler, controller) = handler(|settings| {
        settings.reconnect = Some(NO_END);
        settings.lock_step = lock_step;
    });
    controller.lose(&[2, 4]);
    let events = handler.areas().events(EventKind::ALL, 100).unwrap();
    handler.begin_transfer().unwrap();
    let waits: Vec<_> = (0..others)
        .map(|_| program(&handler, |area| wait_to_the_end(&area, |_| ()).len()))
        .collect();
    let (mut reported, mut answered) = (0, 0);
    while reported < 2 || answered < 3 {
        match handler.areas().wait_cycle() {
            Ok(mut areas) => {
                areas[0].output.duty[0] = 512;
                answered += 1;
            }
            Err(Error::ConnectionLost { .. }) => {
                reported += 1;
                handler.areas().lock()[0].output.duty[1] = reported;
            }
            Err(error) => panic!("{error:#}"),
        }
    }
    assert_eq!(reported, 2);
    handler.end_transfer().unwrap();
    assert!(waits.into_iter().all(|waits| waits.join().unwrap() <= 2));
    let requests = controller.requests();
    for pair in requests.windows(2).filter(|pair| pair[0].connection != pair[1].connection) {
        let [before_gap, after_gap, ..] = pair[1].outputs.duty;
        assert_eq!(before_gap, 0, "written before the gap");
        if lock_step && others == 0 {
            // Its first request waits until the program has answered the error.
            assert_eq!(after_gap, pair[0].connection as i16, "the request went out too early");
        }
    }
    drop(events);
}

#[test]
fn each_handle_learns_of_each_gap_once_and_goes_on() {
    check(ORDERS, || lost_twice(false, 1));
}

#[test]
fn in_lock_step_each_handle_learns_of_each_gap_once_and_goes_on() {
    check(ORDERS, || lost_twice(true, 1));
}

#[test]
fn in_lock_step_the_first_request_after_a_gap_has_the_answer_to_its_error() {
    check(ORDERS, || lost_twice(true, 0));
}

#[test]
fn in_lock_step_a_listener_receives_a_gap_without_another_response() {
    check(ORDERS, || {
        let shared = Arc::new(Shared::running(None, true));
        let area = TransferAreas::new(Arc::clone(&shared));
        let events = area.events(&[EventKind::ConnectionLost], 10).unwrap();
        let listens = shuttle::thread::spawn(move || events.recv().is_ok());
        deliver(&shared);
        shared.open_window();
        let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
        shared.lose_connection(&error, &mut [Outgoing::default()]);
        assert!(listens.join().unwrap());
    });
}
