//! What the threads share, without a connection: outputs, inputs and windows.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use shuttle::sync::Mutex;
use shuttle::thread;

use super::{check, NO_END, WINDOW};
use crate::error::Error;
use crate::exchange::{Inputs, Outgoing};
use crate::handler::parts::phase::Stop;
use crate::handler::program::known::Known;
use crate::handler::shared::Shared;
use crate::wire::ExchangeDataResponse;

const ORDERS: usize = 3000;

fn shared() -> Arc<Shared> {
    Arc::new(Shared::running(None, false))
}

/// The transfer thread's part: response after response, with its number in the inputs, until it is
/// stopped or this number is reached. Returns the outputs of each request.
fn exchange(shared: &Shared, responses: i16, window: Duration) -> Vec<Outgoing> {
    let mut areas = [Outgoing::default()];
    let mut requests = Vec::new();
    let (mut before, mut now) = (Inputs::default(), Inputs::default());
    for number in 1..=responses {
        let mut inputs = Inputs::default();
        inputs.take_simple(ExchangeDataResponse { uni: [number; 8], ..Default::default() });
        let (_, locked) = shared.deliver(&inputs, &mut before, &mut now);
        let stop = shared.hold_window(locked, window, &mut areas);
        requests.push(areas[0]);
        if stop.is_some() {
            break;
        }
    }
    shared.leave(&mut areas);
    requests.push(areas[0]);
    shared.finish(None);
    requests
}

/// A program's part: waits for a response and answers it in two outputs.
fn answer(shared: &Shared, known: &mut Known) -> Result<i16, Error> {
    let after = known.returned;
    let mut lease = shared.wait_cycle(known, after, None)?.expect("there is no limit");
    known.returned = lease.response;
    let asked = lease.areas[0].input.uni[0];
    lease.areas[0].output.duty[0] = asked;
    lease.areas[0].output.duty[1] = asked;
    shared.release(&mut lease, false);
    Ok(asked)
}

#[test]
fn no_request_is_torn_and_every_thread_learns_of_the_end() {
    check(ORDERS, || {
        let shared = shared();
        let programs: Vec<_> = (0..2)
            .map(|_| {
                let shared = Arc::clone(&shared);
                thread::spawn(move || {
                    let mut known = Known::default();
                    while answer(&shared, &mut known).is_ok() {}
                })
            })
            .collect();
        let requests = exchange(&shared, 4, WINDOW);
        programs.into_iter().for_each(|program| program.join().unwrap());
        for request in &requests {
            assert_eq!(request.output.duty[0], request.output.duty[1], "torn");
        }
        assert_eq!(requests.last().unwrap().output.duty, [0; 8]);
    });
}

#[test]
fn a_response_is_answered_in_the_next_request_by_all_waiting_threads() {
    check(ORDERS, || {
        let shared = shared();
        let answers = Arc::new(Mutex::new(HashSet::new()));
        let programs: Vec<_> = (0..2)
            .map(|_| {
                let (shared, answers) = (Arc::clone(&shared), Arc::clone(&answers));
                thread::spawn(move || {
                    let mut known = Known::default();
                    while let Ok(asked) = answer(&shared, &mut known) {
                        answers.lock().unwrap().insert(asked);
                    }
                })
            })
            .collect();
        // Each window ends by the answers, so none of them can be late.
        let requests = exchange(&shared, 4, NO_END);
        programs.into_iter().for_each(|program| program.join().unwrap());
        for (number, request) in (1..=4).zip(&requests) {
            assert!(answers.lock().unwrap().contains(&number), "{number} was not answered");
            assert_eq!(request.output.duty[0], number, "answered late");
        }
        assert_eq!(shared.state().statistics.late_reactions, 0);
    });
}

