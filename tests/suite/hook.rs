//! The cycle hook.

use std::ops::ControlFlow::{self, Break, Continue};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{mpsc, Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, Event, EventKind, TransferAreaComHandler, TransferAreaGuard};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::support::{check_client, handler_for, unpaced, wait_until, Record, DEADLINE};

/// How many changes of an input a hook or a program answers.
const CHANGES: usize = 200;

/// I1 in a response, and O1 and O3 in the next request.
type Answer = (i16, [i16; 2]);

/// A simulated TXT that changes I1 with every response.
fn examiner() -> (SimulatedTxt, Arc<Mutex<Vec<Answer>>>) {
    let answers = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&answers);
    let mut asked = 0;
    let txt = unpaced().on_exchange(move |machine: &mut Machine| {
        let controller = &mut machine.controllers[LOCAL_IO];
        let duty = controller.outputs.duty;
        noted.lock().unwrap().push((asked, [duty[0], duty[2]]));
        asked = asked % 500 + 1;
        controller.uni[0] = asked;
    });
    (txt.start().unwrap(), answers)
}

/// A hook that copies I1 to the output with this index.
fn answer(
    output: usize,
) -> impl FnMut(Result<&mut TransferAreaGuard<'_>, Error>) -> ControlFlow<()> {
    move |areas| {
        let areas = areas.unwrap();
        areas[LOCAL_IO].output.duty[output] = areas[LOCAL_IO].input.uni[0];
        Continue(())
    }
}

/// A hook that counts its calls.
fn count(
    calls: &Arc<AtomicU64>,
) -> impl FnMut(Result<&mut TransferAreaGuard<'_>, Error>) -> ControlFlow<()> {
    let calls = Arc::clone(calls);
    move |_| {
        calls.fetch_add(1, Ordering::Relaxed);
        Continue(())
    }
}

fn wait_for_calls(calls: &AtomicU64, more: u64) {
    let wanted = calls.load(Ordering::Relaxed) + more;
    wait_for_call(calls, wanted);
}

fn wait_for_call(calls: &AtomicU64, wanted: u64) {
    let begin = Instant::now();
    while calls.load(Ordering::Relaxed) < wanted {
        assert!(begin.elapsed() < DEADLINE, "the hook is not called");
        thread::yield_now();
    }
}

fn build(txt: &SimulatedTxt, window: Duration) -> TransferAreaComHandler {
    handler_for(txt).reaction_window(window).build().unwrap()
}

fn duties(txt: &SimulatedTxt) -> [i16; 8] {
    txt.with_machine(|machine| machine.controllers[LOCAL_IO].outputs.duty)
}

#[test]
fn it_answers_each_response_in_the_very_next_request_beside_threads_that_wait() {
    let (txt, answers) = examiner();
    // It ends when the hook and the thread have answered.
    let handler = build(&txt, DEADLINE);
    let calls = Arc::new(AtomicU64::new(0));
    let mut counted = count(&calls);
    let set = handler.set_cycle_hook(move |areas| {
        let areas = areas.unwrap();
        areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
        counted(Ok(areas))
    });
    set.unwrap();
    for _ in 0..3 {
        handler.begin_transfer().unwrap();
        for _ in 0..CHANGES {
            drop(handler.areas().wait_cycle().unwrap());
        }
        handler.end_transfer().unwrap();
        // It is not called for the last response, which comes when the motors are stopped.
        let statistics = handler.areas().statistics();
        let uncalled = statistics.cycles - calls.swap(0, Ordering::Relaxed);
        assert!((1..=2).contains(&uncalled), "{uncalled}");
        assert_eq!((statistics.missed_responses, statistics.late_reactions), (0, 0));
    }
    let answers = answers.lock().unwrap();
    // The first request of each transfer is not an answer, and the last one stops the motors.
    let unanswered = answers.iter().filter(|(asked, answer)| answer[0] != *asked).count();
    assert!(unanswered <= 6, "{unanswered} inputs were not answered in the next request");
    assert!(answers.len() > 3 * CHANGES);
    check_client(&txt);
}

