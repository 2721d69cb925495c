//! Either side goes away and comes back.

use std::io::{self, ErrorKind, Read, Write};
use std::sync::atomic::{AtomicU16, Ordering};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::Error;
use ft_transfer_area_simulator::{SimulatedTxt, SimulatedTxtBuilder};

use super::support::Watch;
use super::LIMIT;

/// A simulated TXT at ports that systems give to nobody by themselves, so that they are free when it is back.
pub(crate) fn at_free_ports(builder: impl Fn(u16) -> SimulatedTxtBuilder) -> SimulatedTxt {
    static NEXT: AtomicU16 = AtomicU16::new(20_100);
    loop {
        let port = NEXT.fetch_add(3, Ordering::Relaxed);
        assert!(port < 30_000, "no ports are free");
        if let Ok(txt) = builder(port).start() {
            return txt;
        }
    }
}

fn at(port: u16) -> SimulatedTxtBuilder {
    SimulatedTxt::builder().port(port)
}

fn txt_at(port: u16) -> SimulatedTxt {
    started(|| at(port))
}

/// A simulated TXT at a port that may have been in use a moment ago.
pub(crate) fn started(builder: impl Fn() -> SimulatedTxtBuilder) -> SimulatedTxt {
    let deadline = Instant::now() + LIMIT;
    loop {
        match builder().start() {
            Ok(txt) => return txt,
            Err(error) => assert!(Instant::now() < deadline, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_controller_that_answers_again_does_not_refuse_any_more() {
    let txt = at_free_ports(at);
    let (address, port) = (txt.address(), txt.port());
    drop(txt);
    let watch = Watch::start(address, &[]);
    let mut page = watch.page();
    drop(watch.connect());
    page.state(0, |state| state["link"]["error"]["code"] == "connect_failed");
    let _txt = txt_at(port);
    let mut program = watch.connect();
    program.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
    let state = page.state(0, |state| state["link"]["name"] == "TX2013");
    assert!(state["link"]["error"].is_null(), "{state}");
}

#[test]
fn without_a_controller_a_connection_ends_at_once() {
    let txt = at_free_ports(at);
    let address = txt.address();
    drop(txt);
    let watch = Watch::start(address, &["--no-page"]);
    for _ in 0..3 {
        let mut stream = watch.connect();
        let sent = stream.write_all(&CommandId::QueryStatus.id().to_le_bytes());
        let read = stream.read(&mut [0]);
        // The reset is reported once, to the first call that asks.
        let is_reset = |error: &io::Error| {
            matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe)
        };
        let reported = sent.as_ref().err().or(read.as_ref().err());
        assert!(reported.is_some_and(is_reset), "{sent:?} {read:?}");
    }
    // Now there is one.
    let _txt = txt_at(address.port());
    let mut stream = watch.connect();
    stream.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
    stream.read_exact(&mut [0; 24]).unwrap();
}

#[test]
fn a_transfer_goes_on_when_the_controller_is_back() {
    let txt = at_free_ports(at);
    let (port, address) = (txt.port(), txt.address());
    let watch = Watch::start(address, &[]);
    let mut page = watch.page();
    let handler = watch.handler().reconnect(LIMIT).build().unwrap();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    page.state(0, |state| state["link"]["phase"] == "running");
    drop(txt);
    let lost = handler.areas().wait_until(|_| false, LIMIT);
    assert!(matches!(lost, Err(Error::ConnectionLost { .. })), "{:?}", lost.err());
    page.state(0, |state| state["link"]["phase"] != "running" && state["link"]["gaps"] == 1);
    let txt = txt_at(port);
    let deadline = Instant::now() + LIMIT;
    while txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]) != 300 {
        assert!(Instant::now() < deadline);
        if let Ok(mut areas) = handler.areas().wait_cycle_for(Duration::from_millis(100)) {
            areas[LOCAL_IO].output.duty[0] = 300;
        }
    }
    page.state(0, |state| state["areas"][0]["motors"][0]["duty"][0] == 300);
    handler.end_transfer().unwrap();
}
