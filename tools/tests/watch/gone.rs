//! A program that is gone without an end of its session: the controller is stopped. It does not stop by itself, so
//! what counts is the last exchange that it has received.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::{
    CommandId, ExchangeData, ExchangeDataResponse, ResponseId, StartOnline,
};
use ft_transfer_area_recorder::{Recorded, Recording, Transfer};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};
use serde_json::{json, Value};
use socket2::SockRef;

use super::away::{at_free_ports, started};
use super::clients::transfers;
use super::support::{accept, command, connect, listener, logged, Duties, KitClient, Watch};
use super::LIMIT;
use crate::recording::said;

const M1: [i16; 8] = [512, 0, 0, 0, 0, 0, 0, 0];

/// What was exchanged at last.
fn last(duties: &Duties) -> Vec<[i16; 8]> {
    duties.lock().unwrap().last().cloned().unwrap_or_default()
}

/// A program that is online through it.
fn program(watch: &Watch) -> KitClient {
    KitClient::online(([127, 0, 0, 1], watch.port).into())
}

/// Waits until it says that the outputs are off, and that the program has not ended its session.
fn reported(watch: &Watch, because: &str) {
    assert_eq!(outputs_off(watch), (because.into(), true.into()));
    let reported = watch.line_where(|line| line["what"] == "offline");
    assert_eq!(reported["by_program"], false);
    watch.line_where(closed);
}

/// What it says about that: because of what, and whether it was done.
pub(super) fn outputs_off(watch: &Watch) -> (Value, Value) {
    let reported = watch.line_where(|line| line["what"] == "outputs_off");
    (reported["because"].clone(), reported["done"].clone())
}

fn closed(line: &Value) -> bool {
    line["what"] == "closed" && line["connection"] == "main"
}

#[test]
fn all_outputs_go_off_when_the_program_is_killed() {
    let (txt, duties) = logged(SimulatedTxt::builder().extensions(1));
    let watch = Watch::with_lines(txt.address());
    for (number, resets) in [false, true, false].into_iter().enumerate() {
        let mut program = program(&watch);
        if number < 2 {
            program.exchange_all(&[M1, M1]);
        } else {
            program.simple_exchange(M1);
        }
        assert_eq!(last(&duties)[0], M1);
        if resets {
            SockRef::from(&program.stream).set_linger(Some(Duration::ZERO)).unwrap();
        }
        drop(program);
        // Wine loses a reset when it reports it, and then it is an end.
        reported(&watch, if resets && cfg!(not(windows)) { "reset" } else { "closed" });
        assert_eq!(last(&duties), [[0; 8]; 2], "{number}");
        assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    }
}

#[test]
fn a_response_that_is_still_to_come_holds_nothing_up() {
    let (txt, duties) = logged(SimulatedTxt::builder().pace(Duration::from_millis(300)));
    let watch = Watch::with_lines(txt.address());
    let mut program = program(&watch);
    program.exchange(M1);
    let mut request = Vec::new();
    ExchangeData { duty: M1, ..ExchangeData::default() }.emit(&mut request);
    program.stream.write_all(&request).unwrap();
    drop(program);
    reported(&watch, "closed");
    assert_eq!(last(&duties), [[0; 8]]);
}

#[test]
fn a_part_of_a_command_does_not_hide_the_one_that_stops() {
    let (txt, duties) = logged(SimulatedTxt::builder());
    let watch = Watch::with_lines(txt.address());
    let mut program = program(&watch);
    program.exchange(M1);
    let mut request = Vec::new();
    ExchangeData { duty: M1, ..ExchangeData::default() }.emit(&mut request);
    program.stream.write_all(&request[..30]).unwrap();
    drop(program);
    // By a new connection.
    watch.line_where(closed);
    assert_eq!(outputs_off(&watch), ("closed".into(), true.into()));
    assert_eq!(last(&duties), [[0; 8]]);
}

