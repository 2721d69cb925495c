//! Lock-step: the machine's time moves only when the program waits for it.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::channel::RecvTimeoutError;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Direction, Input, Motor};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{
    CameraOptions, Error, Event, EventKind, TransferAreaComHandler, TransferAreas,
};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt, SimulatedTxtBuilder};

use crate::support::{check_client, handler_for, unpaced, Record, DEADLINE};

const CYCLE: Duration = Duration::from_millis(10);

fn machine() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().lock_step()
}

fn handler(txt: &SimulatedTxt) -> TransferAreaComHandler {
    handler_for(txt).lock_step().build().unwrap()
}

/// A slide between two switches, with a motor that has a mass.
fn slide() -> World {
    let world = "
        [master.inputs]
        I1 = { switch = {} }
        I2 = { switch = {} }

        [master.motors.M1]
        pulses_per_turn = 63.3
        top_speed = 3
        time_constant = 0.05
        load = 0.1

        [master.motors.M1.slide]
        travel = { pulses = 60 }
        position = 30
        start_switch = 'I1'
        end_switch = 'I2'
    ";
    World::from_toml(world).unwrap()
}

/// All that a program can see: the response, its time, all inputs, outputs and timers.
fn seen(handler: &TransferAreaComHandler, begin: Instant, trace: &mut Vec<String>) {
    let areas = handler.areas().lock();
    let master = &areas[LOCAL_IO];
    trace.push(format!(
        "{} {:?} {:?} {:?} {:?}",
        areas.cycle(),
        areas.arrived() - begin,
        master.input,
        master.output,
        master.timer
    ));
}

/// Runs a program with all kinds of waits on a machine with a slide; returns its trace and the machine's.
fn run() -> (Vec<String>, Vec<String>) {
    let record = Record::default();
    let noted = record.clone();
    let txt = machine().world(slide()).on_exchange(move |machine| noted.note(machine));
    let txt = txt.start().unwrap();
    let handler = handler(&txt);
    let mut trace = Vec::new();
    let mut hooked = 0;
    handler
        .set_cycle_hook(move |areas| {
            let areas = areas.unwrap();
            hooked += 1;
            areas[LOCAL_IO].output.duty[7] = hooked % 100;
            ControlFlow::Continue(())
        })
        .unwrap();
    let events = handler.areas().events(EventKind::ALL, 10_000).unwrap();
    handler.begin_transfer().unwrap();
    let begin = handler.areas().lock().arrived();
    seen(&handler, begin, &mut trace);
    let mut last = begin;
    for (duty, end) in [(512, 1), (-300, 0), (400, 1)] {
        let pins = if duty > 0 { [duty, 0] } else { [0, -duty] };
        handler.areas().lock()[LOCAL_IO].output.duty[..2].copy_from_slice(&pins);
        for _ in 0..1000 {
            let areas = handler.areas().wait_cycle().unwrap();
            let dt = areas.arrived() - last;
            last = areas.arrived();
            let is_there = areas[LOCAL_IO].input.uni[end] != 0;
            drop(areas);
            trace.push(format!("{dt:?}"));
            seen(&handler, begin, &mut trace);
            if is_there {
                break;
            }
        }
    }
    handler.areas().lock()[LOCAL_IO]
        .start_motor_ex_cmd(Motor::M1, 512, Direction::Ccw, &[], 20)
        .unwrap();
    drop(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, Duration::from_secs(3)).unwrap());
    seen(&handler, begin, &mut trace);
    let never = handler.areas().wait_input_change(LOCAL_IO, Input::I7, Duration::from_millis(500));
    trace.push(format!("{never:?}"));
    drop(never);
    seen(&handler, begin, &mut trace);
    trace.push(format!("{:?}", handler.areas().statistics()));
    handler.end_transfer().unwrap();
    trace.push(format!("{:?}", handler.areas().statistics()));
    for reported in events.receiver().try_iter() {
        trace.push(format!(
            "{} {:?} {:?}",
            reported.cycle,
            reported.arrived - begin,
            reported.event
        ));
    }
    check_client(&txt);
    (trace, record.outputs().iter().map(|outputs| format!("{outputs:?}")).collect())
}

