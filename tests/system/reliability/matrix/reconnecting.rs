//! Connections that are lost and re-established.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::Counter;
use ft_transfer_area::{
    Error, EventKind, FirmwareVersion, TimeLimits, TransferAreaComHandler, TransferAreas,
};

use super::controller::{handler_at, is_on, txt, Controller, DUTY};
use super::fake::closed_port;
use super::panics::ON_PURPOSE;
use super::row::{By, Outcome, Row, Seen, DEADLINE};
use super::wire::{names, run, set_up, small_pictures, ways, Way};
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "The main connection, with reconnecting";

const ONCE: &str = "`ConnectionLost` once, and it goes on";

const EXCHANGE_OR_NEVER: [By; 2] = [By::Exchange, By::NeverOn];

/// How long reconnecting is tried if it can't succeed.
const LIMIT: Duration = Duration::from_secs(1);

const VERSION: FirmwareVersion = FirmwareVersion::new(4, 1, 6);

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for Way { in_request, fault, text, sees, by, places } in ways() {
        // If nothing of this connection arrives, the first exchange of the next one stops them.
        let by = if by.contains(&By::NeverOn) { &EXCHANGE_OR_NEVER[..] } else { &[By::Exchange] };
        let row = Row::new(SECTION, text, "while it runs").sees(ONCE, sees.1).by(by);
        rows.push(places.iter().fold(row, |row, &place| {
            let strike = Strike { place, in_request, fault };
            row.test_at(format!("{place:?}"), move || Ok(reconnects_after(strike, sees.0)))
        }));
    }
    // A connection is only re-established for a transfer that has begun and does not end.
    for (text, places, by) in [
        (
            "QueryStatus, and UpdateConfig before the first exchange",
            &[Place::QueryStatus, Place::UpdateConfig][..],
            &[By::NeverOn],
        ),
        ("each packet of the end", Place::END, &[By::Exchange]),
    ] {
        let row = Row::new(SECTION, "FIN instead of the response", text);
        let row = row.sees("`ConnectionClosed` with the command", "immediately").by(by);
        rows.push(places.iter().fold(row, |row, &place| {
            let strike = response(place, Fault::Fin);
            row.test_at(format!("{place:?}"), move || Ok(run(strike, Some(DEADLINE))))
        }));
    }
    let closed = |fault, place| Row::new(SECTION, fault, place).by(&[By::Exchange]);
    let gone = |place| Row::new(SECTION, "the controller is gone", place).by(&[By::Board]);
    let back = |place| closed("the controller is back", place);
    rows.extend([
        closed("FIN", "with eight waiting threads, and an idle handle")
            .sees("`ConnectionLost` once for each handle, and it goes on", "immediately")
            .test(|| Ok(with_waiters(&GAP, 1))),
        closed("several gaps in a row", "FIN, RST, and half a response")
            .sees("`ConnectionLost` three times for each handle, and it goes on", "immediately")
            .test(|| Ok(with_waiters(&GAPS, 3))),
        closed("more faults in the gap", "in each packet of the handshake")
            .sees("`ConnectionLost` once for each handle, and it goes on", "immediately")
            .test(|| Ok(with_waiters(&IN_HANDSHAKE, 1))),
        closed("a gap at the first exchange after a gap", "whose outputs may have arrived")
            .sees("`ConnectionLost` twice for each handle, and it goes on", "immediately")
            .test(|| Ok(with_waiters(&AT_FIRST_EXCHANGE, 2))),
        closed("silence at the first exchange after a gap", "with a duty that was set in the gap")
            .sees("`ConnectionLost` once more, and it goes on", "the read limit (1 s)")
            .test(|| Ok(duty_in_gap())),
        closed("FIN", "while a guard with a duty is held during the gap")
            .sees(ONCE, "when the guard is dropped")
            .test(|| Ok(under_guard())),
        closed("FIN", "while the camera runs").sees(ONCE, "immediately").test(|| Ok(with_camera())),
        closed("the controller is restarted", "with newer firmware")
            .sees("`ConnectionLost` once, then the new version", "immediately")
            .by(&[By::Board])
            .test(|| Ok(restarted(FirmwareVersion::new(4, 7, 0)))),
        closed("the controller is restarted", "with firmware below 4.1.6")
            .sees("`ConnectionLost`, then `FirmwareTooOld`", "the next attempt")
            .by(&[By::Board])
            .test(|| Ok(restarted(FirmwareVersion::new(4, 1, 5)))),
        gone("until the limit for reconnecting")
            .sees("`ConnectionLost`, then `ReconnectFailed`", "the limit (1 s)")
            .test(|| {
                Ok(in_gap(LIMIT, |handler, area, _| {
                    let error = next_error(area);
                    assert_eq!(handler.end_transfer(), Err(error.clone()), "the error stays");
                    error
                }))
            }),
        gone("`end_transfer` in the gap")
            .sees("`ConnectionClosed` with the command", "one more attempt")
            .test(|| {
                Ok(in_gap(DEADLINE, |handler, area, _| {
                    let error = handler.end_transfer().unwrap_err();
                    assert_eq!(next_error(area), error);
                    error
                }))
            }),
        gone("drop of the handler in the gap")
            .sees("`ConnectionClosed` with the command", "one more attempt")
            .test(|| {
                Ok(in_gap(DEADLINE, |handler, area, _| {
                    drop(handler);
                    next_error(area)
                }))
            }),
        back("`end_transfer` in the gap")
            .sees("`NotStarted` in each wait", "one more attempt")
            .test(|| Ok(ended_in_gap(|handler| assert_eq!(handler.end_transfer(), Ok(()))))),
        back("drop of the handler in the gap")
            .sees("`NotStarted` in each wait", "one more attempt")
            .test(|| Ok(ended_in_gap(drop))),
        gone("panic under a guard in the gap").sees("`ProgramPanicked`", "one more attempt").test(
            || {
                Ok(in_gap(DEADLINE, |handler, area, _| {
                    let panicked = catch_unwind(AssertUnwindSafe(|| {
                        let mut guard = handler.areas().lock();
                        guard[LOCAL_IO].output.duty[0] = DUTY;
                        panic!("{ON_PURPOSE}");
                    }));
                    panicked.unwrap_err();
                    let error = next_error(area);
                    assert_eq!(handler.end_transfer(), Err(error.clone()), "the error stays");
                    error
                }))
            },
        ),
        gone("`begin_transfer` in the gap")
            .sees("`AlreadyStarted`, and it goes on", "immediately")
            .test(|| {
                Ok(in_gap(DEADLINE, |handler, area, proxy| {
                    let error = handler.begin_transfer().unwrap_err();
                    let again = Controller::start(txt());
                    proxy.lead_to(again.port());
                    check_goes_on(area);
                    assert_eq!(handler.end_transfer(), Ok(()));
                    error
                }))
            }),
    ]);
    rows
}