#[test]
fn all_outputs_go_off_when_the_program_is_silent() {
    let (txt, duties) = logged(SimulatedTxt::builder());
    let watch = Watch::with_lines(txt.address());
    let mut program = program(&watch);
    program.exchange(M1);
    reported(&watch, "silent");
    assert_eq!(last(&duties), [[0; 8]]);
    // As the controller would have done.
    assert!(matches!(program.stream.read(&mut [0]), Ok(0)));
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn all_outputs_go_off_at_ctrl_c() {
    let of_linux = cfg!(target_os = "linux").then_some("PWR");
    for signal in ["INT", "QUIT", "TSTP", "ALRM", "XCPU"].into_iter().chain(of_linux) {
        let (txt, duties) = logged(SimulatedTxt::builder());
        let watch = Watch::with_lines(txt.address());
        let mut program = program(&watch);
        program.exchange(M1);
        watch.running.signal(signal);
        reported(&watch, "watch_ends");
        assert_eq!(last(&duties), [[0; 8]]);
    }
}

#[test]
fn outputs_stay_when_that_is_wanted_or_the_session_has_ended() {
    let (txt, duties) = logged(SimulatedTxt::builder());
    let watch = Watch::start(txt.address(), &["--no-page", "--leave-outputs"]);
    let mut left = program(&watch);
    left.exchange(M1);
    drop(left);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    assert_eq!(last(&duties), [M1]);

    let watch = Watch::with_lines(txt.address());
    let mut ended = program(&watch);
    ended.exchange(M1);
    ended.end();
    watch.line_where(|line| {
        assert_ne!(line["what"], "outputs_off");
        closed(line)
    });
    assert_eq!(last(&duties), [M1]);
}

#[test]
fn a_page_disconnects_the_program_and_keeps_programs_out_until_it_lets_them_in() {
    for arguments in [&[][..], &["--leave-outputs"]] {
        let (txt, duties) = logged(SimulatedTxt::builder().extensions(1));
        let watch = Watch::start(txt.address(), arguments);
        let mut page = watch.page();
        let mut first = program(&watch);
        first.exchange_all(&[M1, M1]);
        page.done(json!({"do": "disconnect"}));
        assert!(txt.wait_until(|machine| !machine.online(), LIMIT), "{arguments:?}");
        assert_eq!(last(&duties), [[0; 8]; 2], "{arguments:?}");
        assert!(!matches!(first.stream.read(&mut [0]), Ok(1..)));
        page.state(0, |state| {
            state["watched"]["shut"] == true && state["link"]["error"]["code"] == "disconnected"
        });

        // A program that tries it again and again, as after a lost connection.
        for _ in 0..3 {
            let refused = TcpStream::connect(("127.0.0.1", watch.port));
            assert!(!refused.is_ok_and(|mut program| matches!(program.read(&mut [0]), Ok(1..))));
        }
        page.done(json!({"do": "admit"}));
        let mut admitted = program(&watch);
        admitted.exchange(M1);
        assert_eq!(last(&duties)[0], M1);
    }
}

/// A controller that does as its script says.
pub(super) struct Controller {
    pub(super) listener: TcpListener,
    pub(super) stream: TcpStream,
}

impl Controller {
    /// With a program that is online on it.
    pub(super) fn online(watch: &Watch, listener: TcpListener) -> (Self, TcpStream) {
        let mut program = watch.connect();
        let stream = accept(&listener);
        let mut controller = Self { listener, stream };
        let mut packet = Vec::new();
        StartOnline::new().emit(&mut packet);
        program.write_all(&packet).unwrap();
        controller.answer(StartOnline::LEN, &ResponseId::StartOnline.id().to_le_bytes());
        program.read_exact(&mut [0; 4]).unwrap();
        (controller, program)
    }

    /// Reads a command of this size, and sends this response.
    pub(super) fn answer(&mut self, size: usize, response: &[u8]) -> Vec<u8> {
        let mut command = vec![0; size];
        self.stream.read_exact(&mut command).unwrap();
        self.stream.write_all(response).unwrap();
        command
    }

    /// Is sent what switches all outputs off, by a new connection.
    pub(super) fn is_stopped(&mut self) {
        let started = ResponseId::StartOnline.id().to_le_bytes();
        let start = self.answer(StartOnline::LEN, &started);
        assert_eq!(StartOnline::parse(&start), Ok(StartOnline::new()));
        let mut response = Vec::new();
        ExchangeDataResponse::default().emit(&mut response);
        let zeros = self.answer(ExchangeData::LEN, &response);
        assert_eq!(ExchangeData::parse(&zeros), Ok(ExchangeData::default()));
        self.answer(4, &ResponseId::StopOnline.id().to_le_bytes());
    }

    fn nobody_comes(&self) -> bool {
        self.listener.set_nonblocking(true).unwrap();
        let come = self.listener.accept();
        self.listener.set_nonblocking(false).unwrap();
        come.is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }
}

/// Listens where a controller would, also for I2C.
fn with_i2c() -> (TcpListener, SocketAddr, TcpListener) {
    loop {
        let (main, address) = listener();
        let port = address.port().checked_add(2);
        let i2c = port.map(|port| TcpListener::bind((address.ip(), port)));
        if let Some(Ok(i2c)) = i2c {
            return (main, address, i2c);
        }
    }
}

#[test]
fn the_next_program_waits_until_the_controller_is_stopped() {
    let (listener, address, i2c) = with_i2c();
    let watch = Watch::start(address, &["--no-page"]);
    let (mut controller, program) = Controller::online(&watch, listener);
    drop(program);
    let mut zeros = vec![0; ExchangeData::LEN];
    controller.stream.read_exact(&mut zeros).unwrap();
    assert_eq!(ExchangeData::parse(&zeros), Ok(ExchangeData::default()));
    let mut next = watch.connect();
    next.write_all(b"next").unwrap();
    std::thread::sleep(Duration::from_millis(300));
    assert!(controller.nobody_comes());
    let mut response = Vec::new();
    ExchangeDataResponse::default().emit(&mut response);
    controller.stream.write_all(&response).unwrap();
    // The firmware waits for this one, and holds up StopOnline meanwhile.
    assert_eq!(accept(&i2c).read(&mut [0]).unwrap(), 0);
    let stop = controller.answer(4, &ResponseId::StopOnline.id().to_le_bytes());
    assert_eq!(stop, CommandId::StopOnline.id().to_le_bytes());
    assert_eq!(controller.stream.read(&mut [0]).unwrap(), 0);
    accept(&controller.listener).read_exact(&mut [0; 4]).unwrap();
}

#[test]
fn a_program_that_has_come_back_goes_before_a_new_connection() {
    let (listener, address) = listener();
    let watch = Watch::start(address, &["--no-page"]);
    let (mut controller, program) = Controller::online(&watch, listener);
    drop(program);
    controller.stream.read_exact(&mut [0; ExchangeData::LEN]).unwrap();
    let mut next = watch.connect();
    next.write_all(b"next").unwrap();
    drop(controller.stream);
    let mut received = [0; 4];
    accept(&controller.listener).read_exact(&mut received).unwrap();
    assert_eq!(&received, b"next");
}

/// A watch whose controller has ended the connection, and whose program has gone then.
fn ended_by_its_controller() -> (Watch, TcpListener) {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let (Controller { listener, stream }, program) = Controller::online(&watch, listener);
    drop(stream);
    watch.line_where(|line| line["what"] == "offline");
    drop(program);
    (watch, listener)
}

#[test]
fn a_controller_that_ends_the_connection_is_stopped_if_no_program_comes_back() {
    let (watch, listener) = ended_by_its_controller();
    // One that comes back drives again, and nobody else does.
    let (mut controller, program) = Controller::online(&watch, listener);
    std::thread::sleep(Duration::from_millis(2500));
    assert!(controller.nobody_comes());
    drop(controller.stream);
    watch.line_where(|line| line["what"] == "offline");
    drop(program);
    controller.stream = accept(&controller.listener);
    controller.is_stopped();
    assert_eq!(outputs_off(&watch), ("lost".into(), true.into()));
}

/// The library sends its last exchange and StopOnline into the closed connection.
#[test]
fn a_farewell_that_the_controller_does_not_answer_is_none() {
    let close = Fault::at_exchange(5, FaultKind::Close { after: 0 });
    let (txt, duties) = logged(SimulatedTxt::builder().fault(close));
    let watch = Watch::with_lines(txt.address());
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    while let Ok(mut areas) = handler.areas().wait_cycle() {
        areas[LOCAL_IO].output.duty[0] = 512;
    }
    assert_eq!(last(&duties), [M1]);
    assert_eq!(outputs_off(&watch), ("lost".into(), true.into()));
    assert_eq!(last(&duties), [[0; 8]]);
}

/// As two at one address of a Wi-Fi, one after the other.
#[test]
fn another_controller_is_not_stopped_in_place_of_the_one_that_was_driven() {
    for comes_back in [false, true] {
        let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("FIRST"));
        let (address, port) = (first.address(), first.port());
        let watch = Watch::with_lines(address);
        let mut driven = program(&watch);
        driven.exchange(M1);
        drop(first);
        drop(driven);
        let second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
        if comes_back {
            let mut next = program(&watch);
            next.exchange([0; 8]);
            next.exchange([0; 8]);
            next.end();
        }
        let off = watch.line_where(|line| line["what"] == "outputs_off");
        assert_eq!((&off["connection_number"], &off["done"]), (&json!(1), &json!(false)));
        assert!(off["why"].as_str().unwrap().contains("SECOND answers there in place of FIRST"));
        let commands: Vec<_> = second.with_machine(|machine| machine.commands().collect());
        assert_eq!(commands.contains(&CommandId::StartOnline), comes_back, "{commands:?}");
    }
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn page_and_recording_tell_of_motors_of_a_replaced_controller_while_another_program_drives() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("FIRST"));
    let (address, port) = (first.address(), first.port());
    let watch = Watch::start(address, &["--record", path.to_str().unwrap()]);
    let mut page = watch.page();
    let mut driven = program(&watch);
    driven.exchange(M1);
    drop(first);
    drop(driven);
    let _second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
    let mut next = program(&watch);
    let begun = Instant::now();
    let told = loop {
        assert!(begun.elapsed() < LIMIT, "nothing is told");
        next.exchange([0; 8]);
        let state = page.state(0, |_| true);
        if !state["watched"]["beside"].is_null() {
            break state;
        }
    };
    assert_eq!(told["watched"]["beside"]["code"], "replaced", "{told}");
    let text = told["watched"]["beside"]["text"].as_str().unwrap();
    assert!(text.contains("SECOND answers there in place of FIRST"), "{text}");
    next.exchange([0; 8]);
    next.end();
    let after = page.state(0, |state| state["link"]["phase"] == "idle");
    assert_eq!(after["watched"]["beside"]["text"], text);
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    let [Transfer::Began { device_name: one, .. }, Transfer::EndedBy(_), Transfer::Began { device_name: other, .. }, Transfer::Ended, Transfer::EndedBy(left)] =
        &transfers[..]
    else {
        panic!("{transfers:?}")
    };
    assert_eq!((one.as_str(), other.as_str(), left.error.as_str()), ("FIRST", "SECOND", text));
}