#[test]
fn a_program_sees_and_does_the_same_in_each_run_while_other_threads_work() {
    let (done, quiet) = (AtomicBool::new(false), run());
    assert!(quiet.0.len() > 100 && quiet.1.len() > 50);
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    std::hint::spin_loop()
                }
            });
        }
        let runs: Vec<_> = (0..5).map(|_| run()).collect();
        done.store(true, Ordering::Relaxed);
        for (trace, requests) in runs {
            assert_eq!(trace, quiet.0);
            assert_eq!(requests, quiet.1);
        }
    });
}

#[test]
fn time_moves_only_while_the_program_waits() {
    let txt = machine().start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    let exchanges = || txt.with_machine(|machine| machine.exchanges());
    for cycle in 0..20 {
        thread::sleep(Duration::from_millis(2));
        for _ in 0..100 {
            assert_eq!(handler.areas().lock().cycle(), cycle);
        }
        assert_eq!(exchanges(), cycle);
        assert_eq!(handler.areas().lock()[LOCAL_IO].timer.timer_1ms, 10 * cycle as u16);
        let areas = handler.areas().wait_cycle().unwrap();
        assert_eq!(areas.cycle(), cycle + 1);
        thread::sleep(Duration::from_millis(2));
        assert_eq!(exchanges(), cycle + 1, "time moved while a guard was held");
    }
    let statistics = handler.areas().statistics();
    assert_eq!((statistics.late_reactions, statistics.longest_cycle), (0, CYCLE));
    handler.end_transfer().unwrap();
}

#[test]
fn a_request_has_all_that_was_written_before_the_wait() {
    let record = Record::default();
    let noted = record.clone();
    let txt = machine().on_exchange(move |machine| noted.note(machine)).start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    for number in 1..=100 {
        // Written in several pieces, for the first request of the transfer too.
        for pin in 0..8 {
            handler.areas().lock()[LOCAL_IO].output.duty[pin] = number;
        }
        drop(handler.areas().wait_cycle().unwrap());
        assert_eq!(record.last().duty, [number; 8]);
        assert_eq!(record.outputs().len(), number as usize);
    }
    handler.end_transfer().unwrap();
    assert_eq!(record.outputs().len(), 101, "the last one stops the motors");
}

#[test]
fn limits_count_the_machines_time() {
    let txt = machine().start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    let hour = Duration::from_secs(3600);
    for (limit, cycles) in [(Duration::ZERO, 1), (CYCLE / 2, 1), (CYCLE, 1), (10 * CYCLE, 10)] {
        drop(handler.areas().wait_cycle().unwrap());
        let before = handler.areas().lock().cycle();
        let error = handler.areas().wait_until(|_| false, limit).unwrap_err();
        assert_eq!(error, Error::WaitTimedOut { limit });
        assert_eq!(handler.areas().lock().cycle() - before, cycles, "{limit:?}");
    }
    // A limit shorter than a cycle ends before the response, which the next wait gets.
    drop(handler.areas().wait_cycle().unwrap());
    let limit = CYCLE / 2;
    let error = handler.areas().wait_cycle_for(limit).unwrap_err();
    assert_eq!(error, Error::WaitTimedOut { limit });
    let cycle = handler.areas().lock().cycle();
    assert_eq!(handler.areas().wait_cycle_for(limit).unwrap().cycle(), cycle);
    assert_eq!(handler.areas().wait_cycle_for(CYCLE).unwrap().cycle(), cycle + 1);
    // An hour of machine time does not take an hour.
    let begin = handler.areas().lock().arrived();
    let minute = |areas: &[ft_transfer_area::FishX1Transfer]| areas[LOCAL_IO].timer.timer_1s >= 60;
    let areas = handler.areas().wait_until(minute, hour).unwrap();
    assert!(areas.arrived() - begin > Duration::from_secs(59));
    drop(areas);
    handler.end_transfer().unwrap();
}

