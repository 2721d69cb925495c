//! A connection is lost and re-established.

use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::{LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::tx::{Counter, Direction, Motor, Sound};
use ft_transfer_area::{
    CameraOptions, Error, Event, EventKind, FirmwareVersion, TimeLimits, TransferAreaComHandler,
    TransferAreas,
};
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt, SimulatedTxtBuilder};

use crate::support::{
    check_client, handler_for, unpaced, unused_ports, wait_until, Record, DEADLINE,
};

/// The first exchange's response is the fourth of a connection without extensions.
const STRIKES_AT: u64 = 60;

fn handler(txt: &SimulatedTxt) -> TransferAreaComHandler {
    // A gap is noticed within this limit at the latest.
    let limits = TimeLimits::default().read(Duration::from_secs(3));
    handler_for(txt).time_limits(limits).reconnect(DEADLINE).build().unwrap()
}

fn struck_by(kind: FaultKind) -> SimulatedTxtBuilder {
    unpaced().fault(Fault::at_response(STRIKES_AT, kind))
}

/// Waits until the next error.
fn next_error(area: &TransferAreas) -> Error {
    loop {
        if let Err(error) = area.wait_cycle() {
            return error;
        }
    }
}

fn assert_lost(error: &Error) {
    assert!(matches!(error, Error::ConnectionLost { .. }), "{error}");
}

fn master(machine: &Machine) -> [i16; 8] {
    machine.controllers[LOCAL_IO].outputs.duty
}

#[test]
fn every_loss_of_a_connection_is_repaired_and_told_once() {
    let kinds = [
        FaultKind::Close { after: 0 },
        FaultKind::Close { after: 5 },
        FaultKind::WrongCrc,
        FaultKind::WrongId,
        FaultKind::Surplus(3),
        FaultKind::Silence,
    ];
    thread::scope(|scope| {
        for kind in kinds {
            scope.spawn(move || {
                let txt = struck_by(kind).start().unwrap();
                let handler = handler(&txt);
                let (first, second) = (handler.areas().clone(), handler.areas().clone());
                handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
                handler.begin_transfer().unwrap();
                assert_lost(&next_error(&first));
                // The handle works on, and gets no second error.
                for _ in 0..20 {
                    assert_eq!(first.wait_cycle().expect("reported twice")[0].output.duty[0], 0);
                }
                assert_lost(&second.wait_cycle().map(drop).unwrap_err());
                drop(second.wait_cycle().expect("reported twice"));
                assert_eq!((handler.areas().error(), handler.areas().statistics().gaps), (None, 1));
                assert_eq!(txt.with_machine(|machine| machine.connections()), 2, "{kind:?}");
                assert_lost(&handler.areas().feed_watchdog().unwrap_err());
                handler.end_transfer().unwrap();
                check_client(&txt);
            });
        }
    });
}

#[test]
fn outputs_from_before_the_gap_move_nothing_and_outputs_from_after_it_do() {
    let record = Record::default();
    let noted = record.clone();
    let txt = struck_by(FaultKind::Close { after: 5 }).on_exchange(move |m| noted.note(m));
    let txt = txt.start().unwrap();
    let handler = handler(&txt);
    let (area, unaware) = (handler.areas().clone(), handler.areas().clone());
    let events = handler.areas().events(&[EventKind::ConnectionLost], 9).unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    // A program that polls, and does not know of the gap while it lasts.
    let (locked, is_locked) = std::sync::mpsc::channel();
    thread::scope(|scope| {
        let holds = scope.spawn(|| {
            let mut areas = unaware.lock();
            areas[LOCAL_IO].output.duty[0] = 511;
            locked.send(()).unwrap();
            events.recv_timeout(DEADLINE)
        });
        // Not later, because the gap may be over before that thread runs.
        is_locked.recv_timeout(DEADLINE).unwrap();
        handler.begin_transfer().unwrap();
        holds.join().unwrap().unwrap();
    });
    assert_lost(&next_error(&area));
    drop(area.wait_cycle().unwrap());
    let gap = record.outputs().iter().rposition(|outputs| outputs.duty[0] != 0).unwrap();
    area.lock()[LOCAL_IO].output.duty[0] = 300;
    wait_until(&txt, "the new duty", |machine| master(machine)[0] == 300);
    let outputs = record.outputs();
    let between: Vec<i16> = outputs[gap + 1..].iter().map(|outputs| outputs.duty[0]).collect();
    assert!(between.iter().all(|duty| [0, 300].contains(duty)), "{between:?}");
    assert_eq!(between[0], 0, "the first request of the new connection");
    handler.end_transfer().unwrap();
}

