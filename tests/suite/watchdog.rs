//! The motors of a program that hangs are stopped, and the program can go on afterwards.

use std::env;
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::tx::{Direction, Motor};
use ft_transfer_area::{Error, Event, EventKind, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::support::{check_client, handler_for, unpaced, wait_until, Record, DEADLINE};

/// Short enough for a test to wait for, and long enough that a program on a busy machine does not seem to
/// hang.
const LIMIT: Duration = Duration::from_secs(1);

const EXPIRED: Error = Error::WatchdogExpired { limit: LIMIT };

struct Watched {
    txt: SimulatedTxt,
    record: Record,
    handler: TransferAreaComHandler,
}

impl Watched {
    /// A transfer with running motors, and a program that does nothing from now on.
    fn start() -> Self {
        Self::start_with(|_| ())
    }

    /// The same, after a step that needs the handler before the transfer begins.
    fn start_with(prepare: impl FnOnce(&TransferAreaComHandler)) -> Self {
        let record = Record::default();
        let noted = record.clone();
        let txt = unpaced().extensions(1).on_exchange(move |machine| noted.note(machine));
        let txt = txt.start().unwrap();
        let handler = handler_for(&txt).areas(2).watchdog(LIMIT).build().unwrap();
        prepare(&handler);
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 60_000).unwrap();
        areas[REMOTE_IO_1].output.duty[7] = 512;
        drop(areas);
        handler.begin_transfer().unwrap();
        Self { txt, record, handler }
    }

    /// Waits until the motors were running and are stopped.
    fn wait_until_stopped(&self) {
        let is_stopped = |outputs: &ft_transfer_area::wire::ExchangeData| {
            outputs.duty == [0; 8] && outputs.distance == [0; 4]
        };
        wait_until(&self.txt, "running motors", |_| {
            self.record.outputs().iter().any(|outputs| !is_stopped(outputs))
        });
        wait_until(&self.txt, "stopped motors", |machine| {
            let stopped = [0, 1].map(|index| is_stopped(&machine.controllers[index].outputs));
            stopped == [true; 2]
        });
    }

    /// Waits until some more exchanges have taken place, and checks that no motor ran in one of them.
    fn check_still_stopped(&self) {
        let begin = self.record.outputs().len();
        wait_until(&self.txt, "more exchanges", |_| self.record.outputs().len() > begin + 20);
        assert!(self.record.outputs()[begin..].iter().all(|outputs| outputs.duty == [0; 8]));
    }

    fn check_runs_with(&self, duty: i16) {
        wait_until(&self.txt, "a motor that runs again", |machine| {
            machine.controllers[LOCAL_IO].outputs.duty[0] == duty
        });
    }
}

/// The error of the program's next wait, if any.
fn next_error(area: &TransferAreas) -> Option<Error> {
    area.wait_cycle_for(DEADLINE).err()
}

#[test]
fn motors_of_a_program_that_does_nothing_are_stopped_and_it_is_told_once() {
    let watched = Watched::start();
    let area = watched.handler.areas().clone();
    watched.wait_until_stopped();
    watched.check_still_stopped();
    assert_eq!(next_error(&area), Some(EXPIRED));
    assert_eq!(next_error(&area), None, "reported twice");
    area.wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 300;
    watched.check_runs_with(300);
    // Another handle is notified, too; the motors run on.
    assert_eq!(watched.handler.areas().feed_watchdog(), Err(EXPIRED));
    assert_eq!(watched.handler.areas().feed_watchdog(), Ok(()));
    assert_eq!(watched.handler.areas().error(), None);
    watched.handler.end_transfer().unwrap();
    check_client(&watched.txt);
}

#[test]
fn a_guard_that_is_held_for_ever_does_not_keep_the_motors_running() {
    let watched = Watched::start();
    let mut areas = watched.handler.areas().lock();
    areas[LOCAL_IO].output.duty[0] = 77;
    watched.wait_until_stopped();
    drop(areas);
    watched.check_still_stopped();
    assert_eq!(watched.handler.areas().lock()[LOCAL_IO].output.duty[0], 0, "the area shows it");
    watched.handler.end_transfer().unwrap();
}

