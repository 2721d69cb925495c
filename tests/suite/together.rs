//! Where two parts meet: the cycle hook and the watchdog, an end or a gap; commands and stops.

use std::ops::ControlFlow::Continue;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{mpsc, Arc};
use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Counter, Direction, Motor, Sound};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{CameraOptions, Error, Event, EventKind, TransferAreaComHandler};
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt};

use crate::support::{handler_for, unpaced, wait_until, Record, DEADLINE};

const LIMIT: Duration = Duration::from_millis(250);

const CLOSE: FaultKind = FaultKind::Close { after: 0 };

#[derive(Debug, PartialEq)]
enum Call {
    Response,
    Reported(Error),
}

/// A simulated TXT that records its requests.
fn recorded() -> (SimulatedTxt, Record) {
    let record = Record::default();
    let noted = record.clone();
    (unpaced().on_exchange(move |machine| noted.note(machine)).start().unwrap(), record)
}

#[test]
fn a_slow_hook_is_told_that_the_watchdog_has_stopped_the_outputs_each_time() {
    let (txt, record) = recorded();
    let builder = handler_for(&txt).watchdog(LIMIT);
    let handler = builder.build().unwrap();
    let events = handler.areas().events(&[EventKind::WatchdogExpired], 9).unwrap();
    let (calls, called) = mpsc::channel();
    let (slow, is_slow) = mpsc::channel::<()>();
    let set = handler.set_cycle_hook(move |areas| {
        match areas {
            Err(error) => calls.send(Call::Reported(error)).unwrap(),
            Ok(areas) => {
                areas[LOCAL_IO].output.duty[0] = 300;
                calls.send(Call::Response).unwrap();
                // Until the test lets it go on.
                let _ = is_slow.recv();
            }
        }
        Continue(())
    });
    set.unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..2 {
        assert_eq!(called.recv_timeout(DEADLINE), Ok(Call::Response));
        let expired = events.recv_timeout(DEADLINE).unwrap().event;
        assert!(matches!(expired, Event::WatchdogExpired { limit: LIMIT, .. }));
        let begin = record.outputs().len();
        wait_until(&txt, "requests", |_| record.outputs().len() > begin + 20);
        assert!(record.outputs()[begin + 1..].iter().all(|outputs| outputs.duty[0] == 0));
        slow.send(()).unwrap();
        // It has called for no response between.
        let reported = Call::Reported(Error::WatchdogExpired { limit: LIMIT });
        assert_eq!(called.recv_timeout(DEADLINE), Ok(reported));
        // What it writes then counts again.
        assert_eq!(called.recv_timeout(DEADLINE), Ok(Call::Response));
        slow.send(()).unwrap();
        wait_until(&txt, "the duty", |machine| machine.controllers[0].outputs.duty[0] == 300);
    }
    drop(slow);
    handler.end_transfer().unwrap();
}

#[test]
fn the_end_does_not_wait_for_a_hook_that_hangs() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    let (go_on, gate) = mpsc::channel::<()>();
    let (hung, is_hung) = mpsc::channel();
    let set = handler.set_cycle_hook(move |areas| {
        areas.unwrap()[LOCAL_IO].output.duty[0] = 99;
        let _ = hung.send(());
        let _ = gate.recv();
        Continue(())
    });
    set.unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 300;
    handler.begin_transfer().unwrap();
    is_hung.recv_timeout(DEADLINE).unwrap();
    // The limit of the hook is so long that waiting for it would be noticed.
    let (ended, has_ended) = mpsc::channel();
    thread::scope(|scope| {
        scope.spawn(|| ended.send(handler.end_transfer()));
        assert_eq!(has_ended.recv_timeout(DEADLINE / 3), Ok(Ok(())));
        assert_eq!(record.last().duty, [0; 8]);
        drop(go_on);
    });
    // What it wrote goes nowhere.
    assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty, [0; 8]);
}

