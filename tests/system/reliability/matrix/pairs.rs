//! Two things at the same time: what a program is doing, and what ends or interrupts its transfer.

use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, Event, EventKind, TimeLimits, TransferAreaComHandler};
use ft_transfer_area_simulator::FaultKind;

use super::beside::{Beside, Waiting};
use super::controller::{handler_at, is_on, txt, Controller, DUTY};
use super::fake::closed_port;
use super::panics::ON_PURPOSE;
use super::row::{By, Outcome, Row, Seen, Turn, DEADLINE, MARGIN};
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "Two things at the same time";

/// The watchdog's limit. A test notices when it takes twice as long.
const LIMIT: Duration = Duration::from_secs(4);

/// The watchdog's limit while the controller takes 1.2 s for an answer.
const SHORT_LIMIT: Duration = Duration::from_secs(1);

/// How long a call of a hook sleeps that does not hang.
const NAP: Duration = Duration::from_millis(300);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    Watchdog,
    Panic,
    End,
    Gap,
    Drop,
}

pub(crate) fn rows() -> Vec<Row> {
    use Beside::{
        BlockedLogger, CameraCommand, HangingHook, HeldGuard, SleepingHook, WaitingForGuard,
        WaitingThreads,
    };
    use Reason::{Drop, End, Gap, Panic, Watchdog};
    let watchdog = [
        SleepingHook(LIMIT + LIMIT / 2),
        HangingHook,
        HeldGuard,
        // A program whose threads are notified of responses and answer them does not hang.
        WaitingForGuard(LIMIT / 8 * 7),
        CameraCommand,
        BlockedLogger,
    ];
    let others =
        [SleepingHook(NAP), HangingHook, HeldGuard, WaitingThreads, CameraCommand, BlockedLogger];
    let mut rows: Vec<Row> = watchdog.into_iter().map(|beside| row(beside, Watchdog)).collect();
    for reason in [Panic, End, Gap, Drop] {
        // A handler can't be dropped while a thread is in one of its calls.
        let possible = |beside: &Beside| (*beside, reason) != (CameraCommand, Drop);
        rows.extend(others.into_iter().filter(possible).map(|beside| row(beside, reason)));
    }
    rows
}

fn row(beside: Beside, reason: Reason) -> Row {
    let (fault, sees, limit) = match reason {
        Reason::Watchdog => (
            "the watchdog expires",
            "`WatchdogExpired` once for each handle, and it goes on",
            "the watchdog's limit (4 s)",
        ),
        Reason::Gap => {
            ("FIN", "`ConnectionLost` once for each handle, and it goes on", "immediately")
        }
        Reason::Panic => ("panic", "`ProgramPanicked` in each wait", "the current exchange"),
        Reason::End => ("`end_transfer`", "`NotStarted` in each wait", "two exchanges"),
        Reason::Drop => ("drop of the handler", "`NotStarted` in each wait", "two exchanges"),
    };
    let limit = match (reason, beside) {
        // Everything else comes after the answer.
        (Reason::Watchdog | Reason::Panic | Reason::End, Beside::CameraCommand) => {
            "the answer to the command (1.2 s)"
        }
        _ => limit,
    };
    let turn = match beside {
        // There is one logger for all.
        Beside::BlockedLogger => Turn::Alone,
        _ if reason == Reason::Watchdog => Turn::First,
        _ => Turn::WithOthers,
    };
    Row::new(SECTION, fault, beside.text())
        .sees(sees, limit)
        .by(&[By::Exchange])
        .turn(turn)
        .test(move || Ok(run(beside, reason)))
}

impl Reason {
    /// Whether the transfer goes on afterwards.
    fn goes_on(self) -> bool {
        matches!(self, Self::Watchdog | Self::Gap)
    }

    /// The error that the program gets from its waits when the transfer has ended.
    fn end(self) -> Error {
        if self == Self::Panic {
            Error::ProgramPanicked
        } else {
            Error::NotStarted
        }
    }
}

/// A program with a motor on.
fn start(
    controller: &Controller,
    proxy: &Proxy,
    beside: Beside,
    reason: Reason,
) -> TransferAreaComHandler {
    let limits = TimeLimits::default().read(DEADLINE);
    let builder = handler_at(proxy.port()).time_limits(limits);
    let builder = builder.camera_port(controller.txt.camera_port());
    let builder = match reason {
        Reason::Watchdog if beside == Beside::CameraCommand => builder.watchdog(SHORT_LIMIT),
        Reason::Watchdog => builder.watchdog(LIMIT),
        Reason::Gap => builder.reconnect(DEADLINE).watchdog(DEADLINE),
        Reason::Panic | Reason::End | Reason::Drop if beside.is_hook() => {
            builder.watchdog(DEADLINE)
        }
        Reason::Panic | Reason::End | Reason::Drop => builder,
    };
    builder.build().unwrap()
}