#[test]
fn a_program_that_polls_without_checking_does_not_switch_them_on_again() {
    let watched = Watched::start();
    watched.wait_until_stopped();
    let begin = watched.record.outputs().len();
    while watched.record.outputs().len() < begin + 20 {
        watched.handler.areas().lock()[LOCAL_IO].output.duty[0] = 400;
        thread::yield_now();
    }
    assert!(watched.record.outputs()[begin..].iter().all(|outputs| outputs.duty == [0; 8]));
    // It checks for errors, and goes on.
    assert_eq!(watched.handler.areas().feed_watchdog(), Err(EXPIRED));
    watched.handler.areas().lock()[LOCAL_IO].output.duty[0] = 400;
    watched.check_runs_with(400);
    watched.handler.end_transfer().unwrap();
}

#[test]
fn two_threads_that_wait_for_each_other_do_not_keep_the_motors_running() {
    let watched = Watched::start();
    let (to_first, from_second) = mpsc::channel::<()>();
    let (to_second, from_first) = mpsc::channel::<()>();
    let (go_on, gate) = (to_first.clone(), to_second.clone());
    let area = watched.handler.areas().clone();
    thread::scope(|scope| {
        scope.spawn(move || {
            let _areas = area.lock();
            let _ = from_second.recv();
            let _ = to_second.send(());
        });
        scope.spawn(move || {
            let _ = from_first.recv();
            let _ = to_first.send(());
        });
        watched.wait_until_stopped();
        // The test is over.
        let _ = (go_on.send(()), gate.send(()));
    });
    watched.handler.end_transfer().unwrap();
}

#[test]
fn motors_of_a_program_whose_thread_is_gone_are_stopped() {
    let watched = Watched::start();
    let handler = std::sync::Arc::new(watched.handler);
    let shared = std::sync::Arc::clone(&handler);
    // A panic between two guards can't be noticed when the handler is shared.
    let panicked = thread::spawn(move || {
        shared.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 512;
        panic!("in the thread that controls the motors");
    });
    panicked.join().unwrap_err();
    let watched = Watched { handler: std::sync::Arc::into_inner(handler).unwrap(), ..watched };
    watched.wait_until_stopped();
    assert_eq!(watched.handler.areas().error(), None);
    watched.handler.end_transfer().unwrap();
}

#[test]
fn listeners_get_an_event_and_a_distance_under_way_is_never_reached() {
    let watched = Watched::start();
    let events = [EventKind::WatchdogExpired, EventKind::MotorReached];
    let events = watched.handler.areas().events(&events, 100).unwrap();
    watched.wait_until_stopped();
    let expired = events.recv_timeout(DEADLINE).unwrap().event;
    assert!(matches!(expired, Event::WatchdogExpired { limit: LIMIT, .. }));
    assert_eq!(watched.handler.areas().feed_watchdog(), Err(EXPIRED));
    for _ in 0..10 {
        let areas = watched.handler.areas().wait_cycle().unwrap();
        assert!(!areas[LOCAL_IO].is_motor_ex_ready(Motor::M1), "it was cut off");
        assert_eq!(areas[LOCAL_IO].input.motor_ex_reached[0], 0);
    }
    assert!(events.receiver().is_empty());
    // A new distance is reached.
    let mut areas = watched.handler.areas().lock();
    areas[LOCAL_IO].start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 20).unwrap();
    drop(areas);
    drop(watched.handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, DEADLINE).unwrap());
    watched.handler.end_transfer().unwrap();
}

#[test]
fn a_program_that_waits_polls_feeds_or_has_a_hook_is_left_alone() {
    let txt = unpaced().start().unwrap();
    let limit = DEADLINE / 2;
    let handler = handler_for(&txt).watchdog(limit).build().unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..20 {
        handler.areas().wait_cycle().unwrap();
        drop(handler.areas().lock());
        handler.areas().feed_watchdog().unwrap();
    }
    handler.end_transfer().unwrap();
    // Without one, a program may sleep while its motor runs.
    let handler = handler_for(&txt).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 100;
    handler.begin_transfer().unwrap();
    thread::sleep(Duration::from_millis(50));
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 100);
    assert_eq!(handler.areas().feed_watchdog(), Ok(()));
    handler.end_transfer().unwrap();
    assert_eq!(handler.areas().feed_watchdog(), Err(Error::NotStarted));
}

