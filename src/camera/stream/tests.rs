//! A stream of frames across gaps of the main connection, from the tests' own camera servers.

mod full;

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

use super::*;
use crate::client::scripted::{at_once, Event, Scripted, ScriptedNetwork};
use crate::client::{Endpoint, Network, Tcp, WaitEnds, TCP};

/// Longer than anything takes on a busy machine; only a failing test waits as long as this.
const AMPLE: Duration = Duration::from_secs(20);

/// Longer than it takes to notice a closed connection, and short enough to wait for.
const SHORT: Duration = Duration::from_millis(200);

/// A camera server; the test itself serves its connections.
struct Server(TcpListener);

impl Server {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        Self(listener)
    }

    fn address(&self) -> SocketAddr {
        self.0.local_addr().unwrap()
    }

    /// This server, to be connected to after its start.
    fn listening(&self) -> CameraServer {
        self.listening_in(&TCP)
    }

    fn listening_in(&self, network: &'static dyn Network) -> CameraServer {
        CameraServer::not_connected(endpoint(network, self.address()))
    }

    fn accept(&self) -> TcpStream {
        let begin = Instant::now();
        let stream = loop {
            match self.0.accept() {
                Ok((stream, _)) => break stream,
                Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
            }
            assert!(begin.elapsed() < AMPLE, "nobody connects");
            std::thread::sleep(Duration::from_millis(1));
        };
        stream.set_nonblocking(false).unwrap();
        stream.set_read_timeout(Some(AMPLE)).unwrap();
        stream
    }
}

fn endpoint(network: &'static dyn Network, address: SocketAddr) -> Endpoint {
    Endpoint::at(network, address, address.port())
}

/// No server gets this port by chance.
fn refusing() -> Endpoint {
    endpoint(&TCP, SocketAddr::from(([127, 0, 0, 1], 1)))
}

/// A frame of one byte.
fn frame(byte: u8) -> Vec<u8> {
    let mut frame = Vec::new();
    CameraFrameHeader { frames_ready: 1, width: 1, height: 1, size_raw: 2, size_compressed: 1 }
        .emit(&mut frame);
    frame.push(byte);
    frame
}

/// Sends a frame of one byte, and waits for its acknowledgement.
fn send_frame(stream: &mut TcpStream, byte: u8) {
    stream.write_all(&frame(byte)).unwrap();
    let mut acknowledgement = [0; 4];
    stream.read_exact(&mut acknowledgement).unwrap();
    assert_eq!(acknowledgement, CAMERA_FRAME_ACKNOWLEDGE);
}

fn assert_closed(stream: &mut TcpStream) {
    assert_eq!(stream.read(&mut [0]).unwrap(), 0, "the connection goes on");
}

fn options() -> CameraOptions {
    CameraOptions { start_limit: AMPLE, frame_limit: AMPLE, ..CameraOptions::default() }
}

fn start(
    server: &Server,
    options: CameraOptions,
    gap_limit: Duration,
) -> (CameraStream, Receiver<CameraFrame>) {
    CameraStream::start(server.listening(), options, gap_limit).unwrap()
}

/// A stream whose waits end as on Windows.
fn start_looking(server: &Server) -> (CameraStream, Receiver<CameraFrame>) {
    static LOOKING: Tcp = Tcp { wait_ends: WaitEnds::ByLooking };
    CameraStream::start(server.listening_in(&LOOKING), options(), AMPLE).unwrap()
}

/// The next frame's number and byte.
fn receive(frames: &Receiver<CameraFrame>) -> (u64, u8) {
    let frame = frames.recv_timeout(AMPLE).expect("no frame came in");
    (frame.sequence, frame.data[0])
}

/// Waits for the end of the channel, and returns what ended it.
fn end(stream: &CameraStream, frames: &Receiver<CameraFrame>) -> Option<Error> {
    let end = frames.recv_timeout(AMPLE).unwrap_err();
    assert!(end.is_disconnected(), "the channel goes on");
    assert!(stream.is_finished());
    stream.control().error()
}

