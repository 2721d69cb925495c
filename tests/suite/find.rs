//! Controllers that answer are found, all addresses are asked at the same time, and no running transfer is
//! disturbed.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{
    find_controllers, ConnectionKind, Error, FirmwareVersion, FoundControllers, SearchOptions,
    TransferAreaComHandler, TriedAddress,
};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};

use crate::support::{check_client, handler_for, unpaced, wait_until, DEADLINE};

/// Long enough for an answer on a busy machine; some tests wait this long for an answer that never comes.
const LIMIT: Duration = Duration::from_secs(2);

/// No program gets this port by chance.
const REFUSES: &str = "127.0.0.1:1";

fn named(name: &str) -> SimulatedTxtBuilder {
    SimulatedTxt::builder().device_name(name).firmware(FirmwareVersion::new(4, 6, 6))
}

fn address(txt: &SimulatedTxt) -> String {
    format!("127.0.0.1:{}", txt.port())
}

fn listening() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (listener, address)
}

/// What a search at these addresses has found.
fn find(addresses: &[impl std::fmt::Display], limit: Duration) -> Result<FoundControllers, Error> {
    find_controllers(&SearchOptions::default().addresses(addresses).limit(limit))
}

/// What happened at these addresses, when no controller has answered.
fn tried(addresses: &[&str], limit: Duration) -> Vec<TriedAddress> {
    match find(addresses, limit) {
        Err(Error::NoController { tried }) => tried,
        other => panic!("{other:?}"),
    }
}

#[test]
fn controllers_that_answer_are_found_in_order_with_name_and_firmware() {
    let (first, second) = (named("left").start().unwrap(), named("right").start().unwrap());
    let (_silent, silence) = listening();
    let addresses = [address(&second), REFUSES.to_owned(), silence, address(&first)];
    let found = find(&addresses, LIMIT).unwrap().controllers;
    let names: Vec<_> = found.iter().map(|controller| &*controller.name).collect();
    assert_eq!(names, ["right", "left"]);
    for (controller, txt) in found.iter().zip([&second, &first]) {
        assert_eq!(controller.address.to_string(), address(txt));
        assert_eq!(controller.connection, ConnectionKind::SameMachine);
        assert_eq!(controller.firmware, FirmwareVersion::new(4, 6, 6));
        wait_until(txt, "the end of the question", |machine| !machine.connected());
        check_client(txt);
    }
    let text = format!("left with firmware 4.6.6 at {} (this machine)", address(&first));
    assert_eq!(found[1].to_string(), text);
}

#[test]
fn the_address_of_a_controller_that_was_found_leads_to_it() {
    let txt = named("here").start().unwrap();
    let found = find(&[address(&txt)], DEADLINE).unwrap().controllers;
    let handler = TransferAreaComHandler::builder(found[0].address.to_string()).build().unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(handler.device_name().as_deref(), Some("here"));
    handler.end_transfer().unwrap();
}

#[test]
fn without_a_controller_the_error_says_what_happened_at_each_address() {
    let (_silent, silence) = listening();
    let (stranger, strange) = listening();
    let (leaver, leaving) = listening();
    thread::scope(|scope| {
        scope.spawn(move || {
            let (mut stream, _) = stranger.accept().unwrap();
            stream.read_exact(&mut [0; 4]).unwrap();
            stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n").unwrap();
            // Until the other side has closed.
            let _ = stream.read(&mut [0]);
        });
        scope.spawn(move || {
            let (mut stream, _) = leaver.accept().unwrap();
            stream.read_exact(&mut [0; 4]).unwrap();
        });
        let addresses = [REFUSES, &*silence, &*strange, &*leaving, "txt:port"];
        let tried = tried(&addresses, LIMIT);
        assert_eq!(tried.iter().map(|tried| &*tried.address).collect::<Vec<_>>(), addresses);
        for (tried, (outcome, perhaps_in_use)) in tried.iter().zip([
            ("nothing listens there", false),
            ("did not answer within 2s, so another program may be using it", true),
            ("what answers is not a TXT", false),
            ("it closed the connection, so it may be in use, or its program has just ended", true),
            ("is not a controller's address", false),
        ]) {
            assert!(tried.outcome.contains(outcome), "{tried}");
            assert_eq!(tried.perhaps_in_use, perhaps_in_use, "{tried}");
        }
    });
}

