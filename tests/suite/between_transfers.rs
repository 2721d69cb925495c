//! Nothing from before the end of a transfer moves a motor in the next one.

use std::net::{TcpListener, TcpStream};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::{FishX1Transfer, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Motor, Sound};
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::support::{check_client, handler_for, unpaced, wait_until, Record, DEADLINE};

fn recorded() -> (SimulatedTxt, Record) {
    let record = Record::default();
    let noted = record.clone();
    (unpaced().on_exchange(move |machine| noted.note(machine)).start().unwrap(), record)
}

/// Begins, lets some exchanges pass, and ends. Returns the first duty of the first request.
fn first_duty(handler: &TransferAreaComHandler, record: &Record) -> i16 {
    let begin = record.outputs().len();
    handler.begin_transfer().unwrap();
    for _ in 0..3 {
        handler.areas().wait_cycle().unwrap();
    }
    handler.end_transfer().unwrap();
    record.outputs()[begin].duty[0]
}

fn set_duty(area: &TransferAreas, duty: i16) {
    area.lock()[LOCAL_IO].output.duty[0] = duty;
}

#[test]
fn what_is_written_before_the_first_transfer_goes_out() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    set_duty(&handler.areas().clone(), 111);
    assert_eq!(first_duty(&handler, &record), 111);
}

#[test]
fn outputs_of_a_poller_that_does_not_know_of_the_end_are_dropped() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    let poller = handler.areas().clone();
    first_duty(&handler, &record);
    set_duty(&poller, 512);
    assert_eq!(poller.lock()[LOCAL_IO].output.duty[0], 0, "and the area shows it");
    assert_eq!(first_duty(&handler, &record), 0);
    check_client(&txt);
}

#[test]
fn outputs_of_a_program_that_knows_of_the_end_go_out() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    let area = handler.areas().clone();
    type Ask = fn(&TransferAreas) -> bool;
    let asks: [Ask; 4] = [
        |area| area.wait_cycle().is_err(),
        |area| !area.is_running(),
        |area| area.feed_watchdog().is_err(),
        |area| area.error().is_none(),
    ];
    for ask in asks {
        first_duty(&handler, &record);
        assert!(ask(&area));
        set_duty(&area, 222);
        assert_eq!(first_duty(&handler, &record), 222);
    }
    // The handle that ends it knows of the end, too.
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 333;
    assert_eq!(first_duty(&handler, &record), 333);
}

#[test]
fn a_guard_that_is_held_over_the_end_and_the_next_beginning_moves_nothing() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    let area = handler.areas().clone();
    let mut areas = area.lock();
    areas[LOCAL_IO].output.duty[0] = 512;
    handler.end_transfer().unwrap();
    let begin = record.outputs().len();
    handler.begin_transfer().unwrap();
    drop(areas);
    wait_until(&txt, "exchanges", |_| record.outputs().len() > begin + 10);
    handler.end_transfer().unwrap();
    assert!(record.outputs()[begin..].iter().all(|outputs| outputs.duty[0] == 0));
}

#[test]
fn a_configuration_always_counts() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    let area = handler.areas().clone();
    first_duty(&handler, &record);
    area.lock()[LOCAL_IO].config.uni[0].mode = 3;
    first_duty(&handler, &record);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config.uni[0].mode), 3);
}

#[test]
fn timers_and_inputs_do_not_change_after_the_end() {
    let (txt, record) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    let area = handler.areas().clone();
    first_duty(&handler, &record);
    let timer = area.lock()[LOCAL_IO].timer;
    thread::sleep(Duration::from_millis(20));
    assert_eq!(area.lock()[LOCAL_IO].timer, timer);
}

/// Begins a transfer and starts a distance and a sound that take long.
fn order(txt: &SimulatedTxt, handler: &TransferAreaComHandler) {
    handler.begin_transfer().unwrap();
    let mut areas = handler.areas().wait_cycle().unwrap();
    let area = &mut areas[LOCAL_IO];
    area.start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 900).unwrap();
    area.set_sound(Sound::Bell, 100).unwrap();
    drop(areas);
    wait_until(txt, "some pulses", |machine| machine.controllers[0].counter[0] > 20);
}

