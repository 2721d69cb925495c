//! The client over a scripted connection: bytes that come in, fail to come in or are interrupted in
//! every way, with exact times.

use std::io::ErrorKind;
use std::time::Duration;

use super::scripted::{at_once, storm, Event, Script, Scripted, ScriptedNetwork, LIMITS, NO_WAIT};
use super::TxtClient;
use crate::error::Error;
use crate::firmware::FirmwareVersion;
use crate::wire::{CommandId, QueryStatusResponse, ResponseId, UpdateConfig};

const QUERY: &str = "QueryStatus";

fn ms(time: u64) -> Duration {
    Duration::from_millis(time)
}

/// The right response to QueryStatus.
fn response() -> Vec<u8> {
    let mut bytes = Vec::new();
    QueryStatusResponse { device_name: [b'x'; 16], version: FirmwareVersion::new(4, 7, 0) }
        .emit(&mut bytes);
    bytes
}

/// A client with these scripts, and the handle to its transport.
fn client(reads: Script, writes: Script) -> (TxtClient, Scripted) {
    let transport = Scripted::new(reads, writes);
    let network = ScriptedNetwork::new([Ok(transport.clone())]);
    (TxtClient::connect_within(network, "txt", 65_000, LIMITS).unwrap(), transport)
}

/// The result of QueryStatus, and how long it took.
fn query(reads: Script, writes: Script) -> (Result<(), Error>, Duration) {
    let (mut client, transport) = client(reads, writes);
    let result = client.query_status().map(drop);
    if let Err(error) = &result {
        assert_eq!(client.query_status(), Err(error.clone()), "it stays broken");
    }
    let time = transport.state().time;
    (result, time)
}

fn no_answer(received: usize) -> Result<(), Error> {
    Err(Error::NoAnswer { command: QUERY, limit: LIMITS.read, received })
}

fn not_taken() -> Result<(), Error> {
    Err(Error::NotTaken { command: QUERY, limit: LIMITS.write })
}

fn closed(received: usize) -> Result<(), Error> {
    Err(Error::ConnectionClosed { command: QUERY, received })
}

#[test]
fn silence_ends_with_the_limit_for_reading() {
    assert_eq!(query(vec![], vec![]), (no_answer(0), LIMITS.read));
    // Windows has another kind of error for it.
    let (result, _) = query(at_once([Event::Error(ErrorKind::TimedOut)]), vec![]);
    assert_eq!(result, no_answer(0));
}

#[test]
fn silence_in_a_storm_of_signals_ends_with_the_limit_for_reading() {
    assert_eq!(query(storm(), vec![]), (no_answer(0), LIMITS.read));
}

#[test]
fn a_part_of_a_response_in_a_storm_of_signals_ends_with_the_limit_for_reading() {
    let mut reads = storm();
    reads.insert(1, (ms(50), Event::Bytes(response()[..7].to_vec())));
    assert_eq!(query(reads, vec![]), (no_answer(7), LIMITS.read));
}

#[test]
fn a_response_after_signals_is_taken() {
    let mut reads = storm();
    reads[2] = (ms(99), Event::Bytes(response()));
    assert_eq!(query(reads, vec![]), (Ok(()), ms(299)));
}

#[test]
fn the_limit_for_reading_is_for_all_pieces_of_a_response() {
    let piece = |byte: u8| (ms(70), Event::Bytes(vec![byte]));
    let reads = response().into_iter().map(piece).collect();
    assert_eq!(query(reads, vec![]), (no_answer(4), LIMITS.read));
}

#[test]
fn a_response_is_put_together_from_single_bytes() {
    let reads = response().into_iter().map(|byte| (ms(1), Event::Bytes(vec![byte]))).collect();
    assert_eq!(query(reads, vec![]), (Ok(()), ms(24)));
}

#[test]
fn a_response_that_ends_early_is_a_closed_connection() {
    for received in 0..response().len() {
        let mut reads = at_once([Event::Bytes(response()[..received].to_vec()), Event::End]);
        if received == 0 {
            reads.remove(0);
        }
        assert_eq!(query(reads, vec![]), (closed(received), NO_WAIT));
    }
}