#[test]
fn outputs_of_a_program_that_knows_of_the_gap_go_out_with_the_first_request() {
    let first_port = unused_ports();
    let start = || SimulatedTxt::builder().pace(Duration::ZERO).port(first_port);
    let txt = start().start().unwrap();
    let handler = handler(&txt);
    let (area, unaware) = (handler.areas().clone(), handler.areas().clone());
    handler.begin_transfer().unwrap();
    drop(area.wait_cycle().unwrap());
    drop(txt);
    assert_lost(&next_error(&area));
    assert!(area.is_running(), "the connection is re-established");
    unaware.lock()[LOCAL_IO].output.duty[0] = 512;
    area.lock()[LOCAL_IO].output.duty[2] = 222;
    let limit = Duration::from_millis(10);
    let waited = area.wait_cycle_for(limit).map(drop);
    assert_eq!(waited, Err(Error::WaitTimedOut { limit }));
    let record = Record::default();
    let noted = record.clone();
    let txt = start().on_exchange(move |machine| noted.note(machine)).start().unwrap();
    drop(area.wait_cycle().unwrap());
    assert_eq!(record.outputs()[0].duty, [0, 0, 222, 0, 0, 0, 0, 0]);
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn configurations_and_the_extensions_are_there_again() {
    let txt = struck_by(FaultKind::WrongCrc).extensions(1).start().unwrap();
    let handler = handler_for(&txt).areas(2).reconnect(DEADLINE).build().unwrap();
    let area = handler.areas().clone();
    handler.begin_transfer().unwrap();
    let mut areas = area.lock();
    areas[REMOTE_IO_1].config.uni[2].mode = 3;
    areas[REMOTE_IO_1].raise_config_id();
    drop(areas);
    assert_lost(&next_error(&area));
    drop(area.wait_cycle().unwrap());
    assert_eq!(txt.with_machine(|machine| machine.controllers[1].config.uni[2].mode), 3);
    area.lock()[REMOTE_IO_1].output.duty[0] = 99;
    wait_until(&txt, "a duty", |machine| machine.controllers[1].outputs.duty[0] == 99);
    // Two configurations for the first connection, one that changed, two for the second.
    assert_eq!(handler.areas().statistics().config_updates, 5);
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn a_command_that_the_gap_has_stopped_never_reads_as_done() {
    let txt = struck_by(FaultKind::Close { after: 5 }).start().unwrap();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    let kinds = [EventKind::MotorReached, EventKind::CounterReset];
    let events = handler.areas().events(&kinds, 100).unwrap();
    handler.begin_transfer().unwrap();
    let mut areas = area.wait_cycle().unwrap();
    areas[LOCAL_IO].start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 60_000).unwrap();
    areas[LOCAL_IO].set_sound(Sound::Bell, 1000).unwrap();
    drop(areas);
    let error = loop {
        // A command is always under way.
        match area.wait_cycle() {
            Ok(mut areas) => {
                areas[LOCAL_IO].start_counter_reset(Counter::C4);
                while events.receiver().try_recv().is_ok() {}
            }
            Err(error) => break error,
        }
    };
    assert_lost(&error);
    while events.receiver().try_recv().is_ok() {}
    for _ in 0..20 {
        let areas = area.wait_cycle().unwrap();
        assert!(!areas[LOCAL_IO].is_motor_ex_ready(Motor::M1));
        assert!(!areas[LOCAL_IO].is_cnt_reset_ready(Counter::C4));
        assert!(!areas[LOCAL_IO].is_sound_ready());
        assert_eq!(areas[LOCAL_IO].input.motor_ex_reached[0], 0);
        assert!(areas[LOCAL_IO].is_motor_ex_ready(Motor::M2), "it never had a command");
    }
    assert_eq!(events.receiver().try_recv().ok(), None);
    area.lock()[LOCAL_IO].start_counter_reset(Counter::C4);
    drop(area.wait_counter_reset(LOCAL_IO, Counter::C4, DEADLINE).unwrap());
    handler.end_transfer().unwrap();
}

#[test]
fn listeners_get_the_gap_and_its_end() {
    let txt = struck_by(FaultKind::Close { after: 0 }).start().unwrap();
    let handler = handler(&txt);
    let kinds =
        [EventKind::ConnectionLost, EventKind::ConnectionRestored, EventKind::TransferEnded];
    let events = handler.areas().events(&kinds, 10).unwrap();
    handler.begin_transfer().unwrap();
    let lost = events.recv_timeout(DEADLINE).unwrap().event;
    let closed = Error::ConnectionClosed { command: "ExchangeDataCmpr", received: 0 };
    assert!(matches!(lost, Event::ConnectionLost { error, .. } if error == closed));
    let restored = events.recv_timeout(DEADLINE).unwrap().event;
    assert!(matches!(restored, Event::ConnectionRestored { after, .. } if !after.is_zero()));
    assert_lost(&next_error(&handler.areas().clone()));
    handler.end_transfer().unwrap();
    let ended = events.recv_timeout(DEADLINE).unwrap().event;
    assert!(matches!(ended, Event::TransferEnded { error: None, .. }));
}

#[test]
fn it_gives_up_at_the_limit() {
    let txt = unpaced().start().unwrap();
    let limit = Duration::from_millis(300);
    let handler = handler_for(&txt).reconnect(limit).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    drop(txt);
    let area = handler.areas().clone();
    assert_lost(&next_error(&area));
    let error = next_error(&area);
    assert!(
        matches!(error, Error::ReconnectFailed { limit: reported, .. } if reported == limit),
        "{error}"
    );
    assert_eq!(handler.end_transfer(), Err(error));
    assert_eq!(handler.areas().lock()[LOCAL_IO].output.duty[0], 0);
}

#[test]
fn it_gives_up_immediately_when_the_firmware_is_too_old_now() {
    let first_port = unused_ports();
    let txt = unpaced().port(first_port).start().unwrap();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    handler.begin_transfer().unwrap();
    drop(txt);
    assert_lost(&next_error(&area));
    let found = FirmwareVersion::new(4, 1, 5);
    let _txt = unpaced().port(first_port).firmware(found).start().unwrap();
    let required = FirmwareVersion::OLDEST_SUPPORTED;
    assert_eq!(next_error(&area), Error::FirmwareTooOld { found, required });
}

#[test]
fn another_controller_may_answer_and_shows_its_name() {
    let first_port = unused_ports();
    let txt = unpaced().port(first_port).device_name("the first").start().unwrap();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    let events = area.events(&[EventKind::ConnectionRestored], 10).unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(handler.device_name().as_deref(), Some("the first"));
    drop(txt);
    assert_lost(&next_error(&area));
    let old = FirmwareVersion::OLDEST_SUPPORTED;
    let second = unpaced().port(first_port).device_name("the second").firmware(old);
    let _txt = second.start().unwrap();
    drop(area.wait_cycle().unwrap());
    assert_eq!(handler.device_name().as_deref(), Some("the second"));
    assert_eq!(handler.version(), Some(old));
    let restored = events.recv_timeout(DEADLINE).unwrap().event;
    let Event::ConnectionRestored { device_name, firmware, address, .. } = restored else {
        panic!("{restored:?}")
    };
    assert_eq!((&*device_name, firmware), ("the second", old));
    assert_eq!((address, address.map(|it| it.port())), (handler.address(), Some(first_port)));
    handler.end_transfer().unwrap();
}

#[test]
fn the_program_can_end_it_in_the_middle_of_a_gap() {
    let txt = unpaced().start().unwrap();
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    drop(txt);
    assert_lost(&next_error(&handler.areas().clone()));
    let error = handler.end_transfer().expect_err("the motors may go on");
    assert!(matches!(error, Error::ConnectionRefused { .. }), "{error:?}");
    assert!(!handler.areas().is_running());
    assert_eq!(handler.areas().wait_cycle().map(drop), Err(error));
}

/// A motor is on when the connection is lost, and the next connection answers StartOnline late.
#[test]
fn an_end_while_it_connects_again_stops_the_motors() {
    for ends in [
        |handler: TransferAreaComHandler| assert_eq!(handler.end_transfer(), Ok(())),
        |handler: TransferAreaComHandler| handler.areas().ask_to_end(),
        drop,
    ] {
        let late = Fault::at_response(1, FaultKind::Delay(Duration::from_millis(300)));
        // A fault strikes once: the first of these at the first connection.
        let txt = struck_by(FaultKind::Close { after: 0 }).fault(late).fault(late);
        let txt = txt.start().unwrap();
        let handler = handler(&txt);
        let area = handler.areas().clone();
        area.lock()[LOCAL_IO].output.duty[0] = 512;
        handler.begin_transfer().unwrap();
        wait_until(&txt, "another connection", |machine| machine.connections() >= 2);
        ends(handler);
        wait_until(&txt, "the end of online mode", |machine| !machine.online());
        let duty = txt.with_machine(|machine| machine.controllers[0].outputs.duty);
        assert_eq!(duty, [0; 8], "a motor is on");
    }
}

#[test]
fn a_panic_in_the_middle_of_a_gap_ends_the_transfer() {
    let txt = unpaced().start().unwrap();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    handler.begin_transfer().unwrap();
    drop(txt);
    assert_lost(&next_error(&area));
    let other = handler.areas().clone();
    let panics = thread::spawn(move || {
        let _areas = other.lock();
        panic!("in the middle of a gap");
    });
    panics.join().unwrap_err();
    assert_eq!(next_error(&area), Error::ProgramPanicked);
}

#[test]
fn the_camera_starts_again_and_its_channel_goes_on() {
    let first_port = unused_ports();
    let start = || unpaced().port(first_port).camera_start_up(Duration::ZERO).start().unwrap();
    let txt = start();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    handler.begin_transfer().unwrap();
    let options = CameraOptions::default().size(32, 16);
    let frames = handler.start_camera(options).unwrap();
    let first = frames.recv_timeout(DEADLINE).unwrap();
    drop(txt);
    assert_lost(&next_error(&area));
    while frames.try_recv().is_ok() {}
    assert_eq!(handler.camera_error(), None);
    let _txt = start();
    let frame = frames.recv_timeout(DEADLINE).unwrap();
    assert!(frame.sequence > first.sequence);
    handler.end_transfer().unwrap();
    while frames.recv_timeout(DEADLINE).is_ok() {}
    assert_eq!(handler.camera_error(), None);
}

const NONE: FaultKind = FaultKind::Delay(Duration::ZERO);

/// Enough time to write something before the second connection is made.
const PAUSE: FaultKind = FaultKind::Delay(Duration::from_millis(500));

#[test]
fn a_connection_that_fails_in_its_first_exchange_is_closed_and_told() {
    let record = Record::default();
    let noted = record.clone();
    let txt = unpaced().fault(Fault::at_exchange(20, FaultKind::Close { after: 5 }));
    // The first fault occurs on the first connection, the second on the second, and so on.
    let txt =
        [NONE, PAUSE].into_iter().fold(txt, |txt, kind| txt.fault(Fault::at_response(0, kind)));
    let txt = [NONE, FaultKind::Silence]
        .into_iter()
        .fold(txt, |txt, kind| txt.fault(Fault::at_exchange(0, kind)))
        .on_exchange(move |machine| noted.note(machine))
        .start()
        .unwrap();
    let limits = TimeLimits::default().read(Duration::from_secs(2));
    let builder = handler_for(&txt).time_limits(limits).reconnect(DEADLINE / 3);
    let handler = builder.build().unwrap();
    let area = handler.areas().clone();
    handler.begin_transfer().unwrap();
    assert_lost(&next_error(&area));
    area.lock()[LOCAL_IO].output.duty[0] = 512;
    wait_until(&txt, "a motor that runs", |machine| master(machine)[0] == 512);
    let before = record.outputs().len();
    // The motor has run, and is stopped now.
    assert_lost(&area.wait_cycle().map(drop).unwrap_err());
    drop(area.wait_cycle().unwrap());
    assert_eq!(txt.with_machine(|machine| machine.connections()), 3);
    assert!(record.outputs()[before..].iter().all(|outputs| outputs.duty[0] == 0));
    assert_eq!(handler.areas().statistics().gaps, 2);
    handler.end_transfer().unwrap();
}

#[test]
fn nothing_begins_to_move_when_the_transfer_ends_while_it_connects() {
    let record = Record::default();
    let noted = record.clone();
    let txt = unpaced().fault(Fault::at_exchange(20, FaultKind::Close { after: 5 }));
    let txt =
        [NONE, PAUSE].into_iter().fold(txt, |txt, kind| txt.fault(Fault::at_response(0, kind)));
    let txt = txt.on_exchange(move |machine| noted.note(machine)).start().unwrap();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    handler.begin_transfer().unwrap();
    assert_lost(&next_error(&area));
    area.lock()[LOCAL_IO].output.duty[0] = 512;
    wait_until(&txt, "another connection", |machine| machine.connections() == 2);
    handler.end_transfer().unwrap();
    assert!(record.outputs().iter().all(|outputs| outputs.duty[0] == 0));
}
