//! Transfers that begin and end in several threads.

use std::sync::Arc;

use shuttle::sync::Mutex;
use shuttle::thread;

use super::{check, handler, program, wait_to_the_end};
use crate::error::Error;

const ORDERS: usize = 1000;

#[test]
fn after_an_end_no_request_of_its_transfer_follows() {
    check(ORDERS, || {
        let (handler, controller) = handler(|_| ());
        // The numbers of transfers that had ended after so many requests.
        let ends = Arc::new(Mutex::new(Vec::new()));
        let programs = [0, 1].map(|_| {
            let (handler, controller) = (Arc::clone(&handler), Arc::clone(&controller));
            let ends = Arc::clone(&ends);
            thread::spawn(move || {
                for _ in 0..2 {
                    match handler.begin_transfer() {
                        Ok(()) => handler.areas().lock()[0].output.duty[0] = 512,
                        // The other thread has begun it, or has ended it meanwhile.
                        Err(Error::AlreadyStarted | Error::NotStarted) => {}
                        Err(error) => panic!("{error:#}"),
                    }
                    let number = handler.areas().shared().state().transfer.number();
                    assert_eq!(handler.end_transfer(), Ok(()));
                    let state = handler.areas().shared().state();
                    let transfer = &state.transfer;
                    let is_over = !transfer.is_beginning() && !transfer.is_running();
                    assert!(is_over || transfer.number() > number, "it is still there");
                    drop(state);
                    ends.lock().unwrap().push((number, controller.requests().len()));
                }
            })
        });
        programs.into_iter().for_each(|program| program.join().unwrap());
        let requests = controller.requests();
        for (number, sent) in ends.lock().unwrap().iter() {
            let mut later = requests[*sent..].iter();
            assert!(later.all(|request| request.connection as u64 > *number), "it goes on");
        }
        for (last, next) in requests.iter().zip(requests.iter().skip(1).map(Some).chain([None])) {
            let is_last = next.is_none_or(|next| next.connection != last.connection);
            assert!(!is_last || last.outputs.duty == [0; 8], "the motors were not stopped");
        }
    });
}

#[test]
fn an_end_meets_threads_that_wait_and_lock_and_all_go_on() {
    check(ORDERS, || {
        let (handler, controller) = handler(|_| ());
        let waits = program(&handler, |area| {
            wait_to_the_end(&area, |areas| areas[0].output.duty[0] = 512);
        });
        let locks = program(&handler, |area| {
            for duty in 1..=3 {
                area.lock()[0].output.duty[1] = duty;
            }
        });
        let ends = {
            let handler = Arc::clone(&handler);
            thread::spawn(move || assert_eq!(handler.end_transfer(), Ok(())))
        };
        let begun = handler.begin_transfer();
        assert!(matches!(begun, Ok(()) | Err(Error::NotStarted)), "{begun:?}");
        assert_eq!(handler.end_transfer(), Ok(()));
        let sent = controller.requests().len();
        [waits, locks, ends].into_iter().for_each(|thread| thread.join().unwrap());
        assert_eq!(controller.requests().len(), sent);
        assert!(!handler.areas().is_running());
    });
}