#[test]
fn all_addresses_are_asked_at_the_same_time() {
    let silent: Vec<_> = (0..20).map(|_| listening()).collect();
    let addresses: Vec<_> = silent.iter().map(|(_, address)| &**address).collect();
    let begin = Instant::now();
    assert_eq!(tried(&addresses, LIMIT).len(), 20);
    // One after the other would take 40 s.
    assert!(begin.elapsed() < 10 * LIMIT, "{:?}", begin.elapsed());
}

/// For a controller that does not answer because another client is online.
const SILENT: Duration = Duration::from_millis(100);

#[test]
fn a_running_transfer_is_not_disturbed() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 512;
    for _ in 0..10 {
        let address = address(&txt);
        let tried = tried(&[&*address], SILENT);
        assert!(tried[0].outcome.contains("another program may be using it"), "{}", tried[0]);
        handler.areas().wait_cycle().unwrap();
    }
    txt.with_machine(|machine| assert_eq!(machine.controllers[0].outputs.duty[0], 512));
    assert_eq!(handler.areas().statistics().gaps, 0);
    handler.end_transfer().unwrap();
    check_client(&txt);
    assert_eq!(find(&[address(&txt)], DEADLINE).unwrap().controllers.len(), 1);
}

#[test]
fn what_happened_is_told_for_each_address_in_order() {
    let (free, used) = (named("free").start().unwrap(), unpaced().start().unwrap());
    let handler = handler_for(&used).build().unwrap();
    handler.begin_transfer().unwrap();
    let addresses = [address(&used), REFUSES.to_owned(), address(&free)];
    let answers = find(&addresses, LIMIT).unwrap();
    let [in_use, refused] = &answers.others[..] else { panic!("{answers:?}") };
    assert_eq!((&in_use.address, in_use.perhaps_in_use), (&addresses[0], true));
    assert_eq!((&refused.address, refused.perhaps_in_use), (&addresses[1], false));
    assert_eq!(answers.controllers[0].name, "free");
    handler.end_transfer().unwrap();
}

#[test]
fn without_addresses_no_controller_is_found() {
    let error = find(&[""; 0], LIMIT).unwrap_err();
    assert_eq!(error, Error::NoController { tried: vec![] });
    assert!(error.to_string().starts_with("no controller was found; switch the TXT on"), "{error}");
}

#[test]
fn auto_is_the_controller_that_is_found_and_stays_the_same_one() {
    let close = Fault::at_exchange(5, FaultKind::Close { after: 0 });
    let txt = SimulatedTxt::builder().fault(close).start().unwrap();
    let builder = TransferAreaComHandler::builder(format!("auto:{}", txt.port()));
    let builder = builder.i2c_port(txt.i2c_port()).reconnect(Duration::from_secs(30));
    let handler = builder.build().unwrap();
    handler.begin_transfer().unwrap();
    while handler.areas().wait_cycle().is_ok() {}
    drop(handler.areas().wait_cycle().unwrap());
    assert_eq!(handler.areas().statistics().gaps, 1);
    // One for the search, one for the transfer, and one to reconnect without another search.
    txt.with_machine(|machine| assert_eq!(machine.connections(), 3));
    // Another search would find nothing, because the controller serves the transfer.
    handler.i2c().unwrap();
    handler.end_transfer().unwrap();
}

#[test]
fn auto_begins_no_transfer_without_a_controller() {
    // No server gets this port by chance.
    let builder = TransferAreaComHandler::builder("auto:1");
    let error = builder.build().unwrap().begin_transfer().unwrap_err();
    assert!(matches!(error, Error::NoController { .. }), "{error}");
}