#[test]
fn a_wait_for_events_moves_the_time_and_gets_them_in_their_cycle() {
    let txt = machine().on_exchange(|machine| {
        machine.controllers[0].uni[0] = i16::from(machine.exchanges() / 7 % 2 == 1);
    });
    let txt = txt.start().unwrap();
    let handler = handler(&txt);
    let mut events = handler.areas().events(&[EventKind::InputChanged], 10).unwrap();
    handler.begin_transfer().unwrap();
    let cycles: Vec<u64> = events.by_ref().take(20).map(|reported| reported.cycle).collect();
    assert!(cycles.windows(2).all(|pair| pair[1] - pair[0] == 7), "{cycles:?}");
    assert_eq!(handler.areas().lock().cycle(), cycles[19], "time moved on after the event");
    assert_eq!(events.recv_timeout(3 * CYCLE), Err(RecvTimeoutError::Timeout));
    let reported = events.recv_timeout(Duration::from_secs(3600)).unwrap();
    assert!(matches!(reported.event, Event::InputChanged { area: LOCAL_IO, .. }));
    handler.end_transfer().unwrap();
}

#[test]
fn a_wait_for_events_before_the_transfer_begins_moves_its_time_too() {
    let txt = machine().on_exchange(|machine| {
        machine.controllers[0].uni[0] = i16::from(machine.exchanges() > 30);
    });
    let txt = txt.start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(&[EventKind::InputChanged], 10).unwrap();
    thread::scope(|scope| {
        let listens = scope.spawn(|| events.recv());
        handler.begin_transfer().unwrap();
        let reported = listens.join().unwrap().unwrap();
        assert!(matches!(reported.event, Event::InputChanged { input: Input::I1, .. }));
    });
    handler.end_transfer().unwrap();
}

/// Ends a transfer in lock-step while a thread waits for responses; returns the thread's error.
fn with_waiting_thread(end: impl FnOnce(&TransferAreaComHandler, &TransferAreas)) -> Error {
    let txt = machine().start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    let area = handler.areas().clone();
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        let theirs = handler.areas().clone();
        scope.spawn(move || loop {
            match theirs.wait_cycle() {
                Ok(areas) if areas.cycle() == 5 => sender.send(Ok(())).unwrap(),
                Ok(_) => {}
                Err(error) => return sender.send(Err(error)).unwrap(),
            }
        });
        receiver.recv_timeout(DEADLINE).unwrap().unwrap();
        end(&handler, &area);
        receiver.recv_timeout(DEADLINE).unwrap().unwrap_err()
    })
}

#[test]
fn a_waiting_thread_gets_the_end_immediately() {
    let asked = with_waiting_thread(|handler, _| handler.end_transfer().unwrap());
    assert_eq!(asked, Error::NotStarted);
    let under_guard = with_waiting_thread(|handler, area| {
        let guard = area.lock();
        thread::scope(|scope| {
            scope.spawn(|| handler.end_transfer().unwrap());
            while handler.areas().is_running() {
                thread::yield_now();
            }
        });
        drop(guard);
    });
    assert_eq!(under_guard, Error::NotStarted);
    let panicked = with_waiting_thread(|_, area| {
        let area = area.clone();
        let panics = thread::spawn(move || {
            let _guard = area.lock();
            panic!("on purpose");
        });
        panics.join().unwrap_err();
    });
    assert_eq!(panicked, Error::ProgramPanicked);
}

#[test]
fn a_transfer_that_never_waited_ends_and_its_handler_can_be_dropped() {
    let txt = machine().start().unwrap();
    let handler = handler(&txt);
    for _ in 0..3 {
        handler.begin_transfer().unwrap();
        handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
        handler.end_transfer().unwrap();
    }
    assert_eq!(txt.with_machine(|machine| machine.exchanges()), 3, "the last exchanges");
    handler.begin_transfer().unwrap();
    drop(handler);
    check_client(&txt);
}

#[test]
fn the_camera_can_be_started_without_moving_the_time() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).camera_port(txt.camera_port()).lock_step().build().unwrap();
    handler.begin_transfer().unwrap();
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    assert_eq!(handler.areas().lock().cycle(), 0);
    frames.recv_timeout(DEADLINE).unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    handler.stop_camera().unwrap();
    assert_eq!(handler.areas().lock().cycle(), 1);
    handler.end_transfer().unwrap();
}

