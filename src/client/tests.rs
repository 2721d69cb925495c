//! The client over a scripted connection: bytes that come in, fail to come in or are interrupted in
//! every way, with exact times.

use std::io::{ErrorKind, Read};
use std::net::TcpListener;
use std::thread;
use std::time::Duration;

use super::i2c_line::{I2cLine, I2cSession};
use super::limits::SHORTEST_LIMIT;
use super::scripted::{at_once, storm, Event, Script, Scripted, ScriptedNetwork, LIMITS, NO_WAIT};
use super::{Endpoint, TimeLimits, TxtClient, TCP};
use crate::error::Error;
use crate::exchange::{Exchange, TransferMode};
use crate::firmware::FirmwareVersion;
use crate::i2c::I2cClient;
use crate::transfer_area::FishX1Transfer;
use crate::wire::{
    CmprHeader, CommandId, Compressor, I2cResponseHeader, QueryStatusResponse, ResponseId,
    UpdateConfig,
};

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
    assert_eq!(query(storm(), vec![]), (no_answer(0), LIMITS.read + SHORTEST_LIMIT));
}

#[test]
fn a_response_that_came_while_the_program_was_suspended_beyond_the_limit_is_in_time() {
    let suspended = || Event::Suspended(ms(3_000));
    let reads = at_once([suspended(), Event::Bytes(response())]);
    assert_eq!(query(reads, vec![]), (Ok(()), ms(3_000)));
    let nothing = query(at_once([suspended()]), vec![]);
    assert_eq!(nothing, (no_answer(0), ms(3_000) + SHORTEST_LIMIT));
    // Only what came meanwhile.
    let part = Event::Bytes(response()[..7].to_vec());
    let reads = vec![
        (NO_WAIT, suspended()),
        (NO_WAIT, part),
        (NO_WAIT, Event::Bytes(response()[7..].to_vec())),
    ];
    assert_eq!(query(reads, vec![]), (no_answer(7), ms(3_000)));
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

/// The firmware would take the last bytes as the rest of the command, and close the connection.
#[test]
fn the_rest_of_a_command_that_was_not_taken_comes_before_the_last_bytes() {
    let stuck = || (LIMITS.write, Event::Error(ErrorKind::TimedOut));
    let query_and_last_words =
        [&CommandId::QueryStatus.id().to_le_bytes()[..], &last_words()].concat();
    for writes in [vec![(NO_WAIT, Event::Room(1)), stuck()], vec![stuck()]] {
        let (mut client, transport) = client(vec![], writes);
        assert_eq!(client.query_status().map(drop), not_taken());
        // No other command follows.
        assert_eq!(client.stop_online(), not_taken());
        assert!(transport.state().written.len() <= 1);
        client.abandon(&[1, 2, 3]);
        assert_eq!(transport.state().written, query_and_last_words);
    }
    // A command that was taken is not sent again.
    let (mut client, transport) = client(vec![], vec![]);
    assert_eq!(client.query_status().map(drop), no_answer(0));
    client.abandon(&[1, 2, 3]);
    assert_eq!(transport.state().written, query_and_last_words);
}

/// In place of the tests in `signals.rs`, and of the one for the camera.
#[cfg(not(unix))]
#[test]
#[ignore = "only Unix has signals that interrupt a call"]
fn limits_hold_in_a_storm_of_real_signals() {}

/// A client of this port whose connections are scripted: the main one answers StartOnline and StopOnline, and the I2C
/// one has this script.
fn client_with_i2c(port: u16, i2c: Script) -> (TxtClient, Scripted, &'static ScriptedNetwork) {
    let answers = [ResponseId::StartOnline, ResponseId::StopOnline].map(|id| {
        let mut bytes = Vec::new();
        id.emit(&mut bytes);
        Event::Bytes(bytes)
    });
    let main = Scripted::new(at_once(answers), vec![]);
    let i2c = Scripted::new(i2c, vec![]);
    let network = ScriptedNetwork::new([Ok(main), Ok(i2c.clone())]);
    (TxtClient::connect_within(network, "txt", port, LIMITS).unwrap(), i2c, network)
}

/// The ports to which a client has connected.
fn ports(network: &ScriptedNetwork) -> Vec<String> {
    let port = |address: &str| address.rsplit(':').next().map(str::to_owned);
    network.asked().iter().filter_map(|(address, _)| port(address)).collect()
}

#[test]
fn the_i2c_connection_is_open_from_start_online_to_stop_online() {
    let (mut client, i2c, network) = client_with_i2c(65_000, vec![]);
    assert_eq!(ports(network), ["65000"]);
    client.start_online().unwrap();
    assert_eq!(ports(network), ["65000", "65002"]);
    assert!(!i2c.is_closed());
    client.stop_online().unwrap();
    assert!(i2c.is_closed());
    assert!(i2c.state().written.is_empty());
    let error = Error::NotOnline { command: "an I2C request" };
    assert_eq!(client.i2c().read(0x18, 0, &mut [0]), Err(error));
    assert_eq!(ports(network).len(), 2);
}

#[test]
fn another_port_of_a_link_local_address_is_reached_by_the_same_interface() {
    let main = Scripted::new(at_once([Event::Bytes(response())]), vec![]);
    main.state().peer = "[fe80::1%3]:65000".parse().unwrap();
    let network = ScriptedNetwork::new([Ok(main)]);
    let client = TxtClient::connect_within(network, "txt", 65_000, LIMITS).unwrap();
    assert_eq!(client.other_port(65_001).to_string(), "fe80::1%3:65001");
}

#[test]
fn a_controller_without_i2c_is_no_error_and_another_port_is_left_alone_until_a_request() {
    let (mut client, _, network) = client_with_i2c(65_000, vec![]);
    network.refuse_next();
    client.start_online().unwrap();
    let (mut client, i2c, network) = client_with_i2c(4000, vec![]);
    client.start_online().unwrap();
    assert_eq!(ports(network), ["4000"]);
    client.i2c().read(0x18, 0, &mut [0]).unwrap_err();
    assert_eq!(ports(network), ["4000", "4002"]);
    assert!(!i2c.state().written.is_empty());
}

#[test]
fn a_client_that_is_dropped_or_goes_online_again_closes_its_i2c_connection() {
    let (mut client, i2c, _) = client_with_i2c(65_000, vec![]);
    client.start_online().unwrap();
    drop(client);
    assert!(i2c.is_closed());
    let (mut client, i2c, _) = client_with_i2c(65_000, vec![]);
    client.start_online().unwrap();
    client.start_online().unwrap_err();
    assert!(i2c.is_closed());
    let (mut client, i2c, _) = client_with_i2c(65_000, vec![]);
    client.start_online().unwrap();
    client.abandon(&[]);
    assert!(i2c.is_closed());
}

/// The ids of configurations that are sent for these.
fn sent_config_ids(ids: &[i16]) -> Vec<i16> {
    let mut answers = vec![ResponseId::StartOnline];
    answers.resize(1 + ids.len(), ResponseId::UpdateConfig);
    let answer = |id: ResponseId| {
        let mut bytes = Vec::new();
        id.emit(&mut bytes);
        (NO_WAIT, Event::Bytes(bytes))
    };
    let (mut client, transport) = client(answers.into_iter().map(answer).collect(), vec![]);
    client.start_online().unwrap();
    let start = transport.state().written.len();
    for id in ids {
        let update = UpdateConfig { config_id: *id, extension_id: 0, config: Default::default() };
        client.update_config(&update).unwrap();
    }
    let written = transport.state().written.split_off(start);
    let updates = written.chunks(UpdateConfig::LEN);
    updates.map(|bytes| UpdateConfig::parse(bytes).unwrap().config_id).collect()
}

/// The firmware looks at the low byte, which is 0 after StartOnline.
#[test]
fn a_configuration_has_an_id_that_the_firmware_notices() {
    assert_eq!(sent_config_ids(&[1, 2, 3, 1, 0]), [1, 2, 3, 1, 0]);
    assert_eq!(sent_config_ids(&[0]), [0x80]);
    assert_eq!(sent_config_ids(&[256, 1, 257]), [256 ^ 0x80, 1, 257 ^ 0x80]);
    assert_eq!(sent_config_ids(&[5, 5, 5]), [5, 0x85, 5]);
}

/// The firmware closes the connection when a request comes in pieces.
#[test]
fn the_longest_request_is_one_write_that_fits_a_segment() {
    /// What IPv6 lets through everywhere, without the headers of IP and TCP.
    const SEGMENT: usize = 1280 - 60;
    let mut areas = vec![FishX1Transfer::default(); 9];
    let mut exchange = Exchange::new(TransferMode::Compressed, FirmwareVersion::new(4, 7, 0));
    let all = 0xFF;
    let mut response = Vec::new();
    let mut data = Vec::new();
    let crc = Compressor::new().compress(&[0; 9 * 52], &mut data);
    CmprHeader { extra_size: data.len() as u32, crc, active_extensions: all }
        .emit_response(&mut response);
    response.extend(data);
    exchange.receive(&response).unwrap();
    for (number, area) in (1..).zip(&mut areas) {
        // No word is 0, or as the one before or after it.
        *area.output.duty = std::array::from_fn(|index| number + 2 * index as i16);
        *area.output.distance = [1000, 2000, 3000, 4000];
        *area.output.master = [1, 2, 3, 4];
        *area.output.motor_ex_cmd_id = [11, 22, 33, 44];
        *area.output.cnt_reset_cmd_id = [55, 66, 77, 88];
        (area.txt_outputs.sound_cmd_id, area.txt_outputs.sound_index) = (9, 8);
        area.txt_outputs.sound_repeat = 7;
    }
    let mut start = Vec::new();
    ResponseId::StartOnline.emit(&mut start);
    let (mut client, transport) = client(at_once([start, response].map(Event::Bytes)), vec![]);
    client.start_online().unwrap();
    transport.state().write_limits.clear();
    let before = transport.state().written.len();
    client.exchange(&mut exchange, &areas).unwrap();
    let size = transport.state().written.len() - before;
    assert_eq!(transport.state().write_limits.len(), 1);
    assert!((500..=SEGMENT).contains(&size), "{size} bytes");
}

/// A line in a session, over a connection with this script.
fn line(i2c: Script) -> (I2cLine, I2cSession, Scripted) {
    let i2c = Scripted::new(i2c, vec![]);
    let network = ScriptedNetwork::new([Ok(i2c.clone())]);
    let line = I2cLine::default();
    let session = line.begin(network.endpoint(), LIMITS, true);
    (line, session, i2c)
}

/// The firmware's response to a request for nothing.
const NOTHING: [u8; 12] = [0x87, 0xFD, 0x0D, 0x90, 0, 0, 0, 0, 0, 0, 0, 0];

#[test]
fn a_silent_i2c_connection_is_held_open_by_requests_for_nothing() {
    let mut request = vec![0xB9, 0xDB, 0x3B, 0x39];
    request.resize(16, 0);
    let pieces = [&NOTHING[..5], &NOTHING[5..], &NOTHING].map(|piece| Event::Bytes(piece.to_vec()));
    let (line, _session, i2c) = line(at_once(pieces));
    line.keep_open();
    assert!(i2c.state().written.is_empty(), "it is young");
    for (count, pieces) in [(1, 2), (2, 1), (3, 0)] {
        line.age(ms(2000));
        line.keep_open();
        line.keep_open();
        assert_eq!(i2c.state().written, request.repeat(count));
        // The response comes in before the next is due.
        i2c.state().waiting = pieces;
    }
}

#[test]
fn a_request_for_nothing_is_not_sent_before_the_last_one_is_answered() {
    let (line, _session, i2c) = line(vec![]);
    for _ in 0..3 {
        line.age(ms(2000));
        line.keep_open();
    }
    assert_eq!(i2c.state().written.len(), 16);
    assert!(i2c.state().read_limits.is_empty(), "nothing waits for it");
}

#[test]
fn an_i2c_request_comes_after_the_response_to_a_request_for_nothing() {
    let mut answer = Vec::new();
    I2cResponseHeader { read_len: 1, is_ok: true }.emit(&mut answer);
    answer.push(7);
    let reads = at_once([NOTHING.to_vec(), answer].map(Event::Bytes));
    let (line, _session, i2c) = line(reads);
    line.age(ms(2000));
    line.keep_open();
    let mut value = [0];
    I2cClient::over(line).read(0x18, 0, &mut value).unwrap();
    assert_eq!(value, [7]);
    assert_eq!(i2c.state().written.len(), 16 + 17);
}

#[test]
fn an_i2c_connection_that_the_controller_has_closed_is_left() {
    let (line, _session, i2c) = line(at_once([Event::End]));
    line.age(ms(2000));
    line.keep_open();
    i2c.state().silent = false;
    line.age(ms(2000));
    line.keep_open();
    assert!(!line.is_held());
}

/// A session that ends neither waits for a request nor leaves it waiting.
#[test]
fn the_end_of_a_session_ends_a_request() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let line = I2cLine::default();
    let ample = ms(60_000);
    let limits = TimeLimits { connect: ample, read: ample, write: ample };
    let server = Endpoint::new(&TCP, "127.0.0.1", port).unwrap();
    let session = line.begin(server, limits, true);
    let mut controller = listener.accept().unwrap().0;
    thread::scope(|scope| {
        let request = scope.spawn(|| I2cClient::over(line.clone()).read(0x18, 0, &mut [0]));
        let mut sent = [0; 17];
        controller.read_exact(&mut sent).unwrap();
        line.keep_open();
        drop(session);
        assert_eq!(controller.read(&mut sent).unwrap(), 0, "it is closed while it waits");
        drop(controller);
        // Nor does it say that the controller has closed it.
        let ended = Error::NotOnline { command: "an I2C request" };
        assert_eq!(request.join().unwrap(), Err(ended));
    });
    assert!(!line.is_held());
}
