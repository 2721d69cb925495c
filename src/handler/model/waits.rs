//! Waits that time out beside other threads.

use super::{check, handler, program};
use crate::error::Error;
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::parts::clock::STEP;

const ORDERS: usize = 1000;

/// A wait whose limit ends before the next response; the thread does nothing after it.
fn wait_in_vain(handler: &TransferAreaComHandler) {
    let limit = STEP / 2;
    let result = handler.areas().wait_cycle_for(limit).map(drop);
    // Another thread may have moved the time before it began.
    assert!(matches!(result, Ok(()) | Err(Error::WaitTimedOut { .. })), "{result:?}");
}

#[test]
fn in_lock_step_the_next_request_leaves_at_once_when_the_last_wait_for_it_times_out() {
    check(ORDERS, || {
        let (handler, _controller) = handler(|settings| settings.lock_step = true);
        handler.begin_transfer().unwrap();
        let waits = program(&handler, |area| (0..3).for_each(|_| drop(area.wait_cycle().unwrap())));
        wait_in_vain(&handler);
        waits.join().unwrap();
        handler.end_transfer().unwrap();
    });
}

#[test]
fn in_lock_step_a_wait_that_times_out_leaves_the_areas_to_a_thread_that_locks() {
    check(ORDERS, || {
        let (handler, _controller) = handler(|settings| settings.lock_step = true);
        handler.begin_transfer().unwrap();
        let locks = program(&handler, |area| (0..3).for_each(|_| drop(area.lock())));
        wait_in_vain(&handler);
        locks.join().unwrap();
        handler.end_transfer().unwrap();
    });
}