const fn response(place: Place, fault: Fault) -> Strike {
    Strike { place, in_request: false, fault }
}

const GAP: [Strike; 1] = [response(Place::Exchange, Fault::Fin)];

const GAPS: [Strike; 3] = [
    response(Place::Exchange, Fault::Fin),
    response(Place::Exchange, Fault::Rst),
    response(Place::Exchange, Fault::HalfThenFin),
];

const IN_HANDSHAKE: [Strike; 4] = [
    response(Place::Exchange, Fault::Fin),
    response(Place::QueryStatus, Fault::Fin),
    response(Place::StartOnline, Fault::Rst),
    response(Place::UpdateConfig, Fault::HalfThenFin),
];

const AT_FIRST_EXCHANGE: [Strike; 2] =
    [response(Place::Exchange, Fault::Fin), response(Place::FirstExchange, Fault::Fin)];

/// Waits until the next error.
fn next_error(area: &TransferAreas) -> Error {
    loop {
        if let Err(error) = area.wait_cycle() {
            return error;
        }
    }
}

/// The gaps that a handle learns of, and the error that ends its waits.
fn reported(area: &TransferAreas) -> (Vec<Error>, Error) {
    let mut gaps = Vec::new();
    loop {
        match next_error(area) {
            error @ Error::ConnectionLost { .. } => gaps.push(error),
            error => return (gaps, error),
        }
    }
}

fn waiter(handler: &TransferAreaComHandler) -> JoinHandle<(Vec<Error>, Error)> {
    let area = handler.areas().clone();
    thread::spawn(move || reported(&area))
}

/// Checks that outputs and inputs are exchanged again, with the motors off.
fn check_goes_on(area: &TransferAreas) {
    for _ in 0..5 {
        let areas = area.wait_cycle().expect("it gets the error once");
        assert_eq!(areas[LOCAL_IO].output.duty, [0; 8]);
    }
    area.lock()[LOCAL_IO].start_counter_reset(Counter::C1);
    drop(area.wait_counter_reset(LOCAL_IO, Counter::C1, DEADLINE).unwrap());
}

