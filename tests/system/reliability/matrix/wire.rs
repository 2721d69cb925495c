//! Faults of the main connection, at every packet.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{
    CameraOptions, Error, TimeLimits, TransferAreaComHandler, TransferAreaComHandlerBuilder,
    TransferMode,
};

use super::controller::{handler_at, txt, Controller, DUTY, IDLE_LIMIT};
use super::row::{By, Outcome, Row, Seen, DEADLINE};
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "The main connection";

/// The read limit in tests where it ends the wait.
const READ_LIMIT: Duration = Duration::from_secs(1);

const NO_ANSWER: (&str, &str) = ("`NoAnswer` with the command", "the read limit (1 s)");
const CLOSED: (&str, &str) = ("`ConnectionClosed` with the command", "immediately");

const WRONG_SIZE: (&str, &str) = ("`WrongSize` with the packet", "immediately");

/// Faults of a response, what the program sees, and what stops motors that run.
const RESPONSES: &[(Fault, &str, (&str, &str), By)] = &[
    (Fault::Fin, "FIN instead of the response", CLOSED, By::Board),
    (Fault::Rst, "RST instead of the response", CLOSED, By::Board),
    (Fault::HalfClose, "half-close: FIN, but requests are read", CLOSED, By::Exchange),
    (Fault::Silence, "silence, but requests are read", NO_ANSWER, By::Exchange),
    (Fault::Cut, "silence, and no request is read", NO_ANSWER, By::Board),
    (Fault::Half, "half a response, then silence", NO_ANSWER, By::Exchange),
    (Fault::HalfThenFin, "half a response, then FIN", CLOSED, By::Board),
    (Fault::Drip, "a response one byte at a time", ("nothing", "–"), By::Exchange),
    (Fault::SlowDrip, "one byte at a time, too slowly", NO_ANSWER, By::Exchange),
    (Fault::WrongId, "a wrong id", ("`WrongId` with the packet", "immediately"), By::Exchange),
    (Fault::Surplus, "extra bytes after the response", WRONG_SIZE, By::Exchange),
    (Fault::Endless, "endless bytes after the response", WRONG_SIZE, By::Exchange),
];

/// Faults of the response to an exchange.
const EXCHANGES: &[(Fault, &str, (&str, &str))] = &[
    (Fault::WrongCrc, "a wrong CRC", ("`WrongCrc`", "immediately")),
    (
        Fault::TooLarge,
        "a size larger than any packet",
        ("`TooLarge` with the packet", "immediately"),
    ),
    (Fault::TooLong, "a size larger than the data", NO_ANSWER),
    (
        Fault::TooShort,
        "a size smaller than the data",
        ("`WrongSize` with the packet", "immediately"),
    ),
    (
        Fault::WrongMask,
        "a mask with an extension that is not there",
        ("`DataEndsEarly`", "immediately"),
    ),
];

/// Faults of a request, before the controller has all of it, and what stops motors that run.
const REQUESTS: &[(Fault, &str, (&str, &str), By)] = &[
    (Fault::Fin, "FIN instead of reading the request", CLOSED, By::Board),
    (Fault::Rst, "RST instead of reading the request", CLOSED, By::Board),
    (Fault::Cut, "the request is not read, and nothing after it", NO_ANSWER, By::Board),
    (Fault::Half, "half a request arrives, and nothing after it", NO_ANSWER, By::Board),
    (Fault::Drip, "a request that arrives one byte at a time", ("nothing", "–"), By::Exchange),
    (Fault::WrongId, "a request that arrives with a wrong id", CLOSED, By::Board),
];

/// A part of a transfer.
struct Phase {
    text: &'static str,
    places: &'static [Place],
}

const HANDSHAKE: Phase = Phase { text: "each packet of the handshake", places: Place::HANDSHAKE };
/// Where a closed connection is an error at once.
const BESIDE_START: Phase = Phase {
    text: "QueryStatus, and UpdateConfig before the first exchange",
    places: &[Place::QueryStatus, Place::UpdateConfig],
};
const START: Phase =
    Phase { text: "StartOnline: it is tried again", places: &[Place::StartOnline] };