#[test]
fn calls_that_only_look_are_no_sign_of_life() {
    let mut events = None;
    let watched = Watched::start_with(|handler| {
        events = Some(handler.areas().events(&[EventKind::WatchdogExpired], 9).unwrap());
    });
    let (handler, events, begin) = (&watched.handler, events.unwrap(), Instant::now());
    let area = handler.areas();
    while events.try_recv().is_err() {
        assert!(area.is_running());
        assert_eq!(area.error(), None);
        let _ = (area.clone().statistics(), handler.version(), handler.device_name());
        assert!(begin.elapsed() < DEADLINE, "it never expires");
        thread::yield_now();
    }
    watched.wait_until_stopped();
    // Nor has the handle learned of it by them.
    assert_eq!(area.feed_watchdog(), Err(EXPIRED));
    handler.end_transfer().unwrap();
}

#[test]
fn it_begins_again_with_each_transfer() {
    let watched = Watched::start();
    watched.wait_until_stopped();
    watched.handler.end_transfer().unwrap();
    watched.handler.begin_transfer().unwrap();
    let mut areas = watched.handler.areas().wait_cycle().expect("of another transfer");
    areas[LOCAL_IO].output.duty[0] = 200;
    drop(areas);
    watched.check_runs_with(200);
    watched.handler.end_transfer().unwrap();
}

#[test]
fn a_program_that_waits_for_a_late_response_is_alive() {
    use ft_transfer_area::TimeLimits;
    use ft_transfer_area_simulator::{Fault, FaultKind};
    let late = || Fault::at_exchange(5, FaultKind::Delay(LIMIT + LIMIT / 2));
    let limits = TimeLimits::default().read(DEADLINE);
    let waits = unpaced().fault(late()).start().unwrap();
    let handler = handler_for(&waits).watchdog(LIMIT).time_limits(limits).build().unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..20 {
        let _areas = handler.areas().wait_cycle().expect("it has waited all the time");
        thread::sleep(Duration::from_millis(10));
    }
    handler.end_transfer().unwrap();

    let calls = unpaced().fault(late()).start().unwrap();
    let handler = handler_for(&calls).watchdog(LIMIT).time_limits(limits).build().unwrap();
    let mut number = 0;
    handler
        .set_cycle_hook(move |_| {
            number += 1;
            thread::sleep(Duration::from_millis(10));
            if number < 20 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        })
        .unwrap();
    let events = handler.areas().events(&[EventKind::WatchdogExpired, EventKind::TransferEnded], 9);
    handler.begin_transfer().unwrap();
    let event = events.unwrap().recv_timeout(DEADLINE).unwrap().event;
    assert!(matches!(event, Event::TransferEnded { error: None, .. }));
}

/// Set for the process whose standard error nobody reads: the address of its controller.
const UNREAD: &str = "WATCHDOG_UNREAD";

/// A panic is printed before the thread unwinds. Until it is, nothing but the watchdog knows of it.
#[test]
fn a_panic_that_nobody_reads_is_a_thread_that_hangs() {
    if let Ok(address) = env::var(UNREAD) {
        return panic_unread(&address);
    }
    let txt = unpaced().start().unwrap();
    let name = "watchdog::a_panic_that_nobody_reads_is_a_thread_that_hangs";
    let mut program = Command::new(env::current_exe().unwrap());
    program.args(["--exact", name, "--nocapture"]).env(UNREAD, txt.address().to_string());
    let mut program = program.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(&txt, "a running motor", |machine| machine.controllers[0].outputs.duty[0] == 512);
    wait_until(&txt, "a stopped motor", |machine| machine.controllers[0].outputs.duty[0] == 0);
    // It is neither the end of the program nor that of the transfer.
    assert!(txt.with_machine(|machine| machine.online()));
    assert!(program.try_wait().unwrap().is_none());
    program.kill().unwrap();
    program.wait().unwrap();
}

fn panic_unread(address: &str) {
    let handler = TransferAreaComHandler::builder(address).watchdog(LIMIT).build().unwrap();
    let (locked, is_locked) = mpsc::channel();
    thread::spawn(move || {
        let mut stderr = io::stderr().lock();
        locked.send(()).unwrap();
        while stderr.write_all(&[b'x'; 4096]).is_ok() {}
    });
    is_locked.recv().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 512;
    panic!("nobody reads this");
}