#[test]
fn a_hook_learns_of_a_gap_and_is_called_for_the_first_response_after_it() {
    let txt = unpaced().fault(Fault::at_exchange(20, CLOSE)).start().unwrap();
    let builder = handler_for(&txt).reconnect(DEADLINE).reaction_window(DEADLINE);
    let handler = builder.build().unwrap();
    let (calls, called) = mpsc::channel();
    let set = handler.set_cycle_hook(move |areas| {
        let call = match areas {
            Ok(areas) => Ok(areas.cycle()),
            Err(error) => Err(error),
        };
        calls.send(call).unwrap();
        Continue(())
    });
    set.unwrap();
    handler.begin_transfer().unwrap();
    let mut gaps = 0;
    for _ in 0..40 {
        match handler.areas().wait_cycle() {
            Ok(_) => {}
            Err(Error::ConnectionLost { .. }) => gaps += 1,
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(gaps, 1);
    let mut cycle = 0;
    let mut reported = 0;
    while cycle < 39 {
        match called.recv_timeout(DEADLINE).unwrap() {
            Ok(of) => {
                assert_eq!(of, cycle + 1, "each response once");
                cycle = of;
            }
            Err(error) => {
                assert!(matches!(error, Error::ConnectionLost { .. }), "{error}");
                assert_eq!(cycle, 20, "before the first response of the new connection");
                reported += 1;
            }
        }
    }
    assert_eq!(reported, 1);
    handler.end_transfer().unwrap();
}

#[test]
fn commands_that_a_gap_refuses_are_never_reported_as_done() {
    let txt = unpaced().fault(Fault::at_exchange(20, CLOSE)).start().unwrap();
    let handler = handler_for(&txt).reconnect(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    let mut areas = handler.areas().lock();
    let master = &mut areas[LOCAL_IO];
    master.start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 3000).unwrap();
    master.start_counter_reset(Counter::C4);
    master.set_sound(Sound::Alarm, 1).unwrap();
    master.raise_sound_cmd_id();
    // The connection is lost and re-established while the guard is held.
    wait_until(&txt, "a gap", |machine| machine.exchanges() > 30);
    drop(areas);
    assert!(matches!(handler.areas().feed_watchdog(), Err(Error::ConnectionLost { .. })));
    let never = Err(Error::WaitTimedOut { limit: LIMIT });
    assert_eq!(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, LIMIT).map(drop), never);
    assert_eq!(handler.areas().wait_counter_reset(LOCAL_IO, Counter::C4, LIMIT).map(drop), never);
    assert_eq!(handler.areas().wait_sound(LOCAL_IO, LIMIT).map(drop), never);
    // New ones are.
    let mut areas = handler.areas().lock();
    let master = &mut areas[LOCAL_IO];
    master.start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 20).unwrap();
    master.start_counter_reset(Counter::C4);
    drop(areas);
    drop(handler.areas().wait_counter_reset(LOCAL_IO, Counter::C4, DEADLINE).unwrap());
    drop(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, DEADLINE).unwrap());
    handler.end_transfer().unwrap();
}

#[test]
fn in_lock_step_a_connection_that_is_lost_again_after_its_first_exchange_is_another_gap() {
    for with_hook in [false, true] {
        // QueryStatus, StartOnline, UpdateConfig, StartCameraOnline, six exchanges; on the next connection
        // the first three, an exchange, and StartCameraOnline.
        let txt = unpaced().lock_step().fault(Fault::at_response(10, CLOSE));
        let txt = txt.fault(Fault::at_response(15, CLOSE)).start().unwrap();
        let builder = handler_for(&txt).camera_port(txt.camera_port()).lock_step();
        let handler = builder.reconnect(DEADLINE).build().unwrap();
        let events = handler.areas().events(EventKind::ALL, 1000).unwrap();
        handler.begin_transfer().unwrap();
        let frames = handler.start_camera(CameraOptions::default()).unwrap();
        if with_hook {
            handler.set_cycle_hook(|_| Continue(())).unwrap();
        }
        let mut gaps = 0;
        while handler.areas().statistics().cycles < 20 {
            match handler.areas().wait_cycle_for(DEADLINE) {
                Ok(_) => {}
                Err(Error::ConnectionLost { .. }) => gaps += 1,
                Err(error) => panic!("{error}"),
            }
        }
        assert_eq!((gaps, handler.areas().statistics().gaps), (2, 2));
        handler.end_transfer().unwrap();
        drop((frames, events));
    }
}