#[test]
fn in_lock_step_a_request_has_all_that_was_written_before_the_wait_and_every_thread_learns_of_the_end(
) {
    check(ORDERS, || {
        let shared = Arc::new(Shared::running(None, true));
        let program = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let known = &mut Known::default();
                for number in 1..=3 {
                    for pin in 0..2 {
                        let mut lease = shared.lock(*known);
                        lease.areas[0].output.duty[pin] = number;
                        shared.release(&mut lease, false);
                    }
                    let after = known.returned;
                    let mut lease = shared.wait_cycle(known, after, None).unwrap().unwrap();
                    known.returned = lease.response;
                    assert_eq!(lease.cycle, number as u64);
                    shared.release(&mut lease, false);
                }
                shared.ask_to_stop(Stop::Asked);
            })
        };
        let locker = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                for number in 1..=2 {
                    let mut lease = shared.lock(Known::default());
                    lease.areas[0].output.duty[2] = number;
                    lease.areas[0].output.duty[3] = number;
                    shared.release(&mut lease, false);
                }
            })
        };
        let mut areas = [Outgoing::default()];
        let mut requests = Vec::new();
        while shared.hold_window(None, WINDOW, &mut areas).is_none() {
            requests.push(areas[0].output.duty);
            let (mut before, mut now) = (Inputs::default(), Inputs::default());
            shared.deliver(&Inputs::default(), &mut before, &mut now);
        }
        shared.finish(None);
        program.join().unwrap();
        locker.join().unwrap();
        assert_eq!(requests.len(), 3);
        for (number, duty) in (1..).zip(&requests) {
            assert_eq!(duty[..2], [number; 2]);
            assert_eq!(duty[2], duty[3], "torn");
        }
    });
}

#[test]
fn threads_that_lock_keep_no_other_out_and_none_of_their_writes_is_lost() {
    check(ORDERS, || {
        let shared = shared();
        let lockers: Vec<_> = (0..2)
            .map(|index| {
                let shared = Arc::clone(&shared);
                thread::spawn(move || {
                    for _ in 0..3 {
                        let mut lease = shared.lock(Known::default());
                        lease.areas[0].config.uni[index].mode += 1;
                        shared.release(&mut lease, false);
                    }
                })
            })
            .collect();
        let waiting = {
            let shared = Arc::clone(&shared);
            // The transfer may have ended before.
            thread::spawn(move || drop(answer(&shared, &mut Known::default())))
        };
        let transfer = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || exchange(&shared, 3, WINDOW))
        };
        lockers.into_iter().for_each(|locker| locker.join().unwrap());
        waiting.join().unwrap();
        transfer.join().unwrap();
        // Configurations always count; they begin at 1.
        assert_eq!(shared.outgoing()[0].config.uni.map(|uni| uni.mode)[..3], [4, 4, 1]);
    });
}

#[test]
fn what_is_written_across_a_gap_moves_nothing() {
    check(ORDERS, || {
        let shared = shared();
        let program = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let known = Known::default();
                for _ in 0..2 {
                    let mut lease = shared.lock(known);
                    lease.areas[0].output.duty[0] = 512;
                    shared.release(&mut lease, false);
                }
            })
        };
        let error = Error::ConnectionClosed { command: "ExchangeDataCmpr", received: 0 };
        let mut last_request = [Outgoing::default()];
        shared.lose_connection(&error, &mut last_request);
        assert_eq!(last_request[0].output.duty[0], 0);
        // The outputs in the first request of the next connection.
        assert_eq!(shared.outgoing()[0].output.duty[0], 0);
        let known = &mut Known::default();
        assert!(matches!(shared.feed_watchdog(known), Err(Error::ConnectionLost { .. })));
        assert_eq!(shared.feed_watchdog(known), Ok(()), "reported twice");
        program.join().unwrap();
        assert_eq!(shared.outgoing()[0].output.duty[0], 0);
        shared.finish(None);
    });
}

#[test]
fn a_panic_under_a_guard_leaves_nothing_half_written() {
    check(ORDERS, || {
        let shared = shared();
        let panics = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let mut lease = shared.lock(Known::default());
                lease.areas[0].output.duty[0] = 1;
                // As a guard does that is dropped by a panic.
                shared.release(&mut lease, true);
            })
        };
        let other = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let mut lease = shared.lock(Known::default());
                lease.areas[0].output.duty[4] = 4;
                shared.release(&mut lease, false);
            })
        };
        let requests = exchange(&shared, 5, NO_END);
        panics.join().unwrap();
        other.join().unwrap();
        assert!(requests.iter().all(|request| request.output.duty[0] == 0));
    });
}
