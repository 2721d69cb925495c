//! What a program can learn of its own delays.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{mpsc, Arc};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, Statistics, TransferAreaComHandler};

use super::controller::{txt, Controller, DUTY};
use super::load::goes_on;
use super::logger::wait_for_guard_of;
use super::row::{Outcome, Row, DEADLINE};

const SECTION: &str = "Programs that are too slow";

/// How many exchanges a program leaves without an answer.
const EXCHANGES: u64 = 20;

pub(crate) fn rows() -> Vec<Row> {
    vec![
        Row::new(SECTION, "a program that polls", "too late for 20 responses")
            .sees("nothing: `missed_responses` counts each", "–")
            .test(|| Ok(missed_responses())),
        Row::new(SECTION, "a program that waits", "for each response, in lock-step")
            .sees("nothing: `missed_responses` stays 0", "–")
            .test(|| Ok(answered_responses())),
        Row::new(SECTION, "a hook that sleeps", "during 20 exchanges")
            .sees("nothing: `missed_responses` counts each that nobody answers", "–")
            .test(|| Ok(sleeping_hook())),
        Row::new(SECTION, "a guard that is held", "for longer than 1 s")
            .sees("nothing, and a warning that names the thread, once", "1 s")
            .test(|| Ok(long_guard())),
    ]
}

/// A program with a motor on.
fn start(controller: &Controller) -> TransferAreaComHandler {
    let handler = controller.handler().build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    handler
}

/// Waits for some exchanges without a call of the handler.
fn wait_for_exchanges(controller: &Controller) {
    let before = controller.txt.with_machine(|machine| machine.exchanges());
    controller.wait("exchanges", |machine| machine.exchanges() >= before + EXCHANGES);
}

fn missed_responses() -> Outcome {
    let controller = Controller::start(txt());
    let handler = start(&controller);
    let before = handler.areas().statistics();
    wait_for_exchanges(&controller);
    let after = handler.areas().statistics();
    let missed = after.missed_responses - before.missed_responses;
    let responses = after.cycles - before.cycles;
    assert!(responses >= EXCHANGES - 1);
    // The window of the first or of the last response may be open.
    assert!(missed.abs_diff(responses) <= 1, "{missed} of {responses}");
    assert_eq!(after.late_reactions, before.late_reactions, "there was no guard");
    goes_on(&controller, handler)
}

fn answered_responses() -> Outcome {
    let controller = Controller::start(txt().lock_step());
    let handler = controller.handler().lock_step().build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    for _ in 0..EXCHANGES {
        drop(handler.areas().wait_cycle().unwrap());
    }
    let Statistics { cycles, missed_responses, .. } = handler.areas().statistics();
    assert!(cycles >= EXCHANGES, "{cycles}");
    assert_eq!(missed_responses, 0);
    goes_on(&controller, handler)
}

fn sleeping_hook() -> Outcome {
    let controller = Controller::start(txt());
    // So long that it does not expire on a busy machine.
    let handler = controller.handler().watchdog(DEADLINE).build().unwrap();
    let calls = Arc::new(AtomicU64::new(0));
    let (let_go, gate) = mpsc::channel::<()>();
    let counted = Arc::clone(&calls);
    handler
        .set_cycle_hook(move |areas| {
            let Ok(areas) = areas else { return ControlFlow::Break(()) };
            areas[LOCAL_IO].output.duty[0] = DUTY;
            if counted.fetch_add(1, Ordering::SeqCst) == 1 {
                let _ = gate.recv();
            }
            ControlFlow::Continue(())
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    controller.wait_on();
    controller.wait("the second call", |_| calls.load(Ordering::SeqCst) == 2);
    let before = handler.areas().statistics();
    wait_for_exchanges(&controller);
    let after = handler.areas().statistics();
    let missed = after.missed_responses - before.missed_responses;
    assert!(missed >= EXCHANGES - 2, "{missed}");
    // The window of the last response before may be open.
    assert!(missed <= after.cycles - before.cycles + 1, "{missed}");
    assert_eq!(calls.load(Ordering::SeqCst), 2);
    drop(let_go);
    controller.wait("more calls", |_| calls.load(Ordering::SeqCst) > 5);
    goes_on(&controller, handler)
}

fn long_guard() -> Outcome {
    const NAME: &str = "holds-a-guard-in-a-row";
    let controller = Controller::start(txt());
    let handler = start(&controller);
    let area = handler.areas().clone();
    let (let_go, gate) = mpsc::channel::<()>();
    let (locked, is_locked) = mpsc::channel();
    let holder = thread::Builder::new().name(NAME.to_owned()).spawn(move || {
        let guard = area.lock();
        locked.send(Instant::now()).unwrap();
        let _ = gate.recv();
        drop(guard);
    });
    let begin = is_locked.recv().unwrap();
    let lines = wait_for_guard_of(NAME);
    let soon = begin.elapsed();
    assert!(soon > Duration::from_millis(900), "too early: {soon:?}");
    wait_for_exchanges(&controller);
    assert_eq!(wait_for_guard_of(NAME), lines, "once for each guard");
    assert_eq!(lines.len(), 1);
    assert!(lines[0].contains("lock again in each round"), "it says what to do: {lines:?}");
    drop(let_go);
    holder.unwrap().join().unwrap();
    let result: Result<(), Error> = handler.areas().wait_cycle().map(drop);
    assert_eq!(result, Ok(()));
    Outcome { soon: Some(soon), ..goes_on(&controller, handler) }
}