const RUNNING: Phase = Phase { text: "each packet while it runs", places: Place::RUNNING };
const END: Phase = Phase { text: "each packet of the end", places: Place::END };
const EXCHANGE: Phase = Phase { text: "each exchange", places: Place::EXCHANGES };
const SIMPLE: Phase = Phase { text: "a simple exchange", places: &[Place::SimpleExchange] };
const LAST: Phase = Phase { text: "the last exchange", places: &[Place::LastExchange] };

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for &(fault, text, sees, by) in RESPONSES {
        let goes_on = fault == Fault::Drip;
        let never = if goes_on { &[By::Exchange][..] } else { &[By::NeverOn] };
        rows.extend(handshake(false, fault, text, sees, never));
        rows.push(row(false, fault, text, RUNNING, sees).by(only(by)));
        rows.push(row(false, fault, text, SIMPLE, sees).by(only(by)));
        rows.push(row(false, fault, text, END, sees).by(&[By::Exchange]));
    }
    for &(fault, text, sees) in EXCHANGES {
        rows.push(row(false, fault, text, EXCHANGE, sees).by(&[By::Exchange]));
        rows.push(row(false, fault, text, LAST, sees).by(&[By::Exchange]));
    }
    for &(fault, text, sees, by) in REQUESTS {
        let goes_on = fault == Fault::Drip;
        let never = if goes_on { &[By::Exchange][..] } else { &[By::NeverOn] };
        rows.extend(handshake(true, fault, text, sees, never));
        rows.push(row(true, fault, text, RUNNING, sees).by(never_or(by)));
        let end = match by {
            By::Board => &[By::Exchange, By::Board][..],
            _ => &[By::Exchange],
        };
        rows.push(row(true, fault, text, END, sees).by(end));
    }
    let text = "a request that arrives with a wrong CRC";
    let crc = |phase| row(true, Fault::WrongCrc, text, phase, CLOSED);
    rows.push(crc(EXCHANGE).by(&[By::Board, By::NeverOn]));
    rows.push(crc(LAST).by(&[By::Board]));
    rows
}

/// The rows of the handshake. A TXT whose firmware ends closes the connection at StartOnline, and is back soon.
fn handshake(
    in_request: bool,
    fault: Fault,
    text: &'static str,
    sees: (&'static str, &'static str),
    by: &'static [By],
) -> Vec<Row> {
    let row = |phase, sees, by| row(in_request, fault, text, phase, sees).by(by);
    if sees == CLOSED && fault != Fault::HalfThenFin {
        vec![row(BESIDE_START, sees, by), row(START, ("nothing", "–"), &[By::Exchange])]
    } else {
        vec![row(HANDSHAKE, sees, by)]
    }
}

/// If the first exchange fails, no duty has arrived.
fn never_or(by: By) -> &'static [By] {
    match by {
        By::Board => &[By::Board, By::NeverOn],
        _ => &[By::Exchange],
    }
}

/// A way to lose a connection while it runs, as in the rows, and its places.
pub(crate) struct Way {
    pub(crate) in_request: bool,
    pub(crate) fault: Fault,
    pub(crate) text: &'static str,
    /// The error that the program sees, and its limit.
    pub(crate) sees: (&'static str, &'static str),
    pub(crate) by: &'static [By],
    pub(crate) places: &'static [Place],
}

/// All of them.
pub(crate) fn ways() -> Vec<Way> {
    let responses = RESPONSES.iter().map(|&(fault, text, sees, by)| {
        let (by, places) = (only(by), Place::RUNNING_EITHER_WAY);
        Way { in_request: false, fault, text, sees, by, places }
    });
    let exchanges = EXCHANGES.iter().map(|&(fault, text, sees)| {
        let (by, places) = (only(By::Exchange), Place::EXCHANGES);
        Way { in_request: false, fault, text, sees, by, places }
    });
    let requests = REQUESTS.iter().map(|&(fault, text, sees, by)| {
        let (by, places) = (never_or(by), Place::RUNNING);
        Way { in_request: true, fault, text, sees, by, places }
    });
    responses.chain(exchanges).chain(requests).filter(|way| way.fault != Fault::Drip).collect()
}

fn only(by: By) -> &'static [By] {
    match by {
        By::Board => &[By::Board],
        _ => &[By::Exchange],
    }
}

fn row(
    in_request: bool,
    fault: Fault,
    text: &'static str,
    phase: Phase,
    (sees, limit): (&'static str, &'static str),
) -> Row {
    phase.places.iter().fold(
        Row::new(SECTION, text, phase.text).sees(sees, limit),
        |row, &place| {
            let strike = Strike { place, in_request, fault };
            row.test_at(format!("{place:?}"), move || Ok(run(strike, None)))
        },
    )
}