#[test]
fn threads_that_wait_read_what_it_wrote_and_may_change_it() {
    let (txt, answers) = examiner();
    let handler = build(&txt, DEADLINE);
    handler
        .set_cycle_hook(|areas| {
            let areas = areas.unwrap();
            areas[LOCAL_IO].output.duty[0] = -1;
            areas[LOCAL_IO].output.duty[2] = areas[LOCAL_IO].input.uni[0];
            Continue(())
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..CHANGES {
        let mut areas = handler.areas().wait_cycle().unwrap();
        let asked = areas[LOCAL_IO].input.uni[0];
        assert_eq!(areas[LOCAL_IO].output.duty[..3], [-1, 0, asked]);
        areas[LOCAL_IO].output.duty[0] = asked;
    }
    wait_until(&txt, "the last answer", |machine| machine.exchanges() > CHANGES as u64);
    handler.end_transfer().unwrap();
    for (asked, answer) in &answers.lock().unwrap()[1..=CHANGES] {
        assert_eq!(*answer, [*asked; 2], "an input was not answered in the next request");
    }
}

#[test]
fn programs_that_poll_keep_their_window() {
    let (txt, answers) = examiner();
    let handler = build(&txt, DEADLINE);
    handler.set_cycle_hook(answer(2)).unwrap();
    handler.begin_transfer().unwrap();
    let window = handler.areas().clone();
    let mut asked = 0;
    for _ in 0..CHANGES {
        let last = asked;
        while asked == last {
            // The hook is called even when the areas are locked often.
            let mut areas = handler.areas().lock();
            asked = areas[LOCAL_IO].input.uni[0];
            areas[LOCAL_IO].output.duty[0] = asked;
        }
        // The program has written its answer, so the window may end.
        drop(window.wait_cycle().unwrap());
    }
    wait_until(&txt, "the last answer", |machine| machine.exchanges() > CHANGES as u64);
    assert_eq!(handler.areas().statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
    for (asked, answer) in &answers.lock().unwrap()[1..=CHANGES] {
        assert_eq!(*answer, [*asked; 2], "an input was not answered in the next request");
    }
}

#[test]
fn stop_ends_the_transfer_well_with_the_motors_stopped() {
    let record = Record::default();
    let noted = record.clone();
    let txt = unpaced().on_exchange(move |machine| noted.note(machine)).start().unwrap();
    let handler = build(&txt, DEADLINE);
    let events = handler.areas().events(&[EventKind::TransferEnded], 10).unwrap();
    let mut calls = 0;
    handler
        .set_cycle_hook(move |areas| {
            let areas = areas.unwrap();
            calls += 1;
            *areas[LOCAL_IO].output.duty = [512, 0, 0, 300, 0, 0, 0, 1];
            if calls % 20 == 0 {
                Break(())
            } else {
                Continue(())
            }
        })
        .unwrap();
    for round in 1..=3 {
        handler.begin_transfer().unwrap();
        while handler.areas().wait_cycle().is_ok() {}
        let ended = events.recv_timeout(DEADLINE).unwrap().event;
        assert!(matches!(ended, Event::TransferEnded { error: None, .. }));
        assert_eq!(handler.areas().error(), None);
        assert_eq!(handler.areas().wait_cycle().unwrap_err(), Error::NotStarted);
        assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty, [0; 8]);
        assert_eq!(handler.end_transfer(), Ok(()));
        // The last exchange comes after the twentieth response.
        assert_eq!(record.outputs().len(), round * 21);
        assert_eq!(record.outputs()[round * 21 - 2].duty, [512, 0, 0, 300, 0, 0, 0, 1]);
        assert_eq!(record.last().duty, [0; 8]);
        assert!(!txt.with_machine(|machine| machine.online()));
    }
    check_client(&txt);
}

#[test]
fn its_panic_stops_the_motors_and_nothing_half_written_goes_out() {
    let record = Record::default();
    let noted = record.clone();
    let txt = unpaced().on_exchange(move |machine| noted.note(machine)).start().unwrap();
    // So long that no guard makes the hook miss its turn, however late its thread runs on.
    let handler = handler_for(&txt).reaction_window(DEADLINE).watchdog(DEADLINE).build().unwrap();
    let area = handler.areas().clone();
    let mut calls = 0;
    handler
        .set_cycle_hook(move |areas| {
            let areas = areas.unwrap();
            calls += 1;
            areas[LOCAL_IO].output.duty[0] = 512;
            if calls >= 20 {
                areas[LOCAL_IO].output.duty[0] = 99;
                areas[LOCAL_IO].config.motor[0] = 99;
                areas[LOCAL_IO].raise_config_id();
                panic!("a hook with a mistake");
            }
            Continue(())
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    // Other threads lock the areas while it ends.
    while area.wait_cycle().is_ok() {}
    assert_eq!(handler.areas().error(), Some(Error::ProgramPanicked));
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
    assert_eq!(record.outputs().len(), 21);
    assert!(record.outputs().iter().all(|outputs| outputs.duty[0] != 99));
    assert_eq!(record.last().duty, [0; 8]);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config.motor[0]), 1);
    // The hook is still set, and still panics.
    handler.begin_transfer().unwrap();
    while area.wait_cycle().is_ok() {}
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
    handler.clear_cycle_hook();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 100;
    wait_until(&txt, "a duty", |machine| machine.controllers[0].outputs.duty[0] == 100);
    handler.end_transfer().unwrap();
}

#[test]
fn calls_are_left_out_while_another_thread_has_a_guard() {
    let (txt, _) = examiner();
    for window in [Duration::ZERO, Duration::from_millis(2)] {
        let handler = build(&txt, window);
        let calls = Arc::new(AtomicU64::new(0));
        handler.set_cycle_hook(count(&calls)).unwrap();
        handler.begin_transfer().unwrap();
        wait_for_calls(&calls, 3);
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].output.duty[4] = 44;
        let before = calls.load(Ordering::Relaxed);
        let begin = txt.with_machine(|machine| machine.exchanges());
        wait_until(&txt, "exchanges", |machine| machine.exchanges() > begin + 10);
        assert_eq!(calls.load(Ordering::Relaxed), before);
        assert_eq!(duties(&txt)[4], 0);
        drop(areas);
        wait_for_calls(&calls, 3);
        wait_until(&txt, "the duty", |machine| machine.controllers[0].outputs.duty[4] == 44);
        handler.end_transfer().unwrap();
    }
}

#[test]
fn it_waits_within_the_window_for_a_guard_to_be_dropped() {
    let (txt, answers) = examiner();
    let handler = build(&txt, DEADLINE);
    handler.set_cycle_hook(answer(2)).unwrap();
    let area = handler.areas().clone();
    let areas = area.lock();
    handler.begin_transfer().unwrap();
    wait_until(&txt, "the first exchange", |machine| machine.exchanges() == 1);
    // Enough time for the hook to be called.
    thread::sleep(Duration::from_millis(20));
    drop(areas);
    drop(area.wait_cycle().unwrap());
    wait_until(&txt, "the second exchange", |machine| machine.exchanges() == 2);
    assert_eq!(answers.lock().unwrap()[1], (1, [0, 1]));
    assert_eq!(handler.areas().statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
}

#[test]
fn ending_the_transfer_does_not_wait_for_a_guard_because_of_it() {
    let (txt, _) = examiner();
    let handler = build(&txt, 2 * DEADLINE);
    handler.set_cycle_hook(answer(0)).unwrap();
    let area = handler.areas().clone();
    let areas = area.lock();
    handler.begin_transfer().unwrap();
    wait_until(&txt, "the first exchange", |machine| machine.exchanges() == 1);
    let begin = Instant::now();
    handler.end_transfer().unwrap();
    assert!(begin.elapsed() < DEADLINE);
    drop(areas);
}

#[test]
fn it_can_be_set_replaced_and_cleared_at_any_time() {
    let (txt, _) = examiner();
    let handler = build(&txt, Duration::ZERO);
    handler.begin_transfer().unwrap();
    let first = Arc::new(AtomicU64::new(0));
    let second = Arc::new(AtomicU64::new(0));
    handler.set_cycle_hook(count(&first)).unwrap();
    wait_for_calls(&first, 5);
    // Under a guard, too.
    let areas = handler.areas().lock();
    handler.set_cycle_hook(count(&second)).unwrap();
    drop(areas);
    let called = first.load(Ordering::Relaxed);
    wait_for_calls(&second, 5);
    assert_eq!(first.load(Ordering::Relaxed), called);
    assert_eq!(Arc::strong_count(&first), 1, "a hook that is replaced is dropped");
    handler.clear_cycle_hook();
    let called = second.load(Ordering::Relaxed);
    assert_eq!(Arc::strong_count(&second), 1);
    for _ in 0..5 {
        handler.areas().wait_cycle().unwrap();
    }
    assert_eq!(second.load(Ordering::Relaxed), called);
    handler.end_transfer().unwrap();
}

#[test]
fn what_it_owns_is_dropped_with_the_handler() {
    let (txt, _) = examiner();
    let handler = build(&txt, Duration::ZERO);
    let calls = Arc::new(AtomicU64::new(0));
    let (area, mut counted) = (handler.areas().clone(), count(&calls));
    handler
        .set_cycle_hook(move |areas| {
            let areas = areas.unwrap();
            // The hook may ask for the statistics.
            assert!(area.statistics().cycles > 0);
            counted(Ok(areas))
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    wait_for_calls(&calls, 5);
    let area = handler.areas().clone();
    drop(handler);
    assert_eq!(Arc::strong_count(&calls), 1);
    assert!(area.wait_cycle().is_err());
}

#[test]
fn one_that_does_not_return_stops_the_motors_and_goes_on_when_it_does() {
    let (txt, _) = examiner();
    let handler = handler_for(&txt).build().unwrap();
    let (go_on, gate) = mpsc::channel::<()>();
    let calls = Arc::new(AtomicU64::new(0));
    let mut counted = count(&calls);
    let (noted, reported) = mpsc::channel();
    let set = handler.set_cycle_hook(move |areas| {
        let _ = counted(Err(Error::NotStarted));
        match areas {
            Ok(areas) => {
                areas[LOCAL_IO].output.duty[0] = 99;
                // Until the gate is open.
                let _ = gate.recv();
            }
            Err(error) => noted.send(error).unwrap(),
        }
        Continue(())
    });
    set.unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    let events = handler.areas().events(&[EventKind::WatchdogExpired], 9).unwrap();
    handler.begin_transfer().unwrap();
    wait_for_call(&calls, 1);
    let error = Error::WatchdogExpired { limit: Duration::from_millis(500) };
    // It keeps nobody that waits for a response, replaces it or ends the transfer.
    let waits = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    assert_eq!(waits, error);
    events.recv_timeout(DEADLINE).unwrap();
    wait_until(&txt, "a stop", |machine| machine.controllers[0].outputs.duty == [0; 8]);
    assert_eq!(handler.areas().feed_watchdog(), Ok(()), "the transfer goes on");
    assert_eq!(calls.load(Ordering::Relaxed), 1);
    drop(go_on);
    assert_eq!(reported.recv_timeout(DEADLINE), Ok(error));
    wait_until(&txt, "its answer", |machine| machine.controllers[0].outputs.duty[0] == 99);
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn one_that_hangs_keeps_neither_the_end_nor_another_hook_for_long() {
    let (txt, _) = examiner();
    let handler = handler_for(&txt).build().unwrap();
    let (go_on, gate) = mpsc::channel::<()>();
    let calls = Arc::new(AtomicU64::new(0));
    let mut counted = count(&calls);
    let set = handler.set_cycle_hook(move |_| {
        let _ = counted(Err(Error::NotStarted));
        let _ = gate.recv();
        Continue(())
    });
    set.unwrap();
    handler.begin_transfer().unwrap();
    wait_for_call(&calls, 1);
    let begin = Instant::now();
    handler.clear_cycle_hook();
    assert_eq!(handler.end_transfer(), Ok(()));
    handler.set_cycle_hook(answer(0)).unwrap();
    assert!(begin.elapsed() < DEADLINE / 3, "it waits for a hook that hangs");
    drop(go_on);
    handler.begin_transfer().unwrap();
    (0..5).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    assert_eq!(calls.load(Ordering::Relaxed), 1);
    handler.end_transfer().unwrap();
}

#[test]
fn it_may_end_the_transfer_and_drop_the_handler() {
    let (txt, _) = examiner();
    for drops in [false, true] {
        let handler = Arc::new(Mutex::new(Some(build(&txt, Duration::ZERO))));
        let inside = Arc::clone(&handler);
        let own = handler.lock().unwrap().take().unwrap();
        let area = own.areas().clone();
        own.set_cycle_hook(move |_| {
            let mut handler = inside.lock().unwrap();
            if let Some(handler) = handler.as_ref() {
                assert_eq!(handler.end_transfer(), Ok(()));
            }
            if drops {
                *handler = None;
            }
            Continue(())
        })
        .unwrap();
        own.begin_transfer().unwrap();
        *handler.lock().unwrap() = Some(own);
        while area.wait_cycle().is_ok() {}
        assert_eq!(area.error(), None);
        wait_until(&txt, "the end", |machine| !machine.online());
        assert_eq!(handler.lock().unwrap().is_none(), drops);
        // The handler's hook owns a reference to it, so it is cleared.
        let left = handler.lock().unwrap().take();
        if let Some(handler) = left {
            handler.clear_cycle_hook();
        }
    }
    check_client(&txt);
}

#[test]
fn the_handler_may_be_dropped_with_the_hook_that_owns_it() {
    struct Owned {
        handler: Arc<TransferAreaComHandler>,
        /// Ends when the handler has been dropped.
        _dropped: mpsc::Sender<()>,
    }
    let txt = unpaced().start().unwrap();
    let handler = Arc::new(build(&txt, Duration::ZERO));
    let (dropped, is_dropped) = mpsc::channel();
    let (clear, is_to_clear) = mpsc::channel();
    let owned = Owned { handler: Arc::clone(&handler), _dropped: dropped };
    handler
        .set_cycle_hook(move |_| {
            let owned = &owned;
            if is_to_clear.try_recv().is_ok() {
                owned.handler.clear_cycle_hook();
            }
            Continue(())
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    drop(handler);
    clear.send(()).unwrap();
    let waited = is_dropped.recv_timeout(DEADLINE / 3);
    assert_eq!(waited, Err(mpsc::RecvTimeoutError::Disconnected), "it hangs");
    wait_until(&txt, "the end", |machine| !machine.connected());
}

#[test]
fn a_panic_in_the_drop_of_its_captured_values_stops_the_motors() {
    struct Panics;
    impl Drop for Panics {
        fn drop(&mut self) {
            panic!("in the drop of a hook's value");
        }
    }
    let txt = unpaced().start().unwrap();
    let handler = Arc::new(build(&txt, Duration::ZERO));
    let (own, owned) = (Arc::downgrade(&handler), Panics);
    handler
        .set_cycle_hook(move |_| {
            let _owned = &owned;
            own.upgrade().unwrap().set_cycle_hook(|_| Continue(())).unwrap();
            Continue(())
        })
        .unwrap();
    handler.begin_transfer().unwrap();
    let error = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    assert_eq!(error, Error::ProgramPanicked);
    wait_until(&txt, "the end", |machine| !machine.connected());
}