/// The first program has not closed its connection.
#[test]
fn motors_of_a_controller_that_another_one_has_replaced_may_go_on() {
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("FIRST"));
    let (address, port) = (first.address(), first.port());
    let watch = Watch::with_lines(address);
    let mut driven = program(&watch);
    driven.exchange(M1);
    drop(first);
    let _second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
    let mut next = program(&watch);
    let is_told = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_told.load(Ordering::Relaxed) {
                next.exchange([0; 8]);
            }
        });
        let off = watch.line_where(|line| line["what"] == "outputs_off");
        is_told.store(true, Ordering::Relaxed);
        assert_eq!((&off["connection_number"], &off["done"]), (&json!(1), &json!(false)));
        assert!(off["why"].as_str().unwrap().contains("SECOND answers there in place of FIRST"));
    });
    drop(driven);
}

/// Its program has come back on another one meanwhile, and has left this one open.
#[test]
fn a_connection_that_the_controller_has_ended_stops_nothing_that_another_one_drives() {
    let close = Fault::at_exchange(5, FaultKind::Close { after: 0 });
    let (txt, duties) = logged(SimulatedTxt::builder().fault(close));
    let watch = Watch::with_lines(txt.address());
    let mut exchange = Vec::new();
    ExchangeData { duty: M1, ..ExchangeData::default() }.emit(&mut exchange);
    let goes_on = |program: &mut KitClient| {
        program.stream.write_all(&exchange).and_then(|()| program.stream.read_exact(&mut [0; 80]))
    };
    let mut first = program(&watch);
    while goes_on(&mut first).is_ok() {}
    let mut second = program(&watch);
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                goes_on(&mut second).unwrap();
            }
        });
        watch.line_where(closed);
        is_over.store(true, Ordering::Relaxed);
    });
    second.end();
    // A stop that waits for its turn would have it now.
    let mut third = program(&watch);
    third.exchange(M1);
    third.end();
    let mut ends = 0;
    watch.line_where(|line| {
        assert_ne!(line["what"], "outputs_off");
        ends += usize::from(closed(line));
        ends == 2
    });
    assert_eq!(last(&duties), [M1]);
    drop(first);
}