#[test]
fn a_reset_is_a_closed_connection_and_other_failures_are_reported_as_they_are() {
    use ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, HostUnreachable};
    let broken = |kind: ErrorKind| {
        Err(Error::Io { command: QUERY, cause: std::io::Error::from(kind).into() })
    };
    for kind in [ConnectionReset, ConnectionAborted, BrokenPipe] {
        let reads = at_once([Event::Bytes(response()[..9].to_vec()), Event::Error(kind)]);
        assert_eq!(query(reads, vec![]).0, closed(9));
        assert_eq!(query(vec![], at_once([Event::Error(kind)])).0, closed(0));
    }
    let failure = || at_once([Event::Error(HostUnreachable)]);
    assert_eq!(query(failure(), vec![]).0, broken(HostUnreachable));
    assert_eq!(query(vec![], failure()).0, broken(HostUnreachable));
    assert_eq!(query(vec![], at_once([Event::Room(0)])).0, broken(ErrorKind::WriteZero));
}

#[test]
fn a_wrong_id_is_an_error_after_its_four_bytes() {
    let packet = "QueryStatus response";
    let mut bytes = response();
    bytes[3] ^= 1;
    let error = Error::WrongId { packet, expected: 0xBAC9_723E, found: 0xBBC9_723E };
    for count in [4, 24] {
        let reads = at_once([Event::Bytes(bytes[..count].to_vec())]);
        assert_eq!(query(reads, vec![]), (Err(error.clone()), NO_WAIT));
    }
}

#[test]
fn bytes_after_a_response_are_a_wrong_size() {
    let mut bytes = response();
    bytes.extend([1, 2]);
    let packet = "QueryStatus response";
    let error = Error::WrongSize { packet, expected: 24, found: 26 };
    assert_eq!(query(at_once([Event::Bytes(bytes)]), vec![]), (Err(error), NO_WAIT));
}

#[test]
fn a_command_that_is_not_taken_ends_with_the_limit_for_writing() {
    let stuck = || (Duration::MAX, Event::Room(1));
    assert_eq!(query(vec![], vec![stuck()]), (not_taken(), LIMITS.write));
    // The limit is for the whole command.
    let writes = vec![(ms(150), Event::Room(2)), stuck()];
    assert_eq!(query(vec![], writes), (not_taken(), LIMITS.write));
    let (result, _) = query(vec![], at_once([Event::Error(ErrorKind::TimedOut)]));
    assert_eq!(result, not_taken());
}

#[test]
fn a_command_that_is_not_taken_in_a_storm_of_signals_ends_with_the_limit_for_writing() {
    assert_eq!(query(vec![], storm()), (not_taken(), LIMITS.write));
}

#[test]
fn a_command_is_sent_once_even_in_pieces_and_with_signals() {
    let reads = at_once([Event::Bytes(response())]);
    let signal = Event::Error(ErrorKind::Interrupted);
    let writes = at_once([signal.clone(), Event::Room(1), signal, Event::Room(2), Event::Room(9)]);
    let (mut client, transport) = client(reads, writes);
    client.query_status().unwrap();
    assert_eq!(transport.state().written, CommandId::QueryStatus.id().to_le_bytes());
}

/// The limits are the ones that the transport was made with, so it sets none in the operating system.
#[test]
fn a_response_in_one_piece_takes_one_call_in_each_direction_with_the_whole_limits() {
    let mut reads = at_once([Event::Bytes(response()), Event::Bytes(response())]);
    // Time passes between the calls, too.
    reads[1].0 = ms(10);
    let (mut client, transport) = client(reads, vec![]);
    client.query_status().unwrap();
    client.query_status().unwrap();
    let state = transport.state();
    assert_eq!(state.read_limits, [LIMITS.read; 2]);
    assert_eq!(state.write_limits, [LIMITS.write; 2]);
}

#[test]
fn a_response_in_pieces_leaves_the_next_one_its_whole_time() {
    let (first, second) = (response()[..10].to_vec(), response()[10..].to_vec());
    let reads = vec![
        (ms(200), Event::Bytes(first)),
        (ms(50), Event::Bytes(second)),
        (ms(299), Event::Bytes(response())),
    ];
    let (mut client, transport) = client(reads, vec![]);
    client.query_status().unwrap();
    client.query_status().unwrap();
    assert_eq!(transport.state().read_limits, [LIMITS.read, ms(100), LIMITS.read]);
}