#[test]
fn commands_that_the_end_has_stopped_never_read_as_done() {
    let (txt, _) = recorded();
    let handler = handler_for(&txt).build().unwrap();
    order(&txt, &handler);
    handler.end_transfer().unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..20 {
        let areas = handler.areas().wait_cycle().unwrap();
        let area = &areas[LOCAL_IO];
        assert!(!area.is_motor_ex_ready(Motor::M1), "at {} pulses", area.input.counter[0]);
        assert!(!area.is_sound_ready());
        assert_eq!(area.input.motor_ex_reached[0], 0);
        assert!(area.is_motor_ex_ready(Motor::M3), "it never had a command");
    }
    let limit = Duration::from_millis(20);
    let waited = handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, limit).map(drop);
    assert_eq!(waited, Err(Error::WaitTimedOut { limit }));
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.sound_index), 0);
    // New commands are done again.
    let mut areas = handler.areas().lock();
    areas[LOCAL_IO].start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 30).unwrap();
    areas[LOCAL_IO].set_sound(Sound::Bell, 1).unwrap();
    areas[LOCAL_IO].start_counter_reset(Counter::C2);
    drop(areas);
    let done = |areas: &[FishX1Transfer]| {
        let area = &areas[LOCAL_IO];
        area.is_motor_ex_ready(Motor::M1)
            && area.is_sound_ready()
            && area.is_cnt_reset_ready(Counter::C2)
    };
    drop(handler.areas().wait_until(done, DEADLINE).unwrap());
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn a_panic_under_a_guard_while_the_transfer_begins_is_not_forgotten() {
    let txt = unpaced().start().unwrap();
    // Between the two, the handshake takes as long as the test wants.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let handler = TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).build().unwrap();
    let area = handler.areas().clone();
    thread::scope(|scope| {
        let begins = scope.spawn(|| handler.begin_transfer());
        let (client, _) = listener.accept().unwrap();
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            let mut areas = area.lock();
            areas[LOCAL_IO].output.duty[0] = 512;
            panic!("before all is written");
        }));
        panicked.unwrap_err();
        let server = TcpStream::connect(txt.address()).unwrap();
        let (mut from, mut to) = (client.try_clone().unwrap(), server.try_clone().unwrap());
        scope.spawn(move || {
            let _ = std::io::copy(&mut from, &mut to);
            let _ = to.shutdown(std::net::Shutdown::Both);
        });
        scope.spawn(move || {
            let (mut from, mut to) = (server, client);
            let _ = std::io::copy(&mut from, &mut to);
        });
        assert_eq!(begins.join().unwrap(), Err(Error::ProgramPanicked));
    });
    wait_until(&txt, "the end", |machine| !machine.connected());
    let sent =
        txt.with_machine(|machine| (machine.exchanges(), machine.controllers[0].outputs.duty));
    assert_eq!(sent, (1, [0; 8]), "one exchange stops what the session before left");
    assert_eq!(
        handler.areas().lock()[LOCAL_IO].output.duty[0],
        0,
        "what was half written is undone"
    );
    assert!(!handler.areas().is_running());
}

#[test]
fn another_thread_may_end_a_transfer_that_begins() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let handler = TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).build().unwrap();
    thread::scope(|scope| {
        let begins = scope.spawn(|| handler.begin_transfer());
        let (client, _) = listener.accept().unwrap();
        assert_eq!(handler.begin_transfer(), Err(Error::AlreadyStarted));
        let ends = scope.spawn(|| handler.end_transfer());
        drop(client);
        let error = begins.join().unwrap().unwrap_err();
        assert!(matches!(error, Error::ConnectionClosed { .. }), "{error}");
        drop(ends.join().unwrap());
    });
}
