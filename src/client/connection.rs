//! A request and its response: what the controller's connections have in common.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::connect::{self, io_error, TimeLimits, SHORTEST_LIMIT};
use crate::error::Error;

/// A connection on which each request has one response, strictly in turn.
#[derive(Debug)]
pub(crate) struct Connection {
    pub(super) stream: TcpStream,
    limits: TimeLimits,
}

/// What errors call a request and its response.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketNames {
    pub(crate) request: &'static str,
    pub(crate) response: &'static str,
}

impl Connection {
    /// Connects to the first of the host's addresses that answers within the limit.
    pub(crate) fn connect(host: &str, port: u16, limits: TimeLimits) -> Result<Self, Error> {
        let limits = TimeLimits {
            connect: limits.connect.max(SHORTEST_LIMIT),
            read: limits.read.max(SHORTEST_LIMIT),
            write: limits.write.max(SHORTEST_LIMIT),
        };
        let stream = connect::connect(host, port, limits.connect)?;
        stream
            .set_nodelay(true)
            .and_then(|()| stream.set_read_timeout(Some(limits.read)))
            .and_then(|()| stream.set_write_timeout(Some(limits.write)))
            .map_err(|error| Error::ConnectFailed {
                address: format!("{host}:{port}"),
                reason: error.to_string(),
            })?;
        Ok(Self { stream, limits })
    }

    /// Sends a request and reads its whole response into `buffer`, which is longer than any, so
    /// that one of too many bytes shows. Returns the response's size.
    ///
    /// `size` tells it, or that the bytes are wrong, by the first bytes once there are enough.
    pub(crate) fn transact(
        &mut self,
        names: PacketNames,
        request: &[u8],
        buffer: &mut [u8],
        size: impl Fn(&[u8]) -> Result<Option<usize>, Error>,
    ) -> Result<usize, Error> {
        self.stream.write_all(request).map_err(|error| io_error(names.request, &error, 0))?;
        self.read_response(names, buffer, size)
    }

    /// Whether the other side has neither closed the connection, as far as is known here, nor sent
    /// what nobody asked for. Does not block.
    pub(crate) fn is_silent(&self) -> bool {
        let peeked = self.stream.set_nonblocking(true).and_then(|()| self.stream.peek(&mut [0]));
        let blocks_again = self.stream.set_nonblocking(false).is_ok();
        blocks_again && peeked.is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }

    fn read_response(
        &mut self,
        PacketNames { request: command, response: packet }: PacketNames,
        buffer: &mut [u8],
        size: impl Fn(&[u8]) -> Result<Option<usize>, Error>,
    ) -> Result<usize, Error> {
        let deadline = Instant::now().checked_add(self.limits.read);
        let mut received = 0;
        let mut shortened = false;
        let size = loop {
            if let Some(size) = size(&buffer[..received])? {
                if received >= size {
                    break size;
                }
            }
            if received > 0 {
                // The limit is for the whole response, not for each piece of it.
                let rest =
                    deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
                if rest == Some(Duration::ZERO) {
                    return Err(self.no_answer(command, received));
                }
                self.set_read_limit(command, rest.unwrap_or(self.limits.read))?;
                shortened = true;
            }
            received += match self.stream.read(&mut buffer[received..]) {
                Ok(0) => return Err(Error::ConnectionClosed { command, received }),
                Ok(count) => count,
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => 0,
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                        return Err(self.no_answer(command, received));
                    }
                    _ => return Err(io_error(command, &error, received)),
                },
            };
        };
        if shortened {
            self.set_read_limit(command, self.limits.read)?;
        }
        if received > size {
            return Err(Error::WrongSize { packet, expected: size, found: received });
        }
        Ok(size)
    }

    fn set_read_limit(&self, command: &'static str, limit: Duration) -> Result<(), Error> {
        self.stream
            .set_read_timeout(Some(limit.max(SHORTEST_LIMIT)))
            .map_err(|error| io_error(command, &error, 0))
    }

    fn no_answer(&self, command: &'static str, received: usize) -> Error {
        Error::NoAnswer { command, limit: self.limits.read, received }
    }
}

// Elsewhere a system need not tell that a connection was reset before it is read from.
#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn a_connection_that_was_reset_is_not_silent() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let limits = TimeLimits::default();
        let mut connection = Connection::connect("127.0.0.1", port, limits).unwrap();
        let server = listener.accept().unwrap().0;
        assert!(connection.is_silent());
        // Closing with an unread byte resets.
        connection.stream.write_all(&[1]).unwrap();
        server.peek(&mut [0]).unwrap();
        drop(server);
        let begin = Instant::now();
        while connection.stream.peer_addr().is_ok() {
            assert!(begin.elapsed() < Duration::from_secs(30), "it was not reset");
        }
        assert!(!connection.is_silent());
    }
}
