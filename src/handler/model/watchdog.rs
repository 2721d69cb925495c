//! The watchdog: what it stops, and who learns of it.

use std::sync::Arc;
use std::time::Duration;

use shuttle::sync::atomic::{AtomicBool, Ordering};
use shuttle::thread;

use super::{check, duties, handler, program, wait_to_the_end};
use crate::error::Error;
use crate::handler::program::area::TransferAreas;
use crate::handler::program::known::Known;
use crate::handler::sync::{now, pass};

const ORDERS: usize = 700;

const LIMIT: Duration = Duration::from_millis(100);

/// How many there were.
fn interruptions(area: &TransferAreas) -> u64 {
    let mut known = Known::default();
    area.shared().state().learn_all(&mut known);
    known.interruptions
}

/// Asks until there is no error any more; returns how many were the watchdog's.
fn count_reports(area: &TransferAreas) -> usize {
    let mut count = 0;
    loop {
        match area.feed_watchdog() {
            Ok(()) | Err(Error::NotStarted) => return count,
            Err(Error::WatchdogExpired { .. }) => count += 1,
            Err(error) => panic!("{error:#}"),
        }
    }
}

#[test]
fn it_stops_the_motors_while_a_guard_is_held_and_threads_wait_and_what_the_guard_wrote_is_lost() {
    check(ORDERS, || {
        let (handler, controller) = handler(|settings| settings.watchdog = Some(LIMIT));
        handler.begin_transfer().unwrap();
        let waits = [0, 1].map(|_| program(&handler, |area| wait_to_the_end(&area, |_| ())));
        let area = handler.areas().clone();
        while !duties(&controller.requests()).contains(&512) {
            let _ = area.feed_watchdog();
            area.lock()[0].output.duty[0] = 512;
            thread::yield_now();
        }
        let mut areas = area.lock();
        areas[0].output.duty[0] = 300;
        let expired = || interruptions(handler.areas());
        let before = expired();
        pass(LIMIT);
        let over = now();
        while expired() == before || duties(&controller.requests()).last() != Some(&0) {
            thread::yield_now();
        }
        drop(areas);
        let requests = controller.requests();
        let mut stops = requests.iter().filter(|request| request.outputs.duty == [0; 8]);
        let stop = stops.find(|stop| stop.at >= over).unwrap().at - over;
        assert!(stop < LIMIT / 2, "the motors stop {stop:?} too late");
        handler.end_transfer().unwrap();
        waits.into_iter().for_each(|waits| drop(waits.join().unwrap()));
        assert!(!duties(&controller.requests()).contains(&300), "the guard's write counts");
    });
}

#[test]
fn each_handle_is_told_each_time_once_and_only_then_its_outputs_count() {
    check(ORDERS, || {
        let (handler, controller) = handler(|settings| settings.watchdog = Some(LIMIT));
        handler.begin_transfer().unwrap();
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        // It works, and goes on after each error.
        let works = program(&handler, move |area| {
            let mut count = 0;
            while !is_over.load(Ordering::SeqCst) {
                count += count_reports(&area);
                area.lock()[0].output.duty[0] = 512;
                thread::yield_now();
            }
            (area, count)
        });
        let (aware, unaware) = (handler.areas().clone(), handler.areas().clone());
        let expired = || interruptions(handler.areas()) as usize;
        pass(LIMIT);
        let before = expired();
        let count = count_reports(&aware);
        assert!((before..=expired()).contains(&count), "{count} times of {before}");
        drop(unaware.lock());
        over.store(true, Ordering::SeqCst);
        let (works, mut count) = works.join().unwrap();
        let before = expired();
        count += count_reports(&works);
        assert!((before..=expired()).contains(&count), "{count} times of {before}");
        // It has learned of nothing until now.
        let before = expired();
        let count = count_reports(&unaware);
        assert!((before..=expired()).contains(&count), "{count} times of {before}");
        handler.end_transfer().unwrap();
        assert_eq!(duties(&controller.requests()).last(), Some(&0));
    });
}

#[test]
fn what_a_handle_writes_that_does_not_know_of_it_moves_nothing_until_the_watchdog_starts_again() {
    check(ORDERS, || {
        let (handler, controller) = handler(|settings| settings.watchdog = Some(LIMIT));
        handler.begin_transfer().unwrap();
        let others = handler.areas().clone();
        let has_expired = || handler.areas().shared().state().watchdog.has_expired();
        pass(LIMIT);
        while !has_expired() {
            thread::yield_now();
        }
        let writes = program(&handler, |area| {
            for _ in 0..3 {
                area.lock()[0].output.duty[0] = 512;
            }
        });
        writes.join().unwrap();
        assert!(!duties(&controller.requests()).contains(&512), "it was not reported");
        let expired = handler.areas().feed_watchdog();
        assert_eq!(expired, Err(Error::WatchdogExpired { limit: LIMIT }));
        // Now the exchange goes on, and the others write again, until it expires again.
        while !duties(&controller.requests()).contains(&512) {
            others.lock()[0].output.duty[0] = 512;
            let _ = handler.areas().feed_watchdog();
            thread::yield_now();
        }
        handler.end_transfer().unwrap();
    });
}
