//! A stream of frames across gaps of the main connection, from made-up camera servers.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpListener;

use super::*;

/// Longer than anything takes on a busy machine; only a test that fails waits so long.
const AMPLE: Duration = Duration::from_secs(20);

/// Longer than it takes to notice a closed connection, and short enough to wait for.
const SHORT: Duration = Duration::from_millis(200);

/// A camera server whose connections the test serves itself.
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

/// Sends a frame of one byte, and waits for its acknowledge.
fn send_frame(stream: &mut TcpStream, byte: u8) {
    let mut frame = Vec::new();
    CameraFrameHeader { frames_ready: 1, width: 1, height: 1, size_raw: 2, size_compressed: 1 }
        .emit(&mut frame);
    frame.push(byte);
    stream.write_all(&frame).unwrap();
    let mut acknowledge = [0; 4];
    stream.read_exact(&mut acknowledge).unwrap();
    assert_eq!(acknowledge, CAMERA_FRAME_ACKNOWLEDGE);
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
    rides_out: Option<Duration>,
) -> (CameraStream, Receiver<CameraFrame>) {
    CameraStream::start(server.address(), options, rides_out).unwrap()
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
    let (mut stream, frames) = start(&first, options(), Some(AMPLE));
    let control = stream.control();
    let mut connection = first.accept();
    send_frame(&mut connection, 10);
    send_frame(&mut connection, 11);
    assert_eq!([receive(&frames), receive(&frames)], [(0, 10), (1, 11)]);

    control.pause();
    assert_closed(&mut connection);
    control.resume(second.address());
    send_frame(&mut second.accept(), 12);
    assert_eq!(receive(&frames), (2, 12));
    stream.join();
    assert_eq!(end(&stream, &frames), None);
    assert_eq!(stream.control().statistics().frames, 3);
}

#[test]
fn a_connection_that_fails_before_the_gap_is_known_is_ridden_out() {
    let (first, second) = (Server::start(), Server::start());
    let (stream, frames) = start(&first, options(), Some(AMPLE));
    let mut connection = first.accept();
    send_frame(&mut connection, 1);
    drop(connection);
    assert_eq!(receive(&frames), (0, 1));
    wait_until_it_rides(&stream);
    stream.control().pause();
    stream.control().resume(second.address());
    send_frame(&mut second.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

/// Waits until the thread has let go of its connection.
fn wait_until_it_rides(stream: &CameraStream) {
    let begin = Instant::now();
    while stream.control().is_connected() {
        assert!(begin.elapsed() < AMPLE, "the connection goes on");
        std::thread::yield_now();
    }
}

#[test]
fn a_failure_that_no_gap_follows_ends_the_stream_with_its_error() {
    for rides_out in [None, Some(SHORT)] {
        let server = Server::start();
        let (stream, frames) = start(&server, options(), rides_out);
        let mut connection = server.accept();
        send_frame(&mut connection, 1);
        let begin = Instant::now();
        drop(connection);
        assert_eq!(receive(&frames), (0, 1));
        assert_eq!(end(&stream, &frames), Some(closed()));
        assert!(begin.elapsed() >= rides_out.unwrap_or_default(), "it ended early");
    }
}

#[test]
fn bytes_that_are_no_frame_end_the_stream_at_once() {
    let server = Server::start();
    let (stream, frames) = start(&server, options(), Some(10 * AMPLE));
    let mut connection = server.accept();
    connection.write_all(&[0; CameraFrameHeader::LEN]).unwrap();
    let error = end(&stream, &frames);
    assert!(matches!(error, Some(Error::WrongId { .. })), "{error:?}");
}

#[test]
fn a_gap_may_last_longer_than_the_stream_rides_out() {
    let server = Server::start();
    let (stream, frames) = start(&server, options(), Some(SHORT));
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    stream.control().pause();
    let waited = frames.recv_timeout(3 * SHORT).unwrap_err();
    assert!(waited.is_timeout(), "the stream has ended: {:?}", stream.control().error());
    stream.control().resume(server.address());
    send_frame(&mut server.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

#[test]
fn the_server_has_the_limit_for_the_start_anew_after_a_gap() {
    let server = Server::start();
    let start_limit = Duration::from_secs(1);
    let (stream, frames) = start(&server, CameraOptions { start_limit, ..options() }, Some(AMPLE));
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    stream.control().pause();
    std::thread::sleep(start_limit);
    stream.control().resume(server.address());
    // A server that is not ready yet closes its first connection.
    drop(server.accept());
    send_frame(&mut server.accept(), 2);
    assert_eq!(receive(&frames), (1, 2));
}

#[test]
fn a_server_that_does_not_come_back_ends_the_stream() {
    let server = Server::start();
    let options = CameraOptions { start_limit: SHORT, ..options() };
    let (stream, frames) = start(&server, options, Some(SHORT));
    send_frame(&mut server.accept(), 1);
    assert_eq!(receive(&frames), (0, 1));
    // Nobody gets this port by chance.
    let address = SocketAddr::from(([127, 0, 0, 1], 1));
    stream.control().pause();
    stream.control().resume(address);
    let refused = Error::ConnectionRefused { address: address.to_string() };
    assert_eq!(end(&stream, &frames), Some(refused));
    // There is nothing to go on with.
    stream.control().pause();
    stream.control().resume(server.address());
    assert!(stream.is_finished());
}

#[test]
fn a_stream_is_stopped_in_a_gap_and_while_it_rides_one_out() {
    for gap in [true, false] {
        let server = Server::start();
        let (mut stream, frames) = start(&server, options(), Some(10 * AMPLE));
        let mut connection = server.accept();
        send_frame(&mut connection, 1);
        if gap {
            stream.control().pause();
        }
        drop(connection);
        wait_until_it_rides(&stream);
        let begin = Instant::now();
        stream.join();
        assert!(begin.elapsed() < AMPLE);
        assert_eq!(receive(&frames), (0, 1));
        assert_eq!(end(&stream, &frames), None);
    }
}

#[test]
fn two_gaps_in_a_row_end_with_the_last_server() {
    let (first, second, third) = (Server::start(), Server::start(), Server::start());
    let (stream, frames) = start(&first, options(), Some(AMPLE));
    send_frame(&mut first.accept(), 1);
    for server in [&second, &third] {
        stream.control().pause();
        stream.control().resume(server.address());
    }
    send_frame(&mut third.accept(), 2);
    assert_eq!([receive(&frames), receive(&frames)], [(0, 1), (1, 2)]);
}

#[cfg(unix)]
#[test]
fn the_limit_for_a_frame_holds_in_a_storm_of_signals() {
    use crate::client::signals::{in_a_storm, LIMIT};

    let server = Server::start();
    let options = CameraOptions { frame_limit: LIMIT, ..options() };
    let (sender, oldest) = bounded(1);
    let control = Arc::new(CameraControl::new(server.address()));
    let place = control.server().unwrap();
    let reader = Reader { options, rides_out: Duration::ZERO, control, sender, oldest };
    let mut connection = reader.connect(place, Instant::now()).unwrap();
    let _silent = server.accept();
    let error = in_a_storm(|| reader.read_from(&mut connection, &mut 0));
    assert_eq!(error, Error::NoAnswer { command: REQUEST, limit: LIMIT, received: 0 });
}
