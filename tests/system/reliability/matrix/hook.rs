//! Hooks that hang, and hooks that end the transfer.

use std::ops::ControlFlow;
use std::sync::{mpsc, Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferAreaComHandler};

use super::controller::{is_on, txt, Controller, DUTY};
use super::ends::{error_of, waiters};
use super::row::{By, Outcome, Row, Seen, MARGIN};

const SECTION: &str = "The cycle hook";
/// What the program sees of a hook that hangs.
const EXPIRED: Error = Error::WatchdogExpired { limit: Duration::from_millis(500) };

/// A call of the program while the hook hangs. Returns the handler, if it still exists.
type Call = fn(TransferAreaComHandler) -> Option<TransferAreaComHandler>;

/// Lets a hook end the transfer. Returns the handler, unless the hook has dropped it.
type End = fn(TransferAreaComHandler) -> Option<Arc<TransferAreaComHandler>>;

pub(crate) fn rows() -> Vec<Row> {
    let hangs = |place, call: Call| {
        Row::new(SECTION, "a hook that hangs", place)
            .sees("`WatchdogExpired` in each wait", "0.5 s")
            .by(&[By::Exchange])
            .test(move || Ok(hang(call, EXPIRED)))
    };
    let ends_beside = |place, call: Call| {
        Row::new(SECTION, "a hook that hangs", place)
            .sees("`NotStarted` in each wait", "two exchanges")
            .by(&[By::Exchange])
            .test(move || Ok(hang(call, Error::NotStarted)))
    };
    let ends = |fault, end: End| {
        Row::new(SECTION, fault, "in the hook")
            .sees("`NotStarted` in each wait", "two exchanges")
            .by(&[By::Exchange])
            .test(move || Ok(end_inside(end)))
    };
    vec![
        hangs("with eight waiting threads", Some),
        ends_beside("with eight waiting threads, and `end_transfer`", |handler| {
            let begin = Instant::now();
            assert_eq!(handler.end_transfer(), Ok(()));
            assert!(begin.elapsed() < MARGIN);
            Some(handler)
        }),
        ends_beside("with eight waiting threads, and drop of the handler", |handler| {
            drop(handler);
            None
        }),
        hangs("with eight waiting threads, and `clear_cycle_hook`", |handler| {
            handler.clear_cycle_hook();
            Some(handler)
        }),
        hangs("with eight waiting threads, and `set_cycle_hook`", |handler| {
            handler.set_cycle_hook(|_| ControlFlow::Continue(())).unwrap();
            Some(handler)
        }),
        ends("`ControlFlow::Break`", |handler| {
            handler.set_cycle_hook(|_| ControlFlow::Break(())).unwrap();
            Some(Arc::new(handler))
        }),
        ends("`end_transfer`", |handler| {
            let handler = Arc::new(handler);
            let weak = Arc::downgrade(&handler);
            handler
                .set_cycle_hook(move |_| {
                    if let Some(handler) = weak.upgrade() {
                        assert_eq!(handler.end_transfer(), Ok(()));
                    }
                    ControlFlow::Continue(())
                })
                .unwrap();
            Some(handler)
        }),
        ends("drop of the handler", |handler| {
            let own = Arc::new(Mutex::new(None));
            let in_hook = Arc::clone(&own);
            handler
                .set_cycle_hook(move |_| {
                    drop(in_hook.lock().unwrap().take());
                    ControlFlow::Continue(())
                })
                .unwrap();
            *own.lock().unwrap() = Some(handler);
            None
        }),
    ]
}

/// A program with a motor on.
fn start() -> (Controller, TransferAreaComHandler) {
    let controller = Controller::start(txt());
    let handler = controller.handler().build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    (controller, handler)
}

/// The hook hangs until long after the motors were stopped, and then writes.
fn hang(call: Call, expected: Error) -> Outcome {
    let (controller, handler) = start();
    let area = handler.areas().clone();
    let waiters = waiters(&area);
    let (let_go, gate) = mpsc::channel::<()>();
    let (hung, is_hung) = mpsc::channel();
    handler
        .set_cycle_hook(move |areas| {
            let Ok(areas) = areas else { return ControlFlow::Continue(()) };
            let _ = hung.send(Instant::now());
            let _ = gate.recv();
            areas[LOCAL_IO].output.duty[0] = DUTY;
            ControlFlow::Break(())
        })
        .unwrap();
    let struck = is_hung.recv().unwrap();
    let seeing = thread::spawn(move || (error_of(waiters), struck.elapsed()));
    let handler = call(handler);
    let (error, soon) = seeing.join().unwrap();
    assert_eq!(error, expected);
    controller.wait("motors off", |machine| !is_on(machine));
    if let Some(handler) = handler {
        assert_eq!(handler.end_transfer(), Ok(()));
    }
    let (by, stopped) = controller.stopped_after(struck);
    drop(let_go);
    // Waits until its thread has ended.
    while is_hung.recv().is_ok() {}
    assert_eq!(area.lock()[LOCAL_IO].output.duty, [0; 8]);
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

fn end_inside(end: End) -> Outcome {
    let (controller, handler) = start();
    let waiters = waiters(&handler.areas().clone());
    let struck = Instant::now();
    let handler = end(handler);
    let error = error_of(waiters);
    let soon = struck.elapsed();
    if let Some(handler) = handler {
        assert_eq!(handler.end_transfer(), Ok(()));
    }
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}