/// The connection that drove was closed with a motor on; the stop passes on another one.
#[test]
fn the_page_shows_no_motor_on_after_a_stop_on_a_connection_of_its_own() {
    let close = Fault::at_exchange(5, FaultKind::Close { after: 0 });
    let txt = SimulatedTxt::builder().fault(close).start().unwrap();
    let watch = Watch::start(txt.address(), &[]);
    let mut page = watch.page();
    let mut program = program(&watch);
    let mut exchange = Vec::new();
    ExchangeData { duty: M1, ..ExchangeData::default() }.emit(&mut exchange);
    let mut goes_on = || {
        program.stream.write_all(&exchange).and_then(|()| program.stream.read_exact(&mut [0; 80]))
    };
    while goes_on().is_ok() {}
    drop(program);
    page.state(0, |state| state["areas"][0]["motors"][0]["duty"] == json!([512, 0]));
    let halted = page.state(0, |state| state["link"]["error"]["code"] == "halted");
    assert_eq!(halted["areas"][0]["motors"][0]["duty"], json!([0, 0]));
}

#[test]
fn a_program_that_only_looks_does_not_put_the_stop_off_for_long() {
    let (watch, listener) = ended_by_its_controller();
    let mut looker = watch.connect();
    let mut served = accept(&listener);
    // It goes on as long as it is let.
    let looks = std::thread::spawn(move || {
        while looker.write_all(&CommandId::QueryStatus.id().to_le_bytes()).is_ok() {
            std::thread::sleep(Duration::from_millis(100));
        }
    });
    while served.read(&mut [0; 64]).is_ok_and(|count| count > 0) {}
    looks.join().unwrap();
    let stream = accept(&listener);
    Controller { listener, stream }.is_stopped();
    assert_eq!(outputs_off(&watch), ("lost".into(), true.into()));
}

