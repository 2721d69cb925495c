//! Programs that hang, with a watchdog.

use std::ops::ControlFlow;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, Event, EventKind, TransferAreaComHandler};

use super::controller::{is_on, txt, Controller, DUTY};
use super::panics::ON_PURPOSE;
use super::row::{By, Outcome, Row, Seen, DEADLINE, MARGIN};

const SECTION: &str = "Programs that hang, with a watchdog";

const LIMIT: Duration = Duration::from_millis(500);

const EXPIRED: Error = Error::WatchdogExpired { limit: LIMIT };

/// What a thread of the program does. Its receiver is disconnected when the test is over.
type Hang = fn(Arc<TransferAreaComHandler>, Receiver<()>);

pub(crate) fn rows() -> Vec<Row> {
    let row = |fault, place, hang: Hang| {
        Row::new(SECTION, fault, place)
            .sees("`WatchdogExpired` once", "the watchdog's limit (0.5 s)")
            .by(&[By::Exchange])
            .test(move || Ok(run(hang)))
    };
    vec![
        row("a thread in `loop {}`", "without a guard", |handler, over| {
            drop(handler.areas().lock());
            while over.try_recv() == Err(TryRecvError::Empty) {}
        }),
        row("a guard that is held forever", "with a duty in it", |handler, over| {
            let mut guard = handler.areas().lock();
            guard[LOCAL_IO].output.duty[0] = DUTY;
            let _ = over.recv();
        }),
        row("a hook that hangs", "with a longer limit for the hook", |handler, over| {
            let mut is_first = true;
            handler
                .set_cycle_hook(move |areas| {
                    let Ok(areas) = areas else { return ControlFlow::Continue(()) };
                    if std::mem::take(&mut is_first) {
                        let _ = over.recv();
                        areas[LOCAL_IO].output.duty[0] = DUTY;
                    }
                    ControlFlow::Continue(())
                })
                .unwrap();
        }),
        row("a deadlock of two threads", "one of them under a guard", deadlock),
        row("a thread that is gone", "it has returned", |handler, _| drop(handler.areas().lock())),
        row("a thread that is gone", "panic, with the handler in an `Arc`", |handler, _| {
            drop(handler.areas().lock());
            panic!("{ON_PURPOSE}");
        }),
        row("a thread that is gone", "panic, with a handle in an `Arc`", |handler, over| {
            let shared = Arc::new(handler.areas().clone());
            let theirs = Arc::clone(&shared);
            let panicking = thread::spawn(move || {
                drop(theirs.lock());
                panic!("{ON_PURPOSE}");
            });
            let _ = panicking.join();
            let _ = over.recv();
            drop(shared);
        }),
        row("a thread that is gone", "panic, with the handler by reference", |handler, over| {
            thread::scope(|scope| {
                scope.spawn(|| {
                    drop(handler.areas().lock());
                    panic!("{ON_PURPOSE}");
                });
                // The scope goes on.
                let _ = over.recv();
            });
        }),
    ]
}

/// One waits under a guard for a message of the other, which waits for the guard.
fn deadlock(handler: Arc<TransferAreaComHandler>, over: Receiver<()>) {
    let (sender, word) = mpsc::channel();
    let is_over = sender.clone();
    thread::scope(|scope| {
        let handler = &handler;
        let (locked, is_locked) = mpsc::channel();
        scope.spawn(move || {
            let _guard = handler.areas().lock();
            locked.send(()).unwrap();
            let _ = word.recv();
        });
        is_locked.recv().unwrap();
        scope.spawn(move || {
            drop(handler.areas().lock());
            let _ = sender.send(());
        });
        let _ = over.recv();
        let _ = is_over.send(());
    });
}

fn run(hang: Hang) -> Outcome {
    let controller = Controller::start(txt());
    let builder = controller.handler().watchdog(LIMIT);
    let handler = Arc::new(builder.build().unwrap());
    let events = handler.areas().events(&[EventKind::WatchdogExpired], 10).unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    let (sender, over) = mpsc::channel();
    let struck = Instant::now();
    let theirs = Arc::clone(&handler);
    let thread = thread::spawn(move || hang(theirs, over));
    let event = events.recv_timeout(DEADLINE);
    let soon = struck.elapsed();
    assert!(matches!(event.unwrap().event, Event::WatchdogExpired { limit: LIMIT, .. }));
    controller.wait("motors off", |machine| !is_on(machine));
    drop(sender);
    // It may have panicked.
    let _ = thread.join();
    // The program runs again, gets the error once, and has to turn its motors on again.
    let area = handler.areas().clone();
    assert_eq!(area.wait_cycle().map(drop), Err(EXPIRED));
    for _ in 0..10 {
        assert!(area.wait_cycle().is_ok(), "it gets the error once");
    }
    handler.clear_cycle_hook();
    assert_eq!(handler.end_transfer(), Ok(()));
    let (by, stopped) = controller.stopped_after(struck);
    assert!(stopped.is_some_and(|stopped| stopped < LIMIT + MARGIN), "{stopped:?}");
    Outcome { seen: Seen::Named("WatchdogExpired".to_owned()), soon: Some(soon), by, stopped }
}
