//! The meeting point of the threads, run in many orders by `shuttle`.
//!
//! `RUSTFLAGS="--cfg shuttle" cargo test --lib model`

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use shuttle::sync::Mutex;
use shuttle::{check_pct, check_random, thread};

use super::shared::Shared;
use super::taken::Known;
use super::watchdog::Watchdog;
use crate::error::Error;
use crate::exchange::Inputs;
use crate::transfer_area::FishX1Transfer;
use crate::wire::ExchangeDataResponse;

const ORDERS: usize = 3000;

/// How many points at which another thread comes first are looked for in each order.
const DEPTH: usize = 4;

/// In each cycle a window ends by itself or is waited for to the end, as the lot falls.
const WINDOW: Duration = Duration::from_secs(1);
/// A window that only the program's threads end.
const NO_END: Duration = Duration::MAX;

fn check(model: impl Fn() + Send + Sync + Copy + 'static) {
    check_random(model, ORDERS);
    check_pct(model, ORDERS, DEPTH);
}

fn shared() -> Arc<Shared> {
    let shared = Arc::new(Shared::new(1, Watchdog::new(None)));
    shared.begin().unwrap();
    shared.run(0).unwrap();
    shared
}

/// The transfer thread's part: response after response, the number in the first input, until it is
/// stopped or there were enough. Gives the outputs of each request.
fn exchange(shared: &Shared, responses: i16, window: Duration) -> Vec<FishX1Transfer> {
    let mut areas = [FishX1Transfer::default()];
    let mut requests = Vec::new();
    let (mut before, mut now) = (Inputs::default(), Inputs::default());
    for number in 1..=responses {
        let mut inputs = Inputs::default();
        inputs.take_simple(ExchangeDataResponse { uni: [number; 8], ..Default::default() });
        shared.deliver(&inputs, 0, &mut before, &mut now);
        let stop = shared.hold_window(window, &mut areas);
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

/// A program's part: waits for a response and answers it in two places.
fn answer(shared: &Shared, known: &mut Known) -> Result<i16, Error> {
    let mut taken = shared.wait_cycle(known, None)?.expect("there is no limit");
    known.returned = taken.response;
    let asked = taken.areas[0].input.uni[0];
    taken.areas[0].output.duty[0] = asked;
    taken.areas[0].output.duty[1] = asked;
    shared.release(&mut taken, false);
    Ok(asked)
}

#[test]
fn no_request_is_torn_and_every_thread_learns_of_the_end() {
    check(|| {
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
fn a_response_is_answered_in_the_next_request_by_all_who_waited_for_it() {
    check(|| {
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
        // Each window is ended by those who answer, so none of them can be late.
        let requests = exchange(&shared, 4, NO_END);
        programs.into_iter().for_each(|program| program.join().unwrap());
        for (number, request) in (1..=4).zip(&requests) {
            assert!(answers.lock().unwrap().contains(&number), "{number} was not answered");
            assert_eq!(request.output.duty[0], number, "answered late");
        }
        assert_eq!(shared.statistics().late_reactions, 0);
    });
}

#[test]
fn threads_that_lock_keep_nobody_out_and_none_of_their_writes_is_lost() {
    check(|| {
        let shared = shared();
        let lockers: Vec<_> = (0..2)
            .map(|index| {
                let shared = Arc::clone(&shared);
                thread::spawn(move || {
                    for _ in 0..3 {
                        let mut taken = shared.lock(Known::default());
                        taken.areas[0].config.uni[index].mode += 1;
                        shared.release(&mut taken, false);
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
        // Configurations count always; they begin at 1.
        assert_eq!(shared.outgoing()[0].config.uni.map(|uni| uni.mode)[..3], [4, 4, 1]);
    });
}

#[test]
fn what_is_written_across_a_gap_moves_nothing() {
    check(|| {
        let shared = shared();
        let program = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let known = Known::default();
                for _ in 0..2 {
                    let mut taken = shared.lock(known);
                    taken.areas[0].output.duty[0] = 512;
                    shared.release(&mut taken, false);
                }
            })
        };
        let error = Error::ConnectionClosed { command: "ExchangeDataCmpr", received: 0 };
        let mut last_words = [FishX1Transfer::default()];
        shared.lose_connection(&error, &mut last_words);
        assert_eq!(last_words[0].output.duty[0], 0);
        // What the first request of the next connection has.
        assert_eq!(shared.outgoing()[0].output.duty[0], 0);
        let known = &mut Known::default();
        assert!(matches!(shared.feed_watchdog(known), Err(Error::ConnectionLost { .. })));
        assert_eq!(shared.feed_watchdog(known), Ok(()), "told twice");
        program.join().unwrap();
        assert_eq!(shared.outgoing()[0].output.duty[0], 0);
        shared.finish(None);
    });
}

#[test]
fn a_panic_under_a_guard_leaves_nothing_half_written() {
    check(|| {
        let shared = shared();
        let panics = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let mut taken = shared.lock(Known::default());
                taken.areas[0].output.duty[0] = 1;
                // As the guard does that is dropped by a panic.
                shared.release(&mut taken, true);
            })
        };
        let other = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || {
                let mut taken = shared.lock(Known::default());
                taken.areas[0].output.duty[4] = 4;
                shared.release(&mut taken, false);
            })
        };
        let requests = exchange(&shared, 5, NO_END);
        panics.join().unwrap();
        other.join().unwrap();
        assert!(requests.iter().all(|request| request.output.duty[0] == 0));
    });
}
