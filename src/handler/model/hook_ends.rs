//! The ends of the cycle hook: it is replaced and cleared, ends the transfer, or hangs.

use std::ops::ControlFlow;
use std::sync::Arc;

use shuttle::sync::atomic::{AtomicUsize, Ordering};
use shuttle::sync::{Condvar, Mutex};
use shuttle::thread;

use super::{check, duties, handler, program, wait_to_the_end, NO_END};
use crate::error::Error;
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::parts::watchdog::HOOK_LIMIT;

const ORDERS: usize = 700;

/// A hook that counts its calls, and fails when another one runs or when it is over.
fn set_lonely_hook(
    handler: &TransferAreaComHandler,
    running: &Arc<AtomicUsize>,
    mut then: impl FnMut() + Send + 'static,
) -> Arc<AtomicUsize> {
    let calls = Arc::new(AtomicUsize::new(0));
    let (counted, running) = (Arc::clone(&calls), Arc::clone(running));
    let hook = handler.set_cycle_hook(move |_| {
        assert_eq!(running.fetch_add(1, Ordering::SeqCst), 0, "two at a time");
        counted.fetch_add(1, Ordering::SeqCst);
        then();
        running.fetch_sub(1, Ordering::SeqCst);
        ControlFlow::Continue(())
    });
    hook.unwrap();
    calls
}

fn replaced_and_cleared(lock_step: bool) {
    let (handler, _controller) = handler(|settings| settings.lock_step = lock_step);
    let running = Arc::default();
    handler.begin_transfer().unwrap();
    let waits = program(&handler, |area| wait_to_the_end(&area, |_| ()));
    let first = set_lonely_hook(&handler, &running, || ());
    drop(handler.areas().wait_cycle().unwrap());
    let second = set_lonely_hook(&handler, &running, || ());
    let of_first = first.load(Ordering::SeqCst);
    drop(handler.areas().wait_cycle().unwrap());
    handler.clear_cycle_hook();
    let of_second = second.load(Ordering::SeqCst);
    drop(handler.areas().wait_cycle().unwrap());
    assert_eq!(handler.end_transfer(), Ok(()));
    waits.join().unwrap();
    assert_eq!(first.load(Ordering::SeqCst), of_first, "called after it was replaced");
    assert_eq!(second.load(Ordering::SeqCst), of_second, "called after it was cleared");
    assert!(!handler
        .areas()
        .shared()
        .state()
        .tickets
        .has_hook_before(u64::MAX, thread::current().id()));
}

#[test]
fn a_hook_that_was_replaced_or_cleared_is_not_called_any_more() {
    check(ORDERS, || replaced_and_cleared(false));
}

#[test]
fn in_lock_step_a_hook_that_was_replaced_or_cleared_is_not_called_any_more() {
    check(ORDERS, || replaced_and_cleared(true));
}

#[test]
fn a_hook_replaces_itself_while_another_thread_clears_it() {
    check(ORDERS, || {
        // Without a gap nothing but the areas keeps two hooks apart.
        let (handler, controller) = handler(|settings| settings.reconnect = Some(NO_END));
        controller.lose(&[2]);
        let running = Arc::default();
        let (weak, other) = (Arc::downgrade(&handler), Arc::clone(&running));
        let mut is_first = true;
        let first = set_lonely_hook(&handler, &running, move || {
            let Some(handler) = weak.upgrade().filter(|_| std::mem::take(&mut is_first)) else {
                return;
            };
            set_lonely_hook(&handler, &other, || ());
            // The other one could begin now.
            (0..5).for_each(|_| thread::yield_now());
        });
        handler.begin_transfer().unwrap();
        let waits = program(&handler, |area| wait_to_the_end(&area, |_| ()));
        drop(handler.areas().wait_cycle());
        handler.clear_cycle_hook();
        drop(handler.areas().wait_cycle());
        assert_ne!(handler.end_transfer(), Err(Error::ProgramPanicked), "a hook failed");
        waits.join().unwrap();
        assert!(first.load(Ordering::SeqCst) <= 1, "called after it has replaced itself");
    });
}