#[test]
fn a_stop_does_not_wait_for_the_pause_before_the_camera() {
    let txt = machine().start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 512;
    drop(handler.areas().wait_cycle().unwrap());
    thread::scope(|scope| {
        scope.spawn(|| handler.start_camera(CameraOptions::default()).map(drop));
        let is_stopped = |machine: &Machine| {
            machine.commands().any(|command| command == CommandId::StopCameraOnline)
        };
        assert!(txt.wait_until(is_stopped, DEADLINE));
        // The camera is not started yet.
        handler.end_transfer().unwrap();
    });
    let starts = |machine: &mut Machine| {
        machine.commands().filter(|command| *command == CommandId::StartCameraOnline).count()
    };
    assert_eq!(txt.with_machine(starts), 0, "the end has waited for it");
    assert_eq!(txt.with_machine(|machine| machine.controllers[LOCAL_IO].outputs.duty), [0; 8]);
}

#[test]
fn after_a_gap_threads_that_wait_for_the_camera_hold_nobody_back() {
    let txt = machine().fault(Fault::at_response(5, FaultKind::Close { after: 0 }));
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).camera_port(txt.camera_port()).lock_step().reconnect(DEADLINE);
    let handler = handler.build().unwrap();
    let events = handler.areas().events(&[EventKind::ConnectionLost], 1).unwrap();
    handler.begin_transfer().unwrap();
    while handler.areas().wait_cycle().is_ok() {}
    assert_eq!(events.receiver().len(), 1);
    let areas = handler.areas().lock();
    let (sender, done) = mpsc::channel();
    let handler = &handler;
    let started = thread::scope(|scope| {
        let starts = scope.spawn(|| handler.start_camera(CameraOptions::default()).map(drop));
        // Long enough for the first request, if it did not wait for this guard.
        thread::sleep(Duration::from_millis(50));
        assert!(!starts.is_finished(), "a request has left while a thread had the areas");
        let guard = scope.spawn(move || {
            let in_time = done.recv_timeout(DEADLINE).is_ok();
            // Ends what waits without an end.
            handler.end_transfer().unwrap();
            in_time
        });
        handler.stop_camera().unwrap();
        drop(areas);
        let started = starts.join().unwrap();
        // Too late if the guard has ended the transfer.
        let _ = sender.send(());
        assert!(guard.join().unwrap(), "both threads wait for each other");
        started
    });
    started.unwrap();
}

#[test]
fn a_gap_is_the_same_in_each_run() {
    let run = || {
        let fault = Fault::at_response(20, FaultKind::Close { after: 0 });
        let record = Record::default();
        let noted = record.clone();
        let txt = machine().fault(fault).on_exchange(move |machine| noted.note(machine));
        let txt = txt.start().unwrap();
        let handler = handler_for(&txt).lock_step().reconnect(DEADLINE).build().unwrap();
        let events = handler.areas().events(EventKind::ALL, 100).unwrap();
        handler.begin_transfer().unwrap();
        let begin = handler.areas().lock().arrived();
        let mut trace = Vec::new();
        for number in 1..60 {
            handler.areas().lock()[LOCAL_IO].output.duty[0] = number;
            match handler.areas().wait_cycle() {
                Ok(areas) => trace.push(format!("{} {:?}", areas.cycle(), areas.arrived() - begin)),
                Err(error) => trace.push(format!("{error:?}")),
            }
        }
        handler.end_transfer().unwrap();
        for reported in events.receiver().try_iter() {
            let event = format!("{:?}", reported.event).replace(&txt.address().to_string(), "TXT");
            trace.push(format!("{:?} {event}", reported.arrived - begin));
        }
        (trace, record.outputs().iter().map(|outputs| outputs.duty[0]).collect::<Vec<_>>())
    };
    let first = run();
    assert!(first.0.iter().any(|line| line.contains("ConnectionRestored")), "{:?}", first.0);
    for _ in 0..5 {
        assert_eq!(run(), first);
    }
}
