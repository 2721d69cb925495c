//! A server that takes no acknowledgements.

use super::*;

#[test]
fn an_acknowledge_that_is_not_taken_ends_the_stream_after_its_frame() {
    let server = Server::start();
    let limits = TimeLimits { connect: AMPLE, read: SHORT, write: SHORT };
    let mut transport = server.listening().endpoint.open(&limits).unwrap();
    let mut connection = server.accept();
    // As the stream does it: on Windows writing does not block then, and finds more room under Wine.
    let _closer = transport.closer().unwrap();
    // Until the buffers of the system are full, which have room for hundreds of thousands of
    // acknowledgements.
    for size in [1 << 16, 1] {
        while transport.write(&vec![0; size], SHORT).is_ok() {}
    }
    let camera = CameraServer { early: Some(transport), ..server.listening() };
    let options = CameraOptions { frame_limit: SHORT, ..options() };
    let (stream, frames) = CameraStream::start(camera, options, Duration::ZERO).unwrap();
    // The system may have made room for a few meanwhile.
    connection.write_all(&frame(1).repeat(1000)).unwrap();
    assert_eq!(receive(&frames).1, 1);
    while frames.recv_timeout(AMPLE).is_ok() {}
    assert!(stream.is_finished());
    let not_taken = Error::NotTaken { command: REQUEST, limit: SHORT };
    assert_eq!(stream.control().error(), Some(not_taken));
}