/// The controller and the proxy for a fault, and settings for a program.
pub(crate) fn set_up(strike: Strike) -> (Controller, Proxy, TransferAreaComHandlerBuilder) {
    let controller = match strike.cuts() {
        true => Controller::with_idle_limit(txt(), IDLE_LIMIT),
        false => Controller::start(txt()),
    };
    let proxy = Proxy::start(controller.port(), [strike]);
    // Long if it does not end the wait, because the machine may be busy.
    let read = if strike.is_silent() { READ_LIMIT } else { DEADLINE };
    let mode = match strike.place {
        Place::SimpleExchange => TransferMode::Simple,
        _ => TransferMode::Compressed,
    };
    let builder = handler_at(proxy.port())
        .mode(mode)
        .camera_port(controller.txt.camera_port())
        .time_limits(TimeLimits::default().read(read));
    (controller, proxy, builder)
}

/// Runs a program with a motor on until the fault strikes, and then further.
pub(crate) fn run(strike: Strike, reconnect: Option<Duration>) -> Outcome {
    let place = strike.place;
    let (controller, proxy, builder) = set_up(strike);
    let builder = match reconnect {
        Some(limit) => builder.reconnect(limit),
        None => builder,
    };
    let error = transfer(builder.build().unwrap(), place);
    let seen = Instant::now();
    let struck = proxy.struck();
    if let Some(error) = &error {
        assert!(names(error, place), "{error:?} does not name {}", place.command().name());
    }
    let soon = error.is_some().then(|| seen.saturating_duration_since(struck));
    let (by, stopped) = controller.stopped_after(struck);
    let stopped = stopped.filter(|_| error.is_some());
    Outcome { seen: error.map_or(Seen::Nothing, Seen::Error), soon, by, stopped }
}

/// Begins, drives and ends a transfer, and returns its error, if there is one. Checks what is the
/// same for every error.
fn transfer(handler: TransferAreaComHandler, place: Place) -> Option<Error> {
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    let area = handler.areas().clone();
    let (begun, is_begun) = mpsc::channel();
    // Another thread of the program sees the same.
    let waiting = thread::spawn(move || {
        is_begun.recv().ok()?;
        area.wait_until(|_| false, 2 * DEADLINE).map(drop).err()
    });
    let result = handler.begin_transfer();
    let has_begun = result.is_ok();
    if has_begun {
        begun.send(()).unwrap();
    }
    drop(begun);
    let result = result.and_then(|()| drive(&handler, place));
    let error = result.err();
    assert!(!handler.areas().is_running());
    assert_eq!(handler.end_transfer(), error.clone().map_or(Ok(()), Err), "the error stays");
    let last = error.clone().unwrap_or(Error::NotStarted);
    assert_eq!(handler.areas().wait_cycle().unwrap_err(), last, "the error stays");
    if has_begun {
        assert_eq!(waiting.join().unwrap(), Some(last), "another thread sees the same");
        assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty, [0; 8]);
    }
    error
}

pub(crate) fn small_pictures() -> CameraOptions {
    CameraOptions::default().size(16, 16)
}

/// Does what makes the packet at this place appear, and ends the transfer.
fn drive(handler: &TransferAreaComHandler, place: Place) -> Result<(), Error> {
    let mut frames = None;
    for cycle in 0..30 {
        drop(handler.areas().wait_cycle()?);
        match (cycle, place) {
            (5, Place::NewConfig) => handler.areas().lock()[LOCAL_IO].raise_config_id(),
            (5, Place::StartCamera | Place::StopCamera) => {
                frames = Some(handler.start_camera(small_pictures())?);
            }
            (10, Place::LastExchange | Place::StopCamera | Place::StopOnline) => break,
            _ => {}
        }
    }
    drop(frames);
    handler.end_transfer()
}

/// Whether an error names the command or packet at which it happened, if it names any.
pub(crate) fn names(error: &Error, place: Place) -> bool {
    let command = place.command();
    match error {
        Error::NoAnswer { command: named, .. }
        | Error::ConnectionClosed { command: named, .. }
        | Error::Io { command: named, .. } => *named == command.name(),
        Error::WrongId { packet, .. }
        | Error::WrongSize { packet, .. }
        | Error::TooLarge { packet, .. } => *packet == command.response().name(),
        _ => true,
    }
}