/// A program with a motor on that calls again when the connection was lost in this way.
fn reconnects_after(strike: Strike, cause: &str) -> Outcome {
    let place = strike.place;
    let (controller, proxy, builder) = set_up(strike);
    let handler = builder.reconnect(DEADLINE).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    let idle = handler.areas().clone();
    handler.begin_transfer().unwrap();
    let waiter = waiter(&handler);
    let mut frames = None;
    let area = handler.areas().clone();
    let mut cycles = 0..;
    let error = loop {
        if let Err(error) = area.wait_cycle() {
            break error;
        }
        match (cycles.next(), place) {
            (Some(5), Place::NewConfig) => area.lock()[LOCAL_IO].raise_config_id(),
            // This waits until there is a connection again.
            (Some(5), Place::StartCamera) => {
                frames = Some(handler.start_camera(small_pictures()).unwrap());
            }
            _ => {}
        }
    };
    let soon = proxy.struck().elapsed();
    check_cause(&error, place, cause);
    check_goes_on(&area);
    assert_eq!(idle.feed_watchdog(), Err(error.clone()));
    assert_eq!(idle.feed_watchdog(), Ok(()), "it gets the error once");
    assert_eq!(handler.areas().statistics().gaps, 1);
    drop(frames);
    assert_eq!(handler.end_transfer(), Ok(()));
    let end = (vec![error.clone()], Error::NotStarted);
    assert_eq!(waiter.join().unwrap(), end, "another thread sees the same");
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

/// Whether a gap has the cause that would end the transfer without reconnecting.
fn check_cause(error: &Error, place: Place, told_by: &str) {
    let Error::ConnectionLost { cause } = error else { panic!("{error:?}") };
    assert!(names(cause, place), "{cause:?} does not name {}", place.command().name());
    assert!(Seen::Error((**cause).clone()).is_told_by(told_by), "{cause:?}");
}

/// Each handle learns of each gap.
fn with_waiters(strikes: &'static [Strike], gaps: usize) -> Outcome {
    let controller = Controller::start(txt());
    let proxy = Proxy::start(controller.port(), strikes.iter().copied());
    let limits = TimeLimits::default().read(DEADLINE);
    let builder = handler_at(proxy.port()).time_limits(limits);
    let handler = builder.reconnect(DEADLINE).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    let waiters: Vec<_> = (0..8).map(|_| waiter(&handler)).collect();
    let idle = handler.areas().clone();
    let first = next_error(&handler.areas().clone());
    let soon = proxy.struck().elapsed();
    controller.wait("all faults", |_| proxy.is_done());
    let errors: Vec<Error> = (0..gaps).map(|_| next_error(&idle)).collect();
    assert_eq!(errors[0], first);
    assert!(errors.iter().all(|error| matches!(error, Error::ConnectionLost { .. })), "{errors:?}");
    for _ in 0..5 {
        assert!(idle.wait_cycle().is_ok(), "it gets each error once");
    }
    assert_eq!(handler.areas().statistics().gaps, gaps as u64);
    assert_eq!(handler.end_transfer(), Ok(()));
    for waiter in waiters {
        assert_eq!(waiter.join().unwrap(), (errors.clone(), Error::NotStarted));
    }
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(first), soon: Some(soon), by, stopped }
}