/// The hook ends the transfer with its second call, in one of two ways.
fn ends_the_transfer(by_call: bool, lock_step: bool) {
    let (handler, controller) = handler(|settings| {
        settings.reaction_window = NO_END;
        settings.lock_step = lock_step;
    });
    let calls = Arc::new(Mutex::new(Vec::new()));
    let (noted, weak) = (Arc::clone(&calls), Arc::downgrade(&handler));
    let hook = handler.set_cycle_hook(move |areas| {
        let areas = areas.unwrap();
        noted.lock().unwrap().push(areas.cycle());
        areas[0].output.duty[0] = 512;
        match weak.upgrade().filter(|_| areas.cycle() == 2) {
            Some(handler) if by_call => assert_eq!(handler.end_transfer(), Ok(())),
            Some(_) => return ControlFlow::Break(()),
            None => {}
        }
        ControlFlow::Continue(())
    });
    hook.unwrap();
    for transfer in 1..=2 {
        handler.begin_transfer().unwrap();
        let waits = program(&handler, |area| wait_to_the_end(&area, |_| ()));
        wait_to_the_end(handler.areas(), |_| ());
        waits.join().unwrap();
        assert_eq!(handler.end_transfer(), Ok(()));
        assert_eq!(calls.lock().unwrap().len(), 2 * transfer);
        // The answer to the second response is replaced by the stop.
        let duties = duties(&controller.requests());
        assert_eq!(duties[3 * (transfer - 1)..], [0, 512, 0]);
    }
    assert_eq!(calls.lock().unwrap()[..], [1, 2, 1, 2]);
}

#[test]
fn a_hook_ends_the_transfer_by_what_it_returns() {
    check(ORDERS, || ends_the_transfer(false, false));
}

#[test]
fn a_hook_ends_the_transfer_by_a_call() {
    check(ORDERS, || ends_the_transfer(true, false));
}

#[test]
fn in_lock_step_a_hook_ends_the_transfer() {
    check(ORDERS, || ends_the_transfer(false, true));
}

/// The hook's first call returns only when the program has seen that the motors were stopped.
#[test]
fn a_hook_that_hangs_stops_the_motors_and_goes_on_when_it_returns() {
    check(ORDERS, || {
        let (handler, controller) = handler(|_| ());
        let released = Arc::new((Mutex::new(false), Condvar::new()));
        let calls = Arc::new(Mutex::new(Vec::new()));
        let (noted, waits_for) = (Arc::clone(&calls), Arc::clone(&released));
        let hook = handler.set_cycle_hook(move |areas| {
            let first = noted.lock().unwrap().is_empty();
            noted.lock().unwrap().push(areas.as_ref().map(|_| ()).map_err(|error| error.clone()));
            let (released, changed) = &*waits_for;
            let mut released = released.lock().unwrap();
            while first && !*released {
                released = changed.wait(released).unwrap();
            }
            if let Ok(areas) = areas {
                areas[0].output.duty[0] = if first { 512 } else { 100 };
            }
            ControlFlow::Continue(())
        });
        hook.unwrap();
        handler.areas().lock()[0].output.duty[1] = 300;
        handler.begin_transfer().unwrap();
        let waits = program(&handler, |area| loop {
            match area.wait_cycle() {
                Ok(_) => thread::yield_now(),
                Err(error) => return error,
            }
        });
        let expired = Error::WatchdogExpired { limit: HOOK_LIMIT };
        assert_eq!(waits.join().unwrap(), expired, "the wait of another thread");
        controller.wait_for(|request| request.outputs.duty[1] == 0);
        *released.0.lock().unwrap() = true;
        released.1.notify_all();
        controller.wait_for(|request| request.outputs.duty[0] == 100);
        assert_eq!(handler.end_transfer(), Ok(()));
        assert_eq!(calls.lock().unwrap()[..2], [Ok(()), Err(expired)]);
        assert!(!duties(&controller.requests()).contains(&512), "a late answer moves M1");
    });
}
