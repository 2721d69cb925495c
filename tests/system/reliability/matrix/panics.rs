//! Panics of the program.

use std::ops::ControlFlow;
use std::panic::{self, catch_unwind, panic_any, AssertUnwindSafe};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, EventKind, TransferAreaComHandler};

use super::controller::{handler_at, is_on, txt, Controller, DUTY};
use super::logger;
use super::row::{panic_text, By, Outcome, Row, Seen, DEADLINE};
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "Panics";

/// The start of the message of a panic that belongs to a test.
pub(crate) const ON_PURPOSE: &str = "on purpose";

/// Does not print the panics that belong to tests.
pub(crate) fn be_quiet() {
    let print = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let text = panic_text(info.payload());
        // These are of a scope whose thread has panicked, and of a thread that locks twice.
        let is_ours = text.starts_with(ON_PURPOSE)
            || text == "a scoped thread panicked"
            || text.contains("drop the guard first");
        if !is_ours && !info.payload().is::<Mine>() {
            print(info);
        }
    }));
}

pub(crate) fn rows() -> Vec<Row> {
    const SEES: &str = "`ProgramPanicked`";
    let row = |place, panic: fn(&TransferAreaComHandler)| {
        Row::new(SECTION, "panic", place)
            .sees(SEES, "the current exchange")
            .by(&[By::Exchange])
            .test(move || Ok(run(panic)))
    };
    vec![
        row("under a guard", |handler| {
            let area = handler.areas().clone();
            in_thread(move || {
                let _guard = area.lock();
                panic!("{ON_PURPOSE}");
            });
        }),
        row("under a guard, caught by its own thread", |handler| {
            let _ = catch_unwind(AssertUnwindSafe(|| {
                let _guard = handler.areas().lock();
                panic!("{ON_PURPOSE}");
            }));
        }),
        row("in a wait's condition", |handler| {
            let area = handler.areas().clone();
            in_thread(move || drop(area.wait_until(|_| panic!("{ON_PURPOSE}"), DEADLINE)));
        }),
        row("in a hook", |handler| handler.set_cycle_hook(|_| panic!("{ON_PURPOSE}")).unwrap()),
        row("in a hook, with a payload that panics when it is dropped", |handler| {
            handler.set_cycle_hook(|_| panic_any(Mine)).unwrap();
        }),
        row("in a thread that owns a handle", |handler| {
            let area = handler.areas().clone();
            in_thread(move || {
                let _area = area;
                panic!("{ON_PURPOSE}");
            });
        }),
        row("in a listener's thread", |handler| {
            let events = handler.areas().events(EventKind::ALL, 10).unwrap();
            in_thread(move || {
                let _events = events;
                panic!("{ON_PURPOSE}");
            });
        }),
        Row::new(SECTION, "panic", "in the thread that owns the handler")
            .sees(SEES, "the current exchange")
            .by(&[By::Exchange])
            .test(|| {
                Ok(in_owner(|handler| {
                    let _handler = handler;
                    panic!("{ON_PURPOSE}");
                }))
            }),
        Row::new(SECTION, "panic", "in a scoped thread that shares the handler by reference")
            .sees(SEES, "the end of the scope")
            .by(&[By::Exchange])
            .test(|| {
                Ok(in_owner(|handler| {
                    thread::scope(|scope| {
                        scope.spawn(|| {
                            drop(handler.areas().lock());
                            panic!("{ON_PURPOSE}");
                        });
                    });
                }))
            }),
        Row::new(SECTION, "panic", "in a thread that shares a handle by `Arc`, between two guards")
            .sees("nothing: the panic is not noticed", "–")
            .test(|| Ok(between_guards())),
        Row::new(SECTION, "panic of a logger", "at a line of the transfer")
            .sees("`WatchdogExpired` once, as without it", "the watchdog's limit (0.3 s)")
            .by(&[By::Exchange])
            .test(|| Ok(in_logger())),
        Row::new(SECTION, "panic", "under a guard while `begin_transfer` is under way")
            .sees(SEES, "the end of the handshake")
            .by(&[By::NeverOn])
            .test(|| Ok(while_beginning())),
        twice("in a `match` on a value of the area", |handler| {
            match handler.areas().lock()[LOCAL_IO].input.uni[0] {
                0 => drop(handler.areas().lock()),
                _ => unreachable!("I1 is not pressed"),
            }
        }),
        twice("in one `println!`", |handler| {
            println!("{} {}", handler.areas().lock().len(), handler.areas().lock().len());
        }),
        twice("`wait_cycle` under a guard", |handler| {
            let _guard = handler.areas().lock();
            let _ = handler.areas().wait_cycle();
        }),
        twice("`update_config` under a guard", |handler| {
            let _guard = handler.areas().lock();
            let _ = handler.areas().update_config();
        }),
        twice("`lock` in a wait's condition", |handler| {
            let _ = handler.areas().wait_until(|_| handler.areas().lock().is_empty(), DEADLINE);
        }),
        row("in a hook, because it locks", |handler| {
            let area = handler.areas().clone();
            handler
                .set_cycle_hook(move |_| {
                    drop(area.lock());
                    ControlFlow::Continue(())
                })
                .unwrap();
        }),
        row("in a hook, because it waits for a cycle", |handler| {
            let area = handler.areas().clone();
            handler
                .set_cycle_hook(move |_| {
                    let _ = area.wait_cycle();
                    ControlFlow::Continue(())
                })
                .unwrap();
        }),
    ]
}

