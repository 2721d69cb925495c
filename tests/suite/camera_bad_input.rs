//! Camera servers that make mistakes: the channel ends with the reason, and the transfer goes on.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::Duration;

use crossbeam_channel::RecvTimeoutError;
use ft_transfer_area::wire::CameraFrameHeader;
use ft_transfer_area::{CameraOptions, Error};

use crate::support::{handler_for, unpaced, unused_ports, DEADLINE};

const HEADER: CameraFrameHeader = CameraFrameHeader {
    frames_ready: 1,
    width: 320,
    height: 240,
    size_raw: 153_600,
    size_compressed: 1000,
};

/// What the errors of the stream name.
const REQUEST: &str = "the request for a camera frame";

fn header(size_compressed: i32) -> Vec<u8> {
    let mut bytes = Vec::new();
    CameraFrameHeader { size_compressed, ..HEADER }.emit(&mut bytes);
    bytes
}

/// Streams from a camera server that sends these bytes to its first client and then does `then`.
/// Returns how many frames came, and why the stream ended.
fn stream_from(
    bytes: Vec<u8>,
    then: impl FnOnce(TcpStream) + Send + 'static,
) -> (usize, Option<Error>) {
    stream_with_limit(DEADLINE, bytes, then)
}

fn stream_with_limit(
    limit: Duration,
    bytes: Vec<u8>,
    then: impl FnOnce(TcpStream) + Send + 'static,
) -> (usize, Option<Error>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    // With large packets and buffers, a million acknowledgements are needed to fill them.
    #[cfg(unix)]
    {
        let socket = socket2::SockRef::from(&listener);
        socket.set_tcp_mss(536).unwrap();
        socket.set_recv_buffer_size(4096).unwrap();
    }
    let port = listener.local_addr().unwrap().port();
    let server = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.write_all(&bytes).unwrap();
        then(stream);
    });
    let result = stream_at(port, limit);
    server.join().unwrap();
    result
}

fn stream_at(port: u16, frame_limit: Duration) -> (usize, Option<Error>) {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).camera_port(port).build().unwrap();
    handler.begin_transfer().unwrap();
    let options =
        CameraOptions::default().start_limit(Duration::from_millis(300)).frame_limit(frame_limit);
    let frames = handler.start_camera(options).unwrap();
    let mut count = 0;
    let end = loop {
        match frames.recv_timeout(DEADLINE) {
            Ok(_) => count += 1,
            Err(end) => break end,
        }
    };
    assert_eq!(end, RecvTimeoutError::Disconnected);
    let error = handler.camera_error();
    // The transfer goes on, and the camera can be started again.
    handler.areas().wait_cycle().unwrap();
    drop(handler.start_camera(options).unwrap());
    handler.end_transfer().unwrap();
    (count, error)
}

/// Leaves the connection open and quiet until the client closes it.
fn stay(mut stream: TcpStream) {
    let _ = stream.read_to_end(&mut Vec::new());
}

#[test]
fn a_port_that_refuses_for_ever() {
    let port = unused_ports();
    let (count, error) = stream_at(port, DEADLINE);
    let address = format!("127.0.0.1:{port}");
    assert_eq!((count, error), (0, Some(Error::ConnectionRefused { address })));
}

#[test]
fn a_port_that_refuses_at_first_is_tried_again() {
    let port = unused_ports();
    let server = thread::spawn(move || {
        // Some attempts are refused. Without further attempts no frame would ever come.
        thread::sleep(Duration::from_millis(200));
        let listener = TcpListener::bind(("127.0.0.1", port)).unwrap();
        let (mut stream, _) = listener.accept().unwrap();
        let mut frame = header(1000);
        frame.resize(CameraFrameHeader::LEN + 1000, 0);
        stream.write_all(&frame).unwrap();
        stay(stream);
    });
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).camera_port(port).build().unwrap();
    handler.begin_transfer().unwrap();
    let options = CameraOptions::default().start_limit(DEADLINE);
    let frames = handler.start_camera(options).unwrap();
    assert_eq!(frames.recv_timeout(DEADLINE).unwrap().data, [0; 1000]);
    handler.end_transfer().unwrap();
    server.join().unwrap();
}

#[test]
fn a_header_with_a_wrong_id() {
    let mut bytes = header(1000);
    bytes[3] ^= 1;
    let (count, error) = stream_from(bytes, stay);
    assert_eq!(count, 0);
    let (packet, expected) = ("camera frame", CameraFrameHeader::ID);
    let found = expected ^ 0x0100_0000;
    assert_eq!(error, Some(Error::WrongId { packet, expected, found }));
}

#[test]
fn a_header_with_an_implausible_size() {
    let limit = CameraOptions::default().max_frame_size;
    for announced in [0, -1, i32::MIN, i32::MAX, 16 * 1024 * 1024 + 1] {
        let (count, error) = stream_from(header(announced), stay);
        assert_eq!((count, error), (0, Some(Error::FrameSize { announced, limit })));
    }
}

#[test]
fn a_stream_closed_inside_a_header_or_a_frame() {
    let mut frame = header(1000);
    frame.resize(CameraFrameHeader::LEN + 1000, 0);
    for received in [1, 19, 20, 500, 1019] {
        let (count, error) = stream_from(frame[..received].to_vec(), drop);
        let command = REQUEST;
        assert_eq!((count, error), (0, Some(Error::ConnectionClosed { command, received })));
    }
}

#[test]
fn a_stream_closed_between_two_frames() {
    let mut frame = header(1000);
    frame.resize(CameraFrameHeader::LEN + 1000, 0);
    let (count, error) = stream_from(frame, |mut stream| stream.read_exact(&mut [0; 4]).unwrap());
    assert_eq!(count, 1);
    assert_eq!(error, Some(Error::ConnectionClosed { command: REQUEST, received: 0 }));
}

#[test]
fn a_stream_that_stalls() {
    let limit = Duration::from_millis(300);
    for received in [0, 10, 20, 800] {
        let mut bytes = header(1000);
        bytes.resize(CameraFrameHeader::LEN + 1000, 0);
        bytes.truncate(received);
        let (count, error) = stream_with_limit(limit, bytes, stay);
        assert_eq!(
            (count, error),
            (0, Some(Error::NoAnswer { command: REQUEST, limit, received }))
        );
    }
}

#[test]
fn a_frame_that_trickles_in_for_longer_than_the_limit() {
    let limit = Duration::from_secs(1);
    let (count, error) = stream_with_limit(limit, header(10_000_000), |mut stream| {
        // Each byte comes well within the limit.
        while stream.write_all(&[0]).is_ok() {
            thread::sleep(Duration::from_micros(200));
        }
    });
    assert_eq!(count, 0);
    assert!(matches!(error, Some(Error::NoAnswer { command: REQUEST, .. })), "{error:?}");
}

// In the library there is a test that fills the buffers at once.
#[cfg_attr(
    windows,
    ignore = "Wine takes ten minutes until acknowledgements of 4 bytes fill the buffers of Linux"
)]
#[test]
fn a_server_that_never_reads_the_acknowledgements() {
    // Long enough for a busy machine to send the first frames.
    let limit = Duration::from_secs(2);
    let (count, error) = stream_with_limit(limit, Vec::new(), |mut stream| {
        let mut frame = header(1);
        frame.push(0);
        let frames = frame.repeat(1000);
        // As fast as the client takes them, until it gives up.
        while stream.write_all(&frames).is_ok() {}
    });
    assert!(count > 0);
    assert_eq!(error, Some(Error::NotTaken { command: REQUEST, limit }));
}