/// A duty that was set in the gap may have arrived. So the motor is stopped, and the handle gets an error.
fn duty_in_gap() -> Outcome {
    let controller = Controller::start(txt());
    let strikes =
        [response(Place::Exchange, Fault::Fin), response(Place::FirstExchange, Fault::Silence)];
    let proxy = Proxy::start(controller.port(), strikes);
    let limits = TimeLimits::default().read(LIMIT);
    let builder = handler_at(proxy.port()).time_limits(limits);
    let handler = builder.reconnect(DEADLINE).build().unwrap();
    let (_socket, nobody) = closed_port();
    handler.begin_transfer().unwrap();
    proxy.lead_to(nobody);
    let lost = next_error(&handler.areas().clone());
    let area = handler.areas().clone();
    assert_eq!(next_error(&area), lost);
    area.lock()[LOCAL_IO].output.duty[0] = DUTY;
    proxy.lead_to(controller.port());
    controller.wait_on();
    let struck = Instant::now();
    let error = area.wait_cycle().map(drop).expect_err("the motors were stopped once more");
    let soon = struck.elapsed();
    for _ in 0..5 {
        assert_eq!(area.wait_cycle().unwrap()[LOCAL_IO].output.duty, [0; 8]);
    }
    assert_eq!(handler.end_transfer(), Ok(()));
    let (by, stopped) = controller.stopped_after(struck);
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

/// A program with a motor on whose connection is lost when it has another configuration.
fn start(limit: Duration) -> (Controller, Proxy, TransferAreaComHandler) {
    let controller = Controller::start(txt().firmware(VERSION));
    let proxy = Proxy::start(controller.port(), [response(Place::NewConfig, Fault::Fin)]);
    let builder = handler_at(proxy.port());
    let builder = builder.camera_port(controller.txt.camera_port()).reconnect(limit);
    let handler = builder.build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    (controller, proxy, handler)
}

/// Loses the connection, and leads the next ones to this port. Returns what a handle sees, and when.
fn lose(proxy: &Proxy, area: &TransferAreas, to: u16) -> (Error, Duration) {
    proxy.lead_to(to);
    area.lock()[LOCAL_IO].raise_config_id();
    let error = next_error(area);
    assert!(matches!(error, Error::ConnectionLost { .. }), "{error:?}");
    (error, proxy.struck().elapsed())
}

/// Nothing listens in the gap. The program does something, which gives an error.
fn in_gap(
    limit: Duration,
    run: fn(TransferAreaComHandler, &TransferAreas, &Proxy) -> Error,
) -> Outcome {
    let (controller, proxy, handler) = start(limit);
    let area = handler.areas().clone();
    let (_socket, nobody) = closed_port();
    lose(&proxy, &area, nobody);
    let lost = Instant::now();
    let error = run(handler, &area, &proxy);
    let soon = Some(lost.elapsed());
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon, by, stopped }
}

/// The controller can be reached again when the transfer is ended in the gap.
fn ended_in_gap(end: fn(TransferAreaComHandler)) -> Outcome {
    let (controller, proxy, handler) = start(DEADLINE);
    let area = handler.areas().clone();
    let (_socket, nobody) = closed_port();
    lose(&proxy, &area, nobody);
    let back = Instant::now();
    proxy.lead_to(controller.port());
    end(handler);
    let soon = Some(back.elapsed());
    let error = next_error(&area);
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon, by, stopped }
}

fn restarted(version: FirmwareVersion) -> Outcome {
    let (controller, proxy, handler) = start(DEADLINE);
    let area = handler.areas().clone();
    let other = Controller::start(txt().firmware(version));
    // The program learns of the gap before the other controller can end the transfer.
    let (_socket, nobody) = closed_port();
    let (mut error, mut soon) = lose(&proxy, &area, nobody);
    let led = Instant::now();
    proxy.lead_to(other.port());
    if version > VERSION {
        check_goes_on(&area);
        assert_eq!(handler.version(), Some(version));
        assert_eq!(handler.end_transfer(), Ok(()));
    } else {
        error = next_error(&area);
        soon = led.elapsed();
        assert_eq!(handler.end_transfer(), Err(error.clone()), "the error stays");
    }
    assert!(!other.txt.with_machine(|machine| is_on(machine)), "the motor is on again");
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

fn under_guard() -> Outcome {
    let (controller, proxy, handler) = start(DEADLINE);
    let (area, unaware) = (handler.areas().clone(), handler.areas().clone());
    let events = handler.areas().events(&[EventKind::ConnectionRestored], 10).unwrap();
    area.lock()[LOCAL_IO].raise_config_id();
    let mut guard = unaware.lock();
    guard[LOCAL_IO].output.duty[0] = DUTY;
    events.recv_timeout(DEADLINE).unwrap();
    drop(guard);
    let error = next_error(&area);
    check_goes_on(&area);
    assert_eq!(handler.end_transfer(), Ok(()));
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: None, by, stopped }
}

fn with_camera() -> Outcome {
    let (controller, proxy, handler) = start(DEADLINE);
    let area = handler.areas().clone();
    let frames = handler.start_camera(small_pictures()).unwrap();
    let before = frames.recv_timeout(DEADLINE).unwrap();
    let (error, soon) = lose(&proxy, &area, controller.port());
    check_goes_on(&area);
    while frames.try_recv().is_ok() {}
    let after = frames.recv_timeout(DEADLINE).unwrap();
    assert!(after.sequence > before.sequence);
    assert_eq!(handler.camera_error(), None);
    assert_eq!(handler.end_transfer(), Ok(()));
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}
