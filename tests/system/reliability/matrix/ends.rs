//! The program ends the transfer at the worst moment.

use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TimeLimits, TransferAreaComHandler, TransferAreas};

use super::controller::{handler_at, txt, Controller, DUTY, IDLE_LIMIT};
use super::row::{By, Outcome, Row, Seen, DEADLINE};
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "The program's own end";

type End = fn(TransferAreaComHandler);

const ENDS: [(&str, End); 2] =
    [("`end_transfer`", |handler| drop(handler.end_transfer())), ("drop of the handler", drop)];

/// Writes a duty before or after the call of the given function, which ends a transfer.
type Write = fn(&TransferAreas, &dyn Fn());

const WRITES: [(&str, Write); 2] = [
    ("by a handle that does not know of the end", |area, end| {
        end();
        area.lock()[LOCAL_IO].output.duty[0] = DUTY;
    }),
    ("under a guard that was locked before the end", |area, end| {
        let mut guard = area.lock();
        guard[LOCAL_IO].output.duty[0] = DUTY;
        end();
    }),
];

pub(crate) fn rows() -> Vec<Row> {
    const EXCHANGES: &str = "two exchanges";
    let mut rows = Vec::new();
    for (text, end) in ENDS {
        let row = |place| Row::new(SECTION, text, place);
        rows.push(
            row("with eight waiting threads")
                .sees("`NotStarted` in each wait", EXCHANGES)
                .by(&[By::Exchange])
                .test(move || Ok(with_waiters(end))),
        );
        rows.push(
            row("while another thread holds a guard")
                .sees("`NotStarted` in each wait", "when the guard is dropped")
                .by(&[By::Exchange])
                .test(move || Ok(under_guard(end))),
        );
        rows.push(
            row("while the controller is silent")
                .sees("`NoAnswer` in each wait", "the read limit (1 s) and 0.5 s")
                .by(&[By::Board])
                .test(move || Ok(in_silence(end))),
        );
    }
    rows.push(
        Row::new(SECTION, "FIN", "while another thread holds a guard")
            .sees("`ConnectionClosed` in each wait", "immediately, by `is_running`")
            .by(&[By::Board])
            .test(|| Ok(lost_under_guard())),
    );
    for (place, write) in WRITES {
        rows.push(
            Row::new(SECTION, "writing between two transfers", place)
                .sees("nothing: its outputs have no effect", "–")
                .by(&[By::Exchange])
                .test(move || Ok(between_transfers(write))),
        );
    }
    rows
}

/// Threads in `wait_cycle` and `wait_until`. Each returns the error that it sees.
pub(crate) fn waiters(area: &TransferAreas) -> Vec<JoinHandle<Error>> {
    let (begun, has_begun) = mpsc::channel();
    let waiters = (0..8).map(|number| {
        let (area, begun) = (area.clone(), begun.clone());
        thread::spawn(move || {
            begun.send(()).unwrap();
            match number % 2 {
                0 => loop {
                    if let Err(error) = area.wait_cycle() {
                        return error;
                    }
                },
                _ => area.wait_until(|_| false, 2 * DEADLINE).map(drop).unwrap_err(),
            }
        })
    });
    let waiters = waiters.collect();
    (0..8).for_each(|_| has_begun.recv().unwrap());
    waiters
}

/// The one error that all waiters see.
pub(crate) fn error_of(waiters: Vec<JoinHandle<Error>>) -> Error {
    let errors: Vec<Error> = waiters.into_iter().map(|waiter| waiter.join().unwrap()).collect();
    assert!(errors.iter().all(|error| *error == errors[0]), "{errors:?}");
    errors[0].clone()
}

/// A program with a motor on.
fn start(port: u16) -> TransferAreaComHandler {
    let limits = TimeLimits::default().read(Duration::from_secs(1));
    let handler = handler_at(port).time_limits(limits).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    handler
}

fn with_waiters(end: End) -> Outcome {
    let controller = Controller::start(txt());
    let handler = start(controller.port());
    controller.wait_on();
    let waiters = waiters(&handler.areas().clone());
    let struck = Instant::now();
    end(handler);
    let error = error_of(waiters);
    let soon = struck.elapsed();
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

/// The motors stop while the guard is still held.
fn under_guard(end: End) -> Outcome {
    let controller = Controller::start(txt());
    let handler = start(controller.port());
    controller.wait_on();
    let area = handler.areas().clone();
    let (sender, receiver) = mpsc::channel();
    let (let_go, is_let_go) = mpsc::channel::<()>();
    let holder = thread::spawn(move || {
        let mut guard = area.lock();
        sender.send(()).unwrap();
        let _ = is_let_go.recv();
        guard[LOCAL_IO].output.duty[0] = DUTY;
        drop(guard);
        loop {
            // The transfer may still wait for the response of the last exchange.
            if let Err(error) = area.wait_cycle() {
                return error;
            }
        }
    });
    receiver.recv().unwrap();
    let struck = Instant::now();
    let ending = thread::spawn(move || end(handler));
    controller.wait("the end of online mode", |machine| !machine.online());
    let_go.send(()).unwrap();
    let error = holder.join().unwrap();
    ending.join().unwrap();
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Error(error), soon: None, by, stopped }
}

/// A motor that was on stays off in the next transfer.
fn between_transfers(write: Write) -> Outcome {
    let controller = Controller::start(txt());
    let handler = start(controller.port());
    controller.wait_on();
    let area = handler.areas().clone();
    let struck = Instant::now();
    write(&area, &|| assert_eq!(handler.end_transfer(), Ok(())));
    assert_eq!(handler.begin_transfer(), Ok(()));
    for _ in 0..5 {
        drop(handler.areas().wait_cycle().unwrap());
        assert_eq!(area.lock()[LOCAL_IO].output.duty, [0; 8]);
    }
    assert_eq!(handler.end_transfer(), Ok(()));
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Nothing, soon: None, by, stopped }
}

/// A thread that waits for a response learns of the end although the areas are locked.
fn lost_under_guard() -> Outcome {
    let controller = Controller::start(txt());
    let strike = Strike { place: Place::Exchange, in_request: false, fault: Fault::Fin };
    let proxy = Proxy::start(controller.port(), [strike]);
    let handler = start(proxy.port());
    let area = handler.areas().clone();
    let guard = handler.areas().lock();
    // While a guard is held no thread gets the areas, so only the end of the transfer ends this.
    let waiting =
        thread::spawn(move || area.wait_until(|_| false, DEADLINE).map(drop).unwrap_err());
    proxy.wait_struck();
    while handler.areas().is_running() {
        thread::sleep(Duration::from_millis(1));
    }
    let soon = proxy.struck().elapsed();
    drop(guard);
    let error = waiting.join().unwrap();
    assert_eq!(handler.end_transfer(), Err(error.clone()));
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

/// The controller has just become silent.
fn in_silence(end: End) -> Outcome {
    let controller = Controller::with_idle_limit(txt(), IDLE_LIMIT);
    let strike = Strike { place: Place::Exchange, in_request: false, fault: Fault::Cut };
    let proxy = Proxy::start(controller.port(), [strike]);
    let handler = start(proxy.port());
    let waiters = waiters(&handler.areas().clone());
    proxy.wait_struck();
    end(handler);
    let error = error_of(waiters);
    let soon = proxy.struck().elapsed();
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}
