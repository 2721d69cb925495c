//! The host `auto`, which only tests in here can use: in them it searches at 127.0.0.1 only.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener};

use super::*;
use crate::client::TxtClient;
use crate::firmware::FirmwareVersion;

/// Longer than anything takes on a busy machine.
const AMPLE: Duration = Duration::from_secs(30);

/// Answers QueryStatus, once on each connection.
fn answer(listener: &TcpListener, connections: usize) {
    for _ in 0..connections {
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; 4];
        stream.read_exact(&mut request).unwrap();
        let mut device_name = [0; 16];
        device_name[..3].copy_from_slice(b"TXT");
        let mut response = Vec::new();
        QueryStatusResponse { device_name, version: FirmwareVersion::new(4, 6, 6) }
            .emit(&mut response);
        stream.write_all(&response).unwrap();
    }
}

fn found(address: &str, connection: ConnectionKind) -> FoundController {
    FoundController {
        address: address.parse().unwrap(),
        connection,
        name: "TXT".to_owned(),
        firmware: FirmwareVersion::new(4, 6, 6),
    }
}

#[test]
fn auto_is_the_only_controller_that_is_found() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::scope(|scope| {
        // One for the search, one for the client.
        scope.spawn(|| answer(&listener, 2));
        let mut client = TxtClient::connect("auto", port, TimeLimits::default()).unwrap();
        assert_eq!(client.query_status().unwrap().name(), "TXT");
        scope.spawn(|| answer(&listener, 1));
        let host = found_host("auto", port, AMPLE);
        assert_eq!(host, Ok("127.0.0.1".to_owned()));
    });
}

#[test]
fn auto_without_a_controller_lists_the_addresses_and_what_to_check() {
    // No server gets this port by chance.
    let error = TxtClient::connect("auto:1", PORT, TimeLimits::default()).unwrap_err();
    let tried = TriedAddress {
        address: "127.0.0.1:1".to_owned(),
        connection: ConnectionKind::SameMachine,
        outcome: "nothing listens there".to_owned(),
        perhaps_in_use: false,
    };
    assert_eq!(error, Error::NoController { tried: vec![tried] });
    let sentence = error.to_string();
    assert!(sentence.contains("127.0.0.1:1 (this machine): nothing listens there"), "{sentence}");
    assert!(sentence.contains("check that the TXT is switched on"), "{sentence}");
}

#[test]
fn auto_with_several_controllers_lists_them_and_takes_none() {
    let usb = found("192.168.7.2:65000", ConnectionKind::Usb);
    let here = found("127.0.0.1:65000", ConnectionKind::SameMachine);
    assert_eq!(only(vec![usb.clone()]), Ok(usb.clone()));
    let error = only(vec![usb.clone(), here.clone()]).unwrap_err();
    assert_eq!(error, Error::SeveralControllers { found: vec![usb, here] });
    let sentence = error.to_string();
    assert!(sentence.contains("TXT with firmware 4.6.6 at 192.168.7.2:65000 (USB)"), "{sentence}");
}

#[test]
fn any_other_host_is_itself_without_a_search() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    listener.set_nonblocking(true).unwrap();
    assert_eq!(found_host("127.0.0.1", port, AMPLE), Ok("127.0.0.1".to_owned()));
    assert!(listener.accept().is_err());
}

#[test]
fn a_controller_that_is_this_machine_is_found_once() {
    let here = found("127.0.0.1:65000", ConnectionKind::SameMachine);
    let by_usb = found("192.168.7.2:65000", ConnectionKind::SameMachine);
    let other = found("192.168.8.2:65000", ConnectionKind::Wlan);
    let all = vec![by_usb.clone(), other.clone(), here.clone()];
    assert_eq!(without_doubles(all), [other.clone(), here]);
    assert_eq!(without_doubles(vec![by_usb.clone(), other.clone()]), [by_usb, other]);
}

#[test]
fn the_kind_of_a_connection_follows_from_its_two_addresses() {
    let kind = |own: &str, peer: &str| connection_kind(own.parse().unwrap(), peer.parse().unwrap());
    assert_eq!(kind("192.168.7.1", "192.168.7.2"), ConnectionKind::Usb);
    assert_eq!(kind("192.168.7.2", "192.168.7.2"), ConnectionKind::SameMachine);
    assert_eq!(kind("192.168.8.3", "192.168.8.2"), ConnectionKind::Wlan);
    assert_eq!(kind("192.168.9.3", "192.168.9.2"), ConnectionKind::Bluetooth);
    assert_eq!(kind("10.0.0.1", "10.0.0.2"), ConnectionKind::Network);
    assert_eq!(kind("127.0.0.1", "127.0.0.1"), ConnectionKind::SameMachine);
    assert_eq!(kind("fe80::1", "fe80::2"), ConnectionKind::Network);
}

#[test]
fn a_host_that_accepts_the_connection_and_does_not_answer_takes_only_the_limit() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address: SocketAddr = listener.local_addr().unwrap();
    let limit = Duration::from_millis(200);
    let begin = Instant::now();
    let tried = ask(&address.to_string(), limit).unwrap_err();
    assert!(begin.elapsed() >= limit && begin.elapsed() < AMPLE);
    assert!(tried.outcome.contains("did not answer within 200ms"), "{tried}");
    let (mut stream, _) = listener.accept().unwrap();
    let mut asked = Vec::new();
    stream.read_to_end(&mut asked).unwrap();
    assert_eq!(asked.len(), 4, "it asks once and closes");
}