/// Going online clears the outputs in the controller, but only an exchange sends them to its board.
#[test]
fn a_program_that_goes_online_and_exchanges_nothing_does_not_replace_the_stop() {
    let (watch, listener) = ended_by_its_controller();
    let (mut controller, mut program) = Controller::online(&watch, listener);
    program.write_all(&CommandId::StopOnline.id().to_le_bytes()).unwrap();
    controller.answer(4, &ResponseId::StopOnline.id().to_le_bytes());
    program.read_exact(&mut [0; 4]).unwrap();
    drop(program);
    controller.stream = accept(&controller.listener);
    controller.is_stopped();
    assert_eq!(outputs_off(&watch), ("lost".into(), true.into()));
}

#[test]
fn a_program_whose_start_is_not_answered_does_not_put_the_stop_off_for_long() {
    let (watch, listener) = ended_by_its_controller();
    let mut waits = watch.connect();
    let mut packet = Vec::new();
    StartOnline::new().emit(&mut packet);
    waits.write_all(&packet).unwrap();
    let mut served = accept(&listener);
    // The controller closes nothing.
    while served.read(&mut [0; 64]).is_ok_and(|count| count > 0) {}
    let stream = accept(&listener);
    Controller { listener, stream }.is_stopped();
    assert_eq!(outputs_off(&watch), ("lost".into(), true.into()));
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_controller_that_has_ended_the_connection_is_stopped_at_ctrl_c() {
    let (watch, listener) = ended_by_its_controller();
    // No program can come back any more.
    watch.running.signal("INT");
    let stream = accept(&listener);
    Controller { listener, stream }.is_stopped();
    assert_eq!(outputs_off(&watch), ("lost".into(), true.into()));
}

#[test]
fn a_controller_that_does_not_stop_talking_holds_up_nothing() {
    let (listener, address) = listener();
    // Lines of JSON of all that would take a minute to print.
    let watch = Watch::by(command(address, &["--no-page"]).stderr(Stdio::piped()), address);
    let (mut controller, program) = Controller::online(&watch, listener);
    drop(program);
    let responses = [&ResponseId::QueryStatus.id().to_le_bytes()[..], &[0; 20]].concat();
    let responses = responses.repeat(10_000);
    while controller.stream.write_all(&responses).is_ok() {}
    controller.stream = accept(&controller.listener);
    controller.is_stopped();
    // Only Unix can end another program like Ctrl-C.
    if cfg!(unix) {
        watch.running.signal("INT");
        let said = said(&watch.running.end());
        assert!(said.contains("all outputs of the controller were switched off"), "{said}");
    }
}

/// The responses to the first of many commands say nothing of one that is sent behind them.
#[test]
fn a_program_that_does_not_wait_for_responses_is_stopped_too() {
    let (txt, duties) = logged(SimulatedTxt::builder());
    let watch = Watch::with_lines(txt.address());
    let mut program = program(&watch);
    program.exchange(M1);
    let mut request = Vec::new();
    ExchangeData { duty: M1, ..ExchangeData::default() }.emit(&mut request);
    program.stream.write_all(&request.repeat(2000)).unwrap();
    // The controller has begun with them.
    program.stream.read_exact(&mut [0; 80 * 150]).unwrap();
    drop(program);
    assert_eq!(outputs_off(&watch).1, true);
    assert_eq!(last(&duties), [[0; 8]]);
}

#[test]
fn a_controller_that_does_not_answer_is_told_as_not_stopped() {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let (mut controller, program) = Controller::online(&watch, listener);
    drop(program);
    controller.stream.read_exact(&mut [0; ExchangeData::LEN]).unwrap();
    drop(controller);
    watch.line_where(closed);
    assert_eq!(outputs_off(&watch), ("closed".into(), false.into()));
}

/// As `tx_run` is, which stops what its program has left.
#[test]
fn the_page_still_says_so_when_the_next_one_is_online_at_once() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let watch = Watch::start(txt.address(), &[]);
    let mut page = watch.page();
    let mut gone = program(&watch);
    gone.exchange(M1);
    drop(gone);
    let next = program(&watch);
    page.state(0, |state| state["watched"]["beside"]["code"] == "halted");
    drop(next);
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn the_page_and_the_recording_say_so() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let watch = Watch::start(txt.address(), &["--record", path.to_str().unwrap()]);
    let mut page = watch.page();
    let mut program = program(&watch);
    program.exchange(M1);
    drop(program);
    let state = page.state(0, |state| state["link"]["error"]["code"] == "halted");
    assert_eq!(state["areas"][0]["motors"][0]["duty"][0], 0, "{state}");
    page.state(0, |state| state["link"]["phase"] == "idle" && state["link"]["gaps"] == 1);
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let entries: Vec<_> =
        Recording::open(&path).unwrap().map(|entry| entry.unwrap().what).collect();
    let said = entries.iter().find_map(|what| match what {
        Recorded::Transfer(Transfer::EndedBy(failure)) => Some(&failure.error),
        _ => None,
    });
    assert!(
        said.is_some_and(|said| said.contains("all outputs of the controller were switched off"))
    );
    let last = entries.iter().rev().find_map(|what| match what {
        Recorded::Cycle(cycle) => Some(*cycle.areas[0].output.duty),
        _ => None,
    });
    assert_eq!(last, Some([0; 8]));
}

#[test]
fn a_program_that_has_gone_meanwhile_is_served_by_nobody() {
    // One that was only connected drives nothing.
    let (listener, address) = listener();
    let watch = Watch::start(address, &["--no-page"]);
    let mut program = connect(([127, 0, 0, 1], watch.port).into());
    program.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
    let mut controller = accept(&listener);
    drop(program);
    let mut received = Vec::new();
    controller.read_to_end(&mut received).unwrap();
    assert_eq!(received, CommandId::QueryStatus.id().to_le_bytes());
}