/// A thread that would wait for itself panics instead, with the reason.
fn twice(place: &'static str, lock_twice: fn(&TransferAreaComHandler)) -> Row {
    Row::new(SECTION, "a thread that locks twice", place)
        .sees("a panic that says so, and `ProgramPanicked`", "the current exchange")
        .by(&[By::Exchange])
        .test(move || {
            Ok(run(|handler| {
                let panic = catch_unwind(AssertUnwindSafe(|| lock_twice(handler))).unwrap_err();
                let text = panic_text(&*panic);
                assert!(text.contains("drop the guard first"), "{text}");
            }))
        })
}

/// A panic whose payload panics again when it is dropped, so the thread that catches the first
/// panic has a second one.
struct Mine;

impl Drop for Mine {
    fn drop(&mut self) {
        if !thread::panicking() {
            panic!("{ON_PURPOSE}, when it is dropped");
        }
    }
}

fn in_thread(run: impl FnOnce() + Send + 'static) {
    assert!(thread::spawn(run).join().is_err(), "it does not panic");
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

/// What the program sees next: an error within one second, or nothing.
fn watch(handler: &TransferAreaComHandler) -> Seen {
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(1) {
        if let Err(error) = handler.areas().wait_cycle() {
            return Seen::Error(error);
        }
    }
    Seen::Nothing
}

fn run(panic: impl FnOnce(&TransferAreaComHandler)) -> Outcome {
    let (controller, handler) = start();
    let struck = Instant::now();
    panic(&handler);
    let seen = watch(&handler);
    let soon = struck.elapsed();
    if let Seen::Error(error) = &seen {
        assert_eq!(handler.end_transfer(), Err(error.clone()), "the error stays");
        assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty, [0; 8]);
    }
    drop(handler);
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen, soon: Some(soon), by, stopped }
}

/// The watchdog expires, and the logger panics when it is notified.
fn in_logger() -> Outcome {
    let controller = Controller::start(txt());
    let handler = controller.handler().watchdog(logger::PANICS_AT).build().unwrap();
    let events = handler.areas().events(&[EventKind::WatchdogExpired], 10).unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    let struck = Instant::now();
    // Gives no sign of life.
    events.recv_timeout(DEADLINE).unwrap();
    let soon = struck.elapsed();
    logger::wait_for_panic();
    let error = handler.areas().wait_cycle().map(drop).unwrap_err();
    for _ in 0..5 {
        assert!(handler.areas().wait_cycle().is_ok(), "it gets the error once");
    }
    assert_eq!(handler.end_transfer(), Ok(()));
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

/// The thread that owns the handler panics.
fn in_owner(panic: fn(TransferAreaComHandler)) -> Outcome {
    let (controller, handler) = start();
    let area = handler.areas().clone();
    let struck = Instant::now();
    in_thread(move || panic(handler));
    let error = area.wait_cycle().unwrap_err();
    let soon = struck.elapsed();
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

fn between_guards() -> Outcome {
    let (controller, handler) = start();
    let shared = Arc::new(handler.areas().clone());
    let theirs = Arc::clone(&shared);
    in_thread(move || {
        drop(theirs.lock());
        panic!("{ON_PURPOSE}");
    });
    let seen = watch(&handler);
    let goes_on = controller.txt.with_machine(|machine| is_on(machine));
    let by = if goes_on { By::GoesOn } else { By::Exchange };
    let _ = handler.end_transfer();
    Outcome { seen, soon: None, by, stopped: None }
}

/// During a slow handshake another thread writes half of its outputs and panics.
fn while_beginning() -> Outcome {
    let controller = Controller::start(txt());
    let strike = Strike { place: Place::StartOnline, in_request: false, fault: Fault::SlowDrip };
    let proxy = Proxy::start(controller.port(), [strike]);
    let handler = handler_at(proxy.port()).build().unwrap();
    let area = handler.areas().clone();
    let struck = thread::scope(|scope| {
        let panicking = scope.spawn(|| {
            proxy.wait_struck();
            let struck = Instant::now();
            let panicked = catch_unwind(AssertUnwindSafe(|| {
                let mut guard = area.lock();
                guard[LOCAL_IO].output.duty[0] = DUTY;
                panic!("{ON_PURPOSE}");
            }));
            panicked.unwrap_err();
            struck
        });
        let _ = handler.begin_transfer();
        panicking.join().unwrap()
    });
    drop(handler.areas().lock());
    let seen = watch(&handler);
    let soon = struck.elapsed();
    let end = handler.end_transfer();
    if let Seen::Error(error) = &seen {
        assert_eq!(end, Err::<(), Error>(error.clone()), "the error stays");
    }
    drop(handler);
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen, soon: Some(soon), by, stopped }
}
