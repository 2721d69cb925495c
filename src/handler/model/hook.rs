//! The cycle hook beside threads that wait: when it is called, and what for.

use std::ops::ControlFlow;
use std::sync::Arc;

use shuttle::sync::Mutex;

use super::{check, duties, handler, program, wait_to_the_end, NO_END};
use crate::error::Error;
use crate::handler::com_handler::TransferAreaComHandler;

const ORDERS: usize = 700;

/// The responses for which a hook was called, and the errors that it was called with.
pub(super) type Calls = Arc<Mutex<(Vec<u64>, Vec<Error>)>>;

/// Sets a hook that answers each response with its number.
pub(super) fn set_answering_hook(handler: &TransferAreaComHandler) -> Calls {
    let calls = Calls::default();
    let noted = Arc::clone(&calls);
    let hook = handler.set_cycle_hook(move |areas| {
        let (responses, reported) = &mut *noted.lock().unwrap();
        match areas {
            Ok(areas) => {
                responses.push(areas.cycle());
                areas[0].output.duty[0] = areas.cycle() as i16;
            }
            Err(error) => reported.push(error),
        }
        ControlFlow::Continue(())
    });
    hook.unwrap();
    calls
}

/// Two threads wait, and the windows end only when all have answered.
fn answers_first(lock_step: bool) {
    let (handler, controller) = handler(|settings| {
        settings.reaction_window = NO_END;
        settings.lock_step = lock_step;
    });
    let calls = set_answering_hook(&handler);
    handler.begin_transfer().unwrap();
    let waits = {
        let calls = Arc::clone(&calls);
        program(&handler, move |area| {
            let mut unanswered = Vec::new();
            wait_to_the_end(&area, |areas| {
                let number = areas.cycle();
                let was_called = calls.lock().unwrap().0.contains(&number);
                if !was_called || areas[0].output.duty[0] != number as i16 {
                    unanswered.push(number);
                }
            });
            unanswered
        })
    };
    for _ in 0..3 {
        let areas = handler.areas().wait_cycle().unwrap();
        assert_eq!(areas[0].output.duty[0], areas.cycle() as i16, "the hook came later");
    }
    handler.end_transfer().unwrap();
    // The end sets its answer to 0, and it is not called for the last response.
    let late = waits.join().unwrap();
    let calls = &calls.lock().unwrap().0;
    assert!(late.iter().all(|late| *late + 2 > calls.len() as u64), "{late:?} of {calls:?}");
    assert!(calls.iter().copied().eq(1..=calls.len() as u64), "{calls:?}");
    let duties = duties(&controller.requests());
    let answers = &duties[1..duties.len() - 1];
    assert!(answers.iter().copied().eq(1..=answers.len() as i16), "{duties:?}");
    assert_eq!(duties.last(), Some(&0));
}

#[test]
fn the_hook_answers_each_response_once_and_before_threads_that_wait() {
    check(ORDERS, || answers_first(false));
}

#[test]
fn in_lock_step_the_hook_answers_each_response_once_and_before_threads_that_wait() {
    check(ORDERS, || answers_first(true));
}

#[test]
fn the_hook_is_called_once_for_a_response_and_not_for_the_last_one() {
    check(ORDERS, || {
        let (handler, _controller) = handler(|_| ());
        let calls = set_answering_hook(&handler);
        handler.begin_transfer().unwrap();
        let locks = program(&handler, |area| {
            for duty in 1..=3 {
                area.lock()[0].output.duty[1] = duty;
            }
        });
        for _ in 0..2 {
            drop(handler.areas().wait_cycle().unwrap());
        }
        locks.join().unwrap();
        handler.end_transfer().unwrap();
        // No call begins now, but one may still be running.
        for _ in 0..3 {
            drop(handler.areas().lock());
        }
        handler.clear_cycle_hook();
        let calls = &calls.lock().unwrap().0;
        assert!(
            calls.iter().all(|call| *call < handler.areas().statistics().cycles),
            "for the last one"
        );
        assert!(calls.windows(2).all(|pair| pair[0] < pair[1]), "twice for one: {calls:?}");
    });
}

fn is_told_of_a_gap(lock_step: bool) {
    let (handler, controller) = handler(|settings| {
        settings.reconnect = Some(NO_END);
        settings.lock_step = lock_step;
    });
    controller.lose(&[2]);
    let calls = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&calls);
    let hook = handler.set_cycle_hook(move |areas| {
        // The number of the request, 0 for a gap.
        noted.lock().unwrap().push(areas.as_ref().map_or(0, |areas| areas[0].input.uni[0]));
        if let Ok(areas) = areas {
            areas[0].output.duty[0] = 512;
        }
        ControlFlow::Continue(())
    });
    hook.unwrap();
    handler.begin_transfer().unwrap();
    let waits = program(&handler, |area| wait_to_the_end(&area, |_| ()));
    let mut answered = 0;
    while answered < 3 {
        answered += usize::from(handler.areas().wait_cycle().is_ok());
    }
    handler.end_transfer().unwrap();
    waits.join().unwrap();
    handler.clear_cycle_hook();
    let calls = calls.lock().unwrap();
    assert!(calls.iter().filter(|number| **number == 0).count() <= 1, "{calls:?}");
    let reported = calls.iter().position(|number| *number == 0);
    let restored = calls.iter().position(|number| *number > 2);
    assert!(
        restored.is_none_or(|call| reported.is_some_and(|reported| reported < call)),
        "{calls:?}"
    );
    let requests = controller.requests();
    assert_eq!(requests[2].outputs.duty[0], 0, "its answer went on across the gap");
}

#[test]
fn the_hook_is_told_of_a_gap_once_and_before_the_next_response() {
    check(ORDERS, || is_told_of_a_gap(false));
}

#[test]
fn in_lock_step_the_hook_is_told_of_a_gap_once_and_before_the_next_response() {
    check(ORDERS, || is_told_of_a_gap(true));
}