fn closed() -> Error {
    Error::ConnectionClosed { command: REQUEST, received: 0 }
}

#[test]
fn frames_go_on_after_a_gap_on_the_same_channel_with_the_next_number() {
    let (first, second) = (Server::start(), Server::start());
    let (mut stream, frames) = start(&first, options(), AMPLE);
    let control = stream.control();
    let mut connection = first.accept();
    send_frame(&mut connection, 10);
    send_frame(&mut connection, 11);
    assert_eq!([receive(&frames), receive(&frames)], [(0, 10), (1, 11)]);

    control.pause();
    assert_closed(&mut connection);
    control.resume(second.listening());
    send_frame(&mut second.accept(), 12);
    assert_eq!(receive(&frames), (2, 12));
    stream.stop();
    assert_eq!(end(&stream, &frames), None);
    assert_eq!(stream.control().statistics().frames, 3);
}

#[test]
fn a_connection_that_fails_before_the_gap_is_known_does_not_end_the_stream() {
    let (first, second) = (Server::start(), Server::start());
    let (stream, frames) = start(&first, options(), AMPLE);
    let mut connection = first.accept();
    send_frame(&mut connection, 1);
    drop(connection);
    assert_eq!(receive(&frames), (0, 1));
    wait_until_it_is_closed(&stream);
    stream.control().pause();
    stream.control().resume(second.listening());
    send_frame(&mut second.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

/// Waits until the thread has dropped its connection.
fn wait_until_it_is_closed(stream: &CameraStream) {
    let begin = Instant::now();
    while stream.control().is_connected() {
        assert!(begin.elapsed() < AMPLE, "the connection goes on");
        std::thread::yield_now();
    }
}

#[test]
fn a_failure_without_a_gap_after_it_ends_the_stream_with_its_error() {
    for gap_limit in [Duration::ZERO, SHORT] {
        let server = Server::start();
        let (stream, frames) = start(&server, options(), gap_limit);
        let mut connection = server.accept();
        send_frame(&mut connection, 1);
        let begin = Instant::now();
        drop(connection);
        assert_eq!(receive(&frames), (0, 1));
        assert_eq!(end(&stream, &frames), Some(closed()));
        assert!(begin.elapsed() >= gap_limit, "it ended early");
    }
}

#[test]
fn bytes_that_are_not_a_frame_end_the_stream_immediately() {
    let server = Server::start();
    let (stream, frames) = start(&server, options(), 10 * AMPLE);
    let mut connection = server.accept();
    connection.write_all(&[0; CameraFrameHeader::LEN]).unwrap();
    let error = end(&stream, &frames);
    assert!(matches!(error, Some(Error::WrongId { .. })), "{error:?}");
}

#[test]
fn a_gap_may_last_longer_than_the_stream_waits_for_one() {
    let server = Server::start();
    let (stream, frames) = start(&server, options(), SHORT);
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    stream.control().pause();
    let waited = frames.recv_timeout(3 * SHORT).unwrap_err();
    assert!(waited.is_timeout(), "the stream has ended: {:?}", stream.control().error());
    stream.control().resume(server.listening());
    send_frame(&mut server.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

#[test]
fn the_server_has_the_whole_limit_for_the_start_again_after_a_gap() {
    let server = Server::start();
    let start_limit = Duration::from_secs(1);
    let (stream, frames) = start(&server, CameraOptions { start_limit, ..options() }, AMPLE);
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    stream.control().pause();
    std::thread::sleep(start_limit);
    stream.control().resume(server.listening());
    // A server that is not ready yet closes its first connection.
    drop(server.accept());
    send_frame(&mut server.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

#[test]
fn a_server_that_does_not_come_back_ends_the_stream() {
    let server = Server::start();
    let options = CameraOptions { start_limit: SHORT, ..options() };
    let (stream, frames) = start(&server, options, SHORT);
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    stream.control().pause();
    stream.control().resume(CameraServer::not_connected(refusing()));
    let refused = Error::ConnectionRefused { address: refusing().to_string() };
    assert_eq!(end(&stream, &frames), Some(refused));
    // The stream has ended, so this does nothing.
    stream.control().pause();
    stream.control().resume(server.listening());
    assert!(stream.is_finished());
}

#[test]
fn a_stream_can_be_stopped_in_a_gap_and_while_it_waits_for_one() {
    for gap in [true, false] {
        let server = Server::start();
        let (mut stream, frames) = start(&server, options(), 10 * AMPLE);
        let mut connection = server.accept();
        send_frame(&mut connection, 1);
        if gap {
            stream.control().pause();
        }
        drop(connection);
        wait_until_it_is_closed(&stream);
        let begin = Instant::now();
        stream.stop();
        assert!(begin.elapsed() < AMPLE);
        // One of before a gap is dropped.
        if !gap {
            assert_eq!(receive(&frames), (0, 1));
        }
        assert_eq!(end(&stream, &frames), None);
    }
}

#[test]
fn a_wait_that_no_shutdown_wakes_ends_when_the_stream_is_stopped() {
    for begun in [&[][..], &[0x11], &[0; CameraFrameHeader::LEN - 1]] {
        let server = Server::start();
        let (mut stream, frames) = start_looking(&server);
        let mut connection = server.accept();
        send_frame(&mut connection, 1);
        assert_eq!(receive(&frames), (0, 1));
        connection.write_all(begun).unwrap();
        let begin = Instant::now();
        stream.stop();
        assert!(begin.elapsed() < AMPLE / 2, "it waited for the limit of a frame");
        assert_eq!(end(&stream, &frames), None);
    }
}

#[test]
fn a_wait_that_no_shutdown_wakes_ends_in_a_gap_and_frames_go_on_after_it() {
    let (first, second) = (Server::start(), Server::start());
    let (stream, frames) = start_looking(&first);
    let mut connection = first.accept();
    send_frame(&mut connection, 1);
    assert_eq!(receive(&frames), (0, 1));
    let begin = Instant::now();
    stream.control().pause();
    assert_closed(&mut connection);
    stream.control().resume(second.listening());
    send_frame(&mut second.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
    assert!(begin.elapsed() < AMPLE / 2, "it waited for the limit of a frame");
}

#[test]
fn two_gaps_in_a_row_end_with_the_last_server() {
    let (first, second, third) = (Server::start(), Server::start(), Server::start());
    let (stream, frames) = start(&first, options(), AMPLE);
    send_frame(&mut first.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    for server in [&second, &third] {
        stream.control().pause();
        stream.control().resume(server.listening());
    }
    send_frame(&mut third.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

#[test]
fn frames_that_wait_when_a_gap_begins_are_dropped_and_counted() {
    let (first, second) = (Server::start(), Server::start());
    let (stream, frames) = start(&first, options(), AMPLE);
    let mut connection = first.accept();
    send_frame(&mut connection, 1);
    while stream.statistics().frames == 0 {
        std::thread::yield_now();
    }
    stream.control().pause();
    assert!(frames.try_recv().is_err(), "a frame of before the gap");
    stream.control().resume(second.listening());
    send_frame(&mut second.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
    assert_eq!(stream.statistics(), CameraStatistics { frames: 2, dropped: 1 });
}

#[cfg(unix)]
#[test]
fn the_limit_for_a_frame_holds_in_a_storm_of_signals() {
    use crate::client::signals::{in_a_storm, LIMIT};

    let server = Server::start();
    let options = CameraOptions { frame_limit: LIMIT, ..options() };
    let (sender, receiver) = bounded(1);
    let control = Arc::new(CameraControl::new(server.listening(), receiver));
    let place = control.server().unwrap();
    let reader = Reader { options, gap_limit: Duration::ZERO, control, sender };
    let mut connection = reader.connect(&place, Instant::now()).unwrap();
    let _silent = server.accept();
    let error = in_a_storm(|| reader.read_from(&place, &mut connection, &mut 0));
    assert_eq!(error, Error::NoAnswer { command: REQUEST, limit: LIMIT, received: 0 });
}

/// A camera server to which the stream has connected before the camera's start, and that connection.
fn connected_early(server: &Server) -> (CameraServer, TcpStream) {
    let camera = CameraServer::before_start(endpoint(&TCP, server.address()));
    (camera, server.accept())
}

#[test]
fn frames_come_over_the_connection_that_was_made_before_the_start() {
    let server = Server::start();
    let (camera, mut connection) = connected_early(&server);
    let (mut stream, frames) = CameraStream::start(camera, options(), Duration::ZERO).unwrap();
    send_frame(&mut connection, 1);
    assert_eq!(receive(&frames), (0, 1));
    stream.stop();
    assert_closed(&mut connection);
}

#[test]
fn a_server_that_closes_the_early_connection_is_connected_to_after_the_start() {
    let server = Server::start();
    let (camera, connection) = connected_early(&server);
    drop(connection);
    let (_stream, frames) = CameraStream::start(camera, options(), Duration::ZERO).unwrap();
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
}

#[test]
fn a_server_that_refuses_before_the_start_leaves_connecting_to_the_stream() {
    let camera = CameraServer::before_start(refusing());
    assert!(camera.early.is_none());
}

#[test]
fn a_gap_closes_an_early_connection_that_is_not_in_use_yet() {
    let (first, second) = (Server::start(), Server::start());
    let control = CameraControl::new(first.listening(), bounded(1).1);
    let (camera, mut connection) = connected_early(&second);
    control.resume(camera);
    control.pause();
    assert_closed(&mut connection);
    let (camera, mut connection) = connected_early(&second);
    control.resume(camera);
    let server = control.server().unwrap();
    assert!(control.take_early(&server).is_some());
    assert!(control.take_early(&server).is_none(), "it was returned twice");
    assert_closed(&mut connection);
}

#[test]
fn a_server_that_refuses_or_closes_while_it_starts_is_connected_to_until_a_frame_comes() {
    let refused = || Err(Error::ConnectionRefused { address: "txt:65000".to_owned() });
    let closing = Scripted::new(at_once([Event::End]), vec![]);
    let ready = Scripted::new(at_once([Event::Bytes(frame(7))]), vec![]);
    let openings = [refused(), refused(), Ok(closing.clone()), Ok(ready.clone())];
    let network = ScriptedNetwork::new(openings);
    let camera = CameraServer::before_start(network.endpoint());
    let (stream, frames) = CameraStream::start(camera, options(), AMPLE).unwrap();
    assert_eq!(receive(&frames), (0, 7));
    drop(stream);
    let limits: Vec<_> = network.asked().iter().map(|(_, limits)| limits.connect).collect();
    assert_eq!(limits, [Duration::from_millis(300), ATTEMPT, ATTEMPT, ATTEMPT]);
    assert_eq!(ready.state().written, CAMERA_FRAME_ACKNOWLEDGE);
    assert!(closing.state().written.is_empty());
}

#[test]
fn a_server_that_never_answers_ends_the_stream_with_the_whole_limit_in_the_error() {
    let timed_out = |limit| Error::ConnectTimedOut { address: "txt:65000".to_owned(), limit };
    let network = ScriptedNetwork::new::<100>(std::array::from_fn(|_| Err(timed_out(ATTEMPT))));
    let options = CameraOptions { start_limit: SHORT, ..options() };
    let camera = CameraServer { endpoint: network.endpoint(), early: None };
    let (stream, frames) = CameraStream::start(camera, options, Duration::ZERO).unwrap();
    assert_eq!(end(&stream, &frames), Some(timed_out(SHORT)));
    assert!(network.asked().iter().all(|(_, limits)| limits.connect <= SHORT));
}
