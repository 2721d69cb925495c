//! The host `auto`, which only tests in here can use: in them it searches at 127.0.0.1 only.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener};

use super::*;
use crate::client::scripted::{at_once, Event, Scripted, ScriptedNetwork, LIMITS};
use crate::firmware::FirmwareVersion;
use crate::wire::QueryStatusResponse;

/// Longer than anything takes on a busy machine.
const AMPLE: Duration = Duration::from_secs(30);

/// Answers QueryStatus, once on each connection.
fn answer(listener: &TcpListener, connections: usize) {
    for _ in 0..connections {
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; 4];
        stream.read_exact(&mut request).unwrap();
        stream.write_all(&response()).unwrap();
    }
}

/// The response to QueryStatus.
fn response() -> Vec<u8> {
    let mut device_name = [0; 16];
    device_name[..3].copy_from_slice(b"TXT");
    let mut response = Vec::new();
    QueryStatusResponse { device_name, version: FirmwareVersion::new(4, 6, 6) }.emit(&mut response);
    response
}

/// A connection on which these bytes come in, and then the end.
fn sending(bytes: Vec<u8>) -> Scripted {
    Scripted::new(at_once([Event::Bytes(bytes), Event::End]), vec![])
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
        let mut client = TxtClient::connect(format!("auto:{port}"), TimeLimits::default()).unwrap();
        assert_eq!(client.query_status().unwrap().name(), "TXT");
        scope.spawn(|| answer(&listener, 1));
        let host = found_host(&TCP, "auto", port, AMPLE);
        assert_eq!(host, Ok("127.0.0.1".to_owned()));
    });
}

#[test]
fn every_way_to_write_an_address_is_understood() {
    for (given, address) in [
        ("192.168.7.2", "192.168.7.2:65000"),
        ("192.168.7.2:4000", "192.168.7.2:4000"),
        ("localhost:4000", "127.0.0.1:4000"),
        ("::1", "[::1]:65000"),
        ("[::1]", "[::1]:65000"),
        ("[::1]:4000", "[::1]:4000"),
    ] {
        assert_eq!(controller_address(given, AMPLE), Ok(address.parse().unwrap()), "{given}");
    }
    for given in ["", ":4000", "[::1", "192.168.7.2:", "192.168.7.2:x", "192.168.7.2:0"] {
        let error = controller_address(given, AMPLE).unwrap_err();
        assert_eq!(error, Error::BadAddress { given: given.to_owned() });
    }
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    for auto in ["auto", "AUTO"] {
        thread::scope(|scope| {
            scope.spawn(|| answer(&listener, 1));
            let given = format!("{auto}:{}", address.port());
            assert_eq!(controller_address(&given, AMPLE), Ok(address));
        });
    }
}

#[test]
fn auto_without_a_controller_lists_the_addresses_and_what_to_check() {
    // No server gets this port by chance.
    let error = TxtClient::connect("auto:1", TimeLimits::default()).unwrap_err();
    let tried = TriedAddress {
        address: "127.0.0.1:1".to_owned(),
        connection: ConnectionKind::SameMachine,
        outcome: "nothing listens there".to_owned(),
        perhaps_in_use: false,
    };
    assert_eq!(error, Error::NoController { tried: vec![tried] });
    let text = error.to_string();
    let lines: Vec<_> = text.lines().collect();
    let [sentence, address, check] = lines[..] else { panic!("{text}") };
    // It fits on a line of a terminal, and names what to try.
    assert!(sentence.len() <= 110 && sentence.ends_with("`txt simulate`"), "{sentence}");
    assert_eq!(address, "  127.0.0.1:1 (this machine): nothing listens there");
    assert!(check.contains("no other program may use it"), "{check}");
}

#[test]
fn auto_with_several_controllers_lists_them_and_takes_none() {
    let usb = found("192.168.7.2:65000", ConnectionKind::Usb);
    let here = found("127.0.0.1:65000", ConnectionKind::SameMachine);
    let of = |controllers, others| only(FoundControllers { controllers, others });
    assert_eq!(of(vec![usb.clone()], Vec::new()), Ok(usb.clone()));
    let error = of(vec![usb.clone(), here.clone()], Vec::new()).unwrap_err();
    let expected = Error::SeveralControllers { found: vec![usb, here.clone()], in_use: Vec::new() };
    assert_eq!(error, expected);
    let sentence = error.to_string();
    assert!(sentence.contains("TXT with firmware 4.6.6 at 192.168.7.2:65000 (USB)"), "{sentence}");

    // One that a program uses does not answer, and may be the one that is meant.
    let tried = |perhaps_in_use| TriedAddress {
        address: "192.168.7.2:65000".to_owned(),
        connection: ConnectionKind::Usb,
        outcome: "no answer".to_owned(),
        perhaps_in_use,
    };
    assert_eq!(of(vec![here.clone()], vec![tried(false)]), Ok(here.clone()));
    let sentence = of(vec![here], vec![tried(true)]).unwrap_err().to_string();
    assert!(
        sentence
            .contains("perhaps another controller, which a program uses: 192.168.7.2:65000 (USB)"),
        "{sentence}"
    );
}