#[test]
fn in_lock_step_a_camera_that_is_started_in_a_gap_waits_for_who_has_the_areas() {
    let txt = unpaced().lock_step().start().unwrap();
    let builder = handler_for(&txt).camera_port(txt.camera_port()).lock_step();
    let handler = builder.reconnect(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    txt.with_machine(|machine| machine.disturb(FaultKind::Close { after: 0 }));
    let areas = handler.areas().lock();
    thread::scope(|scope| {
        // Its first command finds that the connection is lost.
        let start = scope.spawn(|| handler.start_camera(CameraOptions::default()));
        let is_ready = |machine: &Machine| {
            let configs = machine.commands().filter(|id| *id == CommandId::UpdateConfig);
            machine.connections() == 2 && configs.count() == 2
        };
        wait_until(&txt, "another connection", is_ready);
        thread::sleep(Duration::from_millis(50));
        assert_eq!(txt.with_machine(|machine| machine.exchanges()), 1);
        drop(areas);
        start.join().unwrap().unwrap();
    });
    assert_eq!(txt.with_machine(|machine| machine.exchanges()), 2);
    handler.end_transfer().unwrap();
}

#[test]
fn in_lock_step_the_camera_can_be_started_and_stopped_under_a_guard_and_in_a_hook() {
    let txt = unpaced().lock_step().start().unwrap();
    let builder = handler_for(&txt).camera_port(txt.camera_port()).lock_step();
    let handler = Arc::new(builder.build().unwrap());
    let in_hook = Arc::downgrade(&handler);
    let mut calls = 0;
    let set = handler.set_cycle_hook(move |_| {
        calls += 1;
        if let (5, Some(handler)) = (calls, in_hook.upgrade()) {
            drop(handler.start_camera(CameraOptions::default()).unwrap());
            handler.stop_camera().unwrap();
        }
        Continue(())
    });
    set.unwrap();
    handler.begin_transfer().unwrap();
    let area = handler.areas().clone();
    let waits = thread::spawn(move || while area.wait_cycle().is_ok() {});
    wait_until(&txt, "the hook's camera", |machine| machine.exchanges() > 10);
    for _ in 0..5 {
        let areas = handler.areas().lock();
        drop(handler.start_camera(CameraOptions::default()).unwrap());
        handler.stop_camera().unwrap();
        drop(areas);
        drop(handler.areas().wait_cycle().unwrap());
    }
    handler.end_transfer().unwrap();
    waits.join().unwrap();
}

#[test]
fn a_program_that_polls_too_late_can_read_how_many_responses_it_has_missed() {
    let txt = unpaced().start().unwrap();
    let late = |handler: &TransferAreaComHandler| {
        let before = handler.areas().statistics().missed_responses;
        let areas = handler.areas().lock();
        let begin = txt.with_machine(|machine| machine.exchanges());
        wait_until(&txt, "requests", |machine| machine.exchanges() > begin + 10);
        drop(areas);
        handler.areas().statistics().missed_responses - before
    };
    let handler = handler_for(&txt).reaction_window(Duration::from_millis(2)).build().unwrap();
    handler.begin_transfer().unwrap();
    assert!(late(&handler) >= 9);
    handler.end_transfer().unwrap();
    // A window that does not end before the program has answered.
    let handler = handler_for(&txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..20 {
        drop(handler.areas().wait_cycle().unwrap());
    }
    assert_eq!(handler.areas().statistics().missed_responses, 0);
    handler.end_transfer().unwrap();
}

#[test]
fn threads_that_set_and_clear_hooks_at_the_same_time_do_not_wait_for_each_others_hooks() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    let (done, is_done) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..4 {
            let (handler, done) = (&handler, done.clone());
            scope.spawn(move || {
                for _ in 0..50 {
                    handler.set_cycle_hook(|_| Continue(())).unwrap();
                }
                done.send(()).unwrap();
            });
        }
        for _ in 0..4 {
            is_done.recv_timeout(DEADLINE).expect("it waits for another thread's hook");
        }
    });
    handler.end_transfer().unwrap();
}

#[test]
fn a_hook_that_panics_ends_only_its_own_transfer() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let panics = Arc::new(AtomicBool::new(true));
    let in_hook = Arc::clone(&panics);
    let set = handler.set_cycle_hook(move |_| {
        assert!(!in_hook.swap(false, Ordering::Relaxed), "on purpose");
        Continue(())
    });
    set.unwrap();
    for _ in 0..100 {
        panics.store(true, Ordering::Relaxed);
        handler.begin_transfer().unwrap();
        while handler.areas().wait_cycle().is_ok() {}
        assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
        // At once, while the hook's thread still unwinds.
        handler.begin_transfer().unwrap();
        for _ in 0..5 {
            drop(handler.areas().wait_cycle().unwrap());
        }
        handler.end_transfer().unwrap();
    }
}

#[test]
fn a_hook_that_panics_when_it_is_told_of_a_gap_ends_the_transfer_and_stays_set() {
    let record = Record::default();
    let noted = record.clone();
    let txt = unpaced().fault(Fault::at_exchange(20, CLOSE));
    let txt = txt.on_exchange(move |machine| noted.note(machine)).start().unwrap();
    let builder = handler_for(&txt).reconnect(DEADLINE).watchdog(DEADLINE);
    let handler = builder.build().unwrap();
    let events = handler.areas().events(&[EventKind::TransferEnded], 9).unwrap();
    let set = handler.set_cycle_hook(|areas| {
        areas.expect("on purpose")[LOCAL_IO].output.duty[0] = 300;
        Continue(())
    });
    set.unwrap();
    handler.begin_transfer().unwrap();
    let ended = events.recv_timeout(DEADLINE).expect("the panic is lost").event;
    let panicked = Some(Error::ProgramPanicked);
    assert!(matches!(ended, Event::TransferEnded { error, .. } if error == panicked));
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
    let after_gap = |duty: i16| record.outputs().iter().skip(21).any(|sent| sent.duty[0] == duty);
    assert!(!after_gap(300));
    // It is called in the next transfer, too.
    handler.begin_transfer().unwrap();
    wait_until(&txt, "its answer", |_| after_gap(300));
    handler.end_transfer().unwrap();
}