#[test]
fn an_error_that_the_caller_can_correct_leaves_the_connection_usable() {
    let mut start = Vec::new();
    ResponseId::StartOnline.emit(&mut start);
    let (mut client, transport) = client(at_once([Event::Bytes(start)]), vec![]);
    let update = UpdateConfig { config_id: 1, extension_id: 0, config: Default::default() };
    assert_eq!(client.update_config(&update), Err(Error::NotOnline { command: "UpdateConfig" }));
    assert!(transport.state().written.is_empty());
    client.start_online().unwrap();
}

/// What was sent on an abandoned connection, whether the stream was ended, and how long it took.
fn abandon(reads: Script, writes: Script) -> (Vec<u8>, bool, Duration) {
    let (mut client, transport) = client(reads, writes);
    client.abandon(&[1, 2, 3]);
    let state = transport.state();
    (state.written.clone(), state.ended, state.time)
}

fn last_words() -> Vec<u8> {
    let mut bytes = vec![1, 2, 3];
    CommandId::StopOnline.emit(&mut bytes);
    bytes
}

#[test]
fn an_abandoned_connection_is_read_until_the_other_side_closes() {
    let mut reads = at_once([Event::Bytes(vec![0; 3000]), Event::Bytes(response()), Event::End]);
    reads[2].0 = ms(20);
    assert_eq!(abandon(reads, vec![]), (last_words(), true, ms(20)));
}

#[test]
fn signals_do_not_cut_the_last_bytes_of_an_abandoned_connection_short() {
    let signal = || (ms(10), Event::Error(ErrorKind::Interrupted));
    let writes = vec![signal(), (ms(10), Event::Room(5)), signal()];
    let reads = vec![signal(), (ms(10), Event::Bytes(response())), signal(), (ms(10), Event::End)];
    assert_eq!(abandon(reads, writes), (last_words(), true, ms(70)));
}

#[test]
fn an_abandoned_connection_takes_half_a_second_at_most() {
    let limit = ms(500);
    assert_eq!(abandon(vec![], vec![]), (last_words(), true, limit));
    assert_eq!(abandon(storm(), vec![]), (last_words(), true, limit));
    let endless = vec![(ms(30), Event::Bytes(vec![0; 2000])); 100];
    assert_eq!(abandon(endless, vec![]), (last_words(), true, limit));
    assert_eq!(abandon(vec![], storm()), (vec![], false, limit));
    let slow = vec![(ms(400), Event::Room(5)), (ms(50), Event::Room(5))];
    assert_eq!(abandon(storm(), slow), (last_words(), true, limit));
}

#[test]
fn an_abandoned_connection_that_takes_no_bytes_is_left_immediately() {
    let writes = at_once([Event::Error(ErrorKind::BrokenPipe)]);
    assert_eq!(abandon(vec![], writes), (vec![], false, NO_WAIT));
}

/// In place of the tests in `signals.rs`, and of the one for the camera.
#[cfg(not(unix))]
#[test]
#[ignore = "only Unix has signals that interrupt a call"]
fn limits_hold_in_a_storm_of_real_signals() {}

/// The addresses to which a client of this port has connected, in a session that ends with StopOnline.
fn connections_of_a_session(port: u16) -> Vec<String> {
    let answers = [ResponseId::StartOnline, ResponseId::StopOnline].map(|id| {
        let mut bytes = Vec::new();
        id.emit(&mut bytes);
        Event::Bytes(bytes)
    });
    let network = ScriptedNetwork::new([Ok(Scripted::new(at_once(answers), vec![]))]);
    let mut client = TxtClient::connect_within(network, "txt", port, LIMITS).unwrap();
    client.start_online().unwrap();
    let before = network.asked().len();
    client.stop_online().unwrap();
    network.asked().split_off(before).into_iter().map(|(address, _)| address).collect()
}

#[test]
fn a_short_session_ends_the_wait_of_the_i2c_server_and_needs_none() {
    let [i2c] = &connections_of_a_session(65_000)[..] else { panic!("not one connection") };
    assert!(i2c.ends_with(":65002"), "{i2c}");
    assert_eq!(connections_of_a_session(4000), [""; 0]);
}