#[test]
fn any_other_host_is_itself_without_a_search() {
    let network = ScriptedNetwork::new([]);
    assert_eq!(found_host(network, "127.0.0.1", PORT, AMPLE), Ok("127.0.0.1".to_owned()));
    assert_eq!(network.asked(), []);
}

#[test]
fn auto_is_connected_to_at_the_address_that_has_answered() {
    let network = ScriptedNetwork::new([Ok(sending(response())), Ok(sending(response()))]);
    let mut client = TxtClient::connect_within(network, "Auto", PORT, LIMITS).unwrap();
    assert_eq!(client.query_status().unwrap().name(), "TXT");
    let asked: Vec<_> = network.asked().into_iter().map(|(address, _)| address).collect();
    assert_eq!(asked, ["127.0.0.1:65000", "192.168.7.2:65000"]);
}

#[test]
fn a_search_says_what_happened_at_an_address() {
    let address = || "txt:65000".to_owned();
    let reset = std::io::Error::from(std::io::ErrorKind::NetworkUnreachable);
    let silent = Scripted::new(vec![], vec![]);
    let mut no_txt = response();
    no_txt[0] ^= 1;
    for (opening, outcome, perhaps_in_use) in [
        (Err(Error::ConnectionRefused { address: address() }), "nothing listens there", false),
        (
            Err(Error::ConnectTimedOut { address: address(), limit: AMPLE }),
            "no answer within",
            false,
        ),
        (
            Err(Error::LookupTimedOut { host: address(), limit: AMPLE }),
            "address was not found",
            false,
        ),
        (
            Err(Error::ConnectFailed { address: address(), cause: reset.into() }),
            "unreachable",
            false,
        ),
        (Ok(silent), "another program may be using it", true),
        (Ok(sending(vec![])), "it may be in use", true),
        (Ok(sending(response()[..7].to_vec())), "it may be in use", true),
        (Ok(sending(no_txt)), "what answers is not a TXT", false),
    ] {
        let network = ScriptedNetwork::new([opening]);
        let error = find_at(network, &["txt".to_owned()], AMPLE).unwrap_err();
        let Error::NoController { tried } = error else { panic!("{error}") };
        assert!(tried[0].outcome.contains(outcome), "{tried:?}");
        assert_eq!(tried[0].perhaps_in_use, perhaps_in_use, "{tried:?}");
        assert_eq!(
            network.asked(),
            [(address(), TimeLimits { connect: AMPLE, read: AMPLE, write: AMPLE })]
        );
    }
    let network = ScriptedNetwork::new([Ok(sending(response()))]);
    let expected = found("192.168.7.2:65000", ConnectionKind::Usb);
    assert_eq!(find_at(network, &["txt".to_owned()], AMPLE).unwrap().controllers, [expected]);
}

#[test]
fn a_controller_that_is_this_machine_is_found_once() {
    let here = found("127.0.0.1:65000", ConnectionKind::SameMachine);
    let by_usb = found("192.168.7.2:65000", ConnectionKind::SameMachine);
    let other = found("192.168.8.2:65000", ConnectionKind::Wifi);
    let all = vec![by_usb.clone(), other.clone(), here.clone()];
    assert_eq!(without_doubles(all), [other.clone(), here]);
    assert_eq!(without_doubles(vec![by_usb.clone(), other.clone()]), [by_usb, other]);
}

#[test]
fn the_kind_of_a_connection_follows_from_its_two_addresses() {
    let kind = |own: &str, peer: &str| connection_kind(own.parse().unwrap(), peer.parse().unwrap());
    assert_eq!(kind("192.168.7.1", "192.168.7.2"), ConnectionKind::Usb);
    assert_eq!(kind("192.168.7.2", "192.168.7.2"), ConnectionKind::SameMachine);
    assert_eq!(kind("192.168.8.3", "192.168.8.2"), ConnectionKind::Wifi);
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
    let tried = ask(&TCP, &address.to_string(), limit).unwrap_err();
    assert!(begin.elapsed() >= limit && begin.elapsed() < AMPLE);
    assert!(tried.outcome.contains("did not answer within 200ms"), "{tried}");
    let (mut stream, _) = listener.accept().unwrap();
    let mut asked = Vec::new();
    stream.read_to_end(&mut asked).unwrap();
    assert_eq!(asked.len(), 4, "it asks once and closes");
}