fn run(beside: Beside, reason: Reason) -> Outcome {
    let controller = Controller::start(txt());
    let fault = if reason == Reason::Gap { Fault::Fin } else { Fault::SlowDrip };
    let strike = Strike { place: Place::StartCamera, in_request: false, fault };
    let proxy = Proxy::start(controller.port(), [strike]);
    let handler = Arc::new(start(&controller, &proxy, beside, reason));
    let events = handler
        .areas()
        .events(
            &[EventKind::WatchdogExpired, EventKind::ConnectionLost, EventKind::TransferEnded],
            10,
        )
        .unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    // Not before the watchdog has expired if they would give signs of life.
    let idle = handler.areas().clone();
    let mut waiting = Waiting::new(&handler, beside.waiting());
    let waits_later =
        reason == Reason::Watchdog && !beside.is_hook() && beside != Beside::HeldGuard;
    if !waits_later {
        waiting.begin();
    }
    let (_socket, nobody) = closed_port();
    if reason == Reason::Gap {
        proxy.lead_to(nobody);
    }
    let begin = Instant::now();
    let mut companion = beside.begin(&handler, &proxy);
    if matches!(beside, Beside::WaitingForGuard(_)) {
        waiting.begin();
    }
    let struck = match (reason, beside) {
        (Reason::Gap, Beside::CameraCommand) => proxy.struck(),
        // The last sign of life.
        (Reason::Watchdog, _) if beside.has_areas() => begin,
        _ => Instant::now(),
    };

    let mut handler = Some(handler);
    let ending = strike_with(reason, beside, &mut handler, &controller);
    let returned = Instant::now();
    let event = events.recv_timeout(DEADLINE).unwrap().event;
    let seen = Instant::now();
    let error = told_by(&event, reason);
    if reason != Reason::Gap {
        controller.wait("motors off", |machine| !is_on(machine));
    }
    let since = if reason == Reason::Panic { returned } else { seen };
    // When the panic was seen, the outputs of the next request may have been taken.
    let allowed = usize::from(reason == Reason::Panic);
    // To drop a hook that hangs, the handler waits for it.
    let (before, after) = match ending {
        Some(ending) if reason == Reason::Drop && beside.is_hook() => (None, Some(ending)),
        ending => (ending, None),
    };
    before.into_iter().for_each(|ending| ending.join().unwrap());
    assert!(seen.elapsed() < MARGIN, "the call does not return");
    if reason == Reason::Gap {
        // The connection is re-established without waiting for anything of the program.
        proxy.lead_to(controller.port());
        controller
            .wait("another connection", |machine| machine.online() && machine.connections() > 1);
    }

    companion.let_go();
    after.into_iter().for_each(|ending| ending.join().unwrap());
    waiting.begin();
    if reason.goes_on() {
        if let Some(reported) = &companion.reported {
            assert_eq!(reported.recv_timeout(DEADLINE).as_ref(), Ok(&error));
        }
        waiting.wait_until_told(&error, DEADLINE);
        assert_eq!(idle.feed_watchdog(), Err(error.clone()));
        for _ in 0..5 {
            assert!(idle.wait_cycle().is_ok(), "it gets the error once");
        }
    }
    if let Some(handler) = handler {
        let result = if reason == Reason::Panic { Err(reason.end()) } else { Ok(()) };
        assert_eq!(handler.end_transfer(), result);
    }
    waiting.wait_until_ended(&reason.end());
    let told_again = companion.reported.iter().flatten().next();
    assert_eq!(told_again, None, "the hook is notified once");
    assert_eq!(idle.lock()[LOCAL_IO].output.duty, [0; 8]);
    let (by, stopped) = controller.stopped_after(struck);
    assert!(controller.duties_since(since) <= allowed, "a duty was sent after the program knew");
    let in_time = |stopped| stopped < (seen - struck) + MARGIN;
    assert!(reason == Reason::Gap || stopped.is_some_and(in_time), "{stopped:?}");
    Outcome { seen: Seen::Error(error), soon: Some(seen - struck), by, stopped }
}

/// Lets it happen. Returns a thread in which the program's call is under way.
fn strike_with(
    reason: Reason,
    beside: Beside,
    handler: &mut Option<Arc<TransferAreaComHandler>>,
    controller: &Controller,
) -> Option<JoinHandle<()>> {
    let theirs = handler.as_ref().map(Arc::clone)?;
    match reason {
        Reason::Watchdog => None,
        Reason::Gap => {
            if beside != Beside::CameraCommand {
                let close = FaultKind::Close { after: 0 };
                controller.txt.with_machine(|machine| machine.disturb(close));
            }
            None
        }
        Reason::Panic => {
            let area = theirs.areas().clone();
            let panicked = thread::spawn(move || {
                let area = area;
                let _guard = (!beside.has_areas()).then(|| area.lock());
                panic!("{ON_PURPOSE}");
            });
            panicked.join().unwrap_err();
            None
        }
        Reason::End => Some(thread::spawn(move || assert_eq!(theirs.end_transfer(), Ok(())))),
        Reason::Drop => {
            drop(theirs);
            let last = handler.take().and_then(Arc::into_inner).expect("nobody else has it");
            Some(thread::spawn(move || drop(last)))
        }
    }
}

/// The error that the program gets for this event.
fn told_by(event: &Event, reason: Reason) -> Error {
    match event {
        Event::WatchdogExpired { limit, .. } => Error::WatchdogExpired { limit: *limit },
        Event::ConnectionLost { error, .. } => {
            Error::ConnectionLost { cause: Box::new(error.clone()) }
        }
        Event::TransferEnded { error, .. } => {
            let reported = error.clone().unwrap_or(Error::NotStarted);
            assert_eq!(reported, reason.end());
            reported
        }
        other => panic!("{other:?}"),
    }
}
