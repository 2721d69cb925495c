//! What a connection needs from the network.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{IpAddr, Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The shortest limit that the operating system accepts.
pub(super) const SHORTEST_LIMIT: Duration = Duration::from_millis(1);

/// A stream of bytes in each direction, with a clock.
///
/// Reading and writing are single system calls: they may move only a part of the bytes, and may be
/// interrupted. When the limit is over, the error is of the kind `WouldBlock` or `TimedOut`.
pub(super) trait Transport: fmt::Debug + Send + Sync {
    fn now(&self) -> Instant;

    /// Reads the bytes that have come in, and waits for some up to `limit`. 0 is the end of the stream.
    fn read(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize>;

    /// Writes as much as there is room for, and waits for room up to `limit`.
    fn write(&mut self, bytes: &[u8], limit: Duration) -> io::Result<usize>;

    /// Ends the stream to the other side.
    fn end_writing(&mut self) -> io::Result<()>;

    /// Whether the other side has neither closed the connection, as far as is known here, nor sent
    /// bytes that are not read yet. Does not block.
    fn is_silent(&self) -> bool;

    /// The other side's address, unless the connection is lost already.
    fn peer_ip(&self) -> Option<IpAddr>;
}

/// A TCP connection.
#[derive(Debug)]
pub(super) struct TcpTransport {
    stream: TcpStream,
    /// The limits that are set in the operating system.
    read_limit: Duration,
    write_limit: Duration,
}

impl TcpTransport {
    /// Prepares a stream; the limits are those that most reading and writing will have.
    pub(super) fn new(stream: TcpStream, read: Duration, write: Duration) -> io::Result<Self> {
        let read_limit = read.max(SHORTEST_LIMIT);
        let write_limit = write.max(SHORTEST_LIMIT);
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(read_limit))?;
        stream.set_write_timeout(Some(write_limit))?;
        Ok(Self { stream, read_limit, write_limit })
    }
}

impl Transport for TcpTransport {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn read(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        let limit = limit.max(SHORTEST_LIMIT);
        if limit != self.read_limit {
            self.stream.set_read_timeout(Some(limit))?;
            self.read_limit = limit;
        }
        self.stream.read(buffer)
    }

    fn write(&mut self, bytes: &[u8], limit: Duration) -> io::Result<usize> {
        let limit = limit.max(SHORTEST_LIMIT);
        if limit != self.write_limit {
            self.stream.set_write_timeout(Some(limit))?;
            self.write_limit = limit;
        }
        self.stream.write(bytes)
    }

    fn end_writing(&mut self) -> io::Result<()> {
        self.stream.shutdown(Shutdown::Write)
    }

    fn is_silent(&self) -> bool {
        let peeked = self.stream.set_nonblocking(true).and_then(|()| self.stream.peek(&mut [0]));
        let blocks_again = self.stream.set_nonblocking(false).is_ok();
        blocks_again && peeked.is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }

    fn peer_ip(&self) -> Option<IpAddr> {
        self.stream.peer_addr().ok().map(|address| address.ip())
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    /// Longer than anything takes on a busy machine.
    const AMPLE: Duration = Duration::from_secs(30);

    /// A transport with these limits, and its other side.
    fn connected(limit: Duration) -> (TcpTransport, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let transport = TcpTransport::new(stream, limit, limit).unwrap();
        (transport, listener.accept().unwrap().0)
    }

    #[test]
    fn each_call_has_the_limit_that_it_is_given() {
        let (mut transport, mut server) = connected(AMPLE);
        for limit in [AMPLE, AMPLE / 2, AMPLE] {
            server.write_all(&[1]).unwrap();
            assert_eq!(transport.read(&mut [0; 2], limit).unwrap(), 1);
            assert_eq!(transport.write(&[1], limit / 2).unwrap(), 1);
            assert_eq!(transport.stream.read_timeout().unwrap(), Some(limit));
            assert_eq!(transport.stream.write_timeout().unwrap(), Some(limit / 2));
        }
        // A limit that is too short for the operating system counts as its shortest one.
        let (mut transport, _server) = connected(Duration::ZERO);
        let error = transport.read(&mut [0], Duration::ZERO).unwrap_err();
        assert!(matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut), "{error:?}");
    }

    // Other systems may report a reset only when the connection is read from.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_connection_that_was_reset_is_not_silent() {
        let (mut transport, server) = connected(AMPLE);
        assert!(transport.is_silent());
        // Closing with an unread byte resets.
        transport.write(&[1], AMPLE).unwrap();
        server.peek(&mut [0]).unwrap();
        drop(server);
        let begin = Instant::now();
        while transport.peer_ip().is_some() {
            assert!(begin.elapsed() < AMPLE, "it was not reset");
        }
        assert!(!transport.is_silent());
    }
}
