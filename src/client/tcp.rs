//! TCP, by which controllers are reached.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::AtomicBool;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::connect::connect;
use super::limits::{TimeLimits, SHORTEST_LIMIT};
use super::transport::{Addresses, Close, Network, Transport};
use super::watched::{self, WaitEnds};
use crate::error::Error;

/// The network of the system.
pub(crate) static TCP: Tcp = Tcp { wait_ends: WaitEnds::ON_SYSTEM };

/// Opens TCP connections, whose waits another thread ends in this way.
#[derive(Debug)]
pub(crate) struct Tcp {
    pub(crate) wait_ends: WaitEnds,
}

impl Network for Tcp {
    fn open(
        &self,
        host: &str,
        port: u16,
        limits: &TimeLimits,
    ) -> Result<Box<dyn Transport>, Error> {
        let stream = connect(host, port, limits.connect)?;
        match TcpTransport::new(stream, limits.read, limits.write, self.wait_ends) {
            Ok(transport) => Ok(Box::new(transport)),
            Err(error) => {
                let address = format!("{host}:{port}");
                Err(Error::ConnectFailed { address, cause: error.into() })
            }
        }
    }
}

/// A TCP connection.
#[derive(Debug)]
pub(super) struct TcpTransport {
    stream: TcpStream,
    /// The limits that are set in the operating system.
    read_limit: Duration,
    write_limit: Duration,
    wait_ends: WaitEnds,
    /// Whether another thread has closed the connection, if that is found by looking. The stream does not
    /// block then.
    closed: Option<Arc<AtomicBool>>,
}

impl TcpTransport {
    /// Prepares a stream; the limits are those that most reading and writing will have.
    pub(super) fn new(
        stream: TcpStream,
        read: Duration,
        write: Duration,
        wait_ends: WaitEnds,
    ) -> io::Result<Self> {
        let read_limit = read.max(SHORTEST_LIMIT);
        let write_limit = write.max(SHORTEST_LIMIT);
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(read_limit))?;
        stream.set_write_timeout(Some(write_limit))?;
        Ok(Self { stream, read_limit, write_limit, wait_ends, closed: None })
    }
}

impl Transport for TcpTransport {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn read(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        if let Some(closed) = &self.closed {
            return watched::wait(closed, limit, || (&self.stream).read(buffer));
        }
        let limit = limit.max(SHORTEST_LIMIT);
        if limit != self.read_limit {
            self.stream.set_read_timeout(Some(limit))?;
            self.read_limit = limit;
        }
        self.stream.read(buffer)
    }

    fn write(&mut self, bytes: &[u8], limit: Duration) -> io::Result<usize> {
        if let Some(closed) = &self.closed {
            return watched::wait(closed, limit, || (&self.stream).write(bytes));
        }
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
        let is_as_before = self.stream.set_nonblocking(self.closed.is_some()).is_ok();
        is_as_before && peeked.is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }

    fn addresses(&self) -> io::Result<Addresses> {
        Ok(Addresses { own: self.stream.local_addr()?, peer: self.stream.peer_addr()? })
    }

    fn closer(&mut self) -> io::Result<Box<dyn Close>> {
        match self.wait_ends {
            WaitEnds::ByShutdown => Ok(Box::new(self.stream.try_clone()?)),
            WaitEnds::ByLooking => {
                self.stream.set_nonblocking(true)?;
                Ok(Box::new(Arc::clone(self.closed.get_or_insert_default())))
            }
        }
    }

    fn quick_closer(&self) -> io::Result<Box<dyn Close>> {
        Ok(Box::new(self.stream.try_clone()?))
    }
}

impl Close for TcpStream {
    fn close(&self) {
        // It may be closed already.
        let _ = self.shutdown(Shutdown::Both);
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
        let transport = TcpTransport::new(stream, limit, limit, WaitEnds::ON_SYSTEM).unwrap();
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
        while transport.addresses().is_ok() {
            assert!(begin.elapsed() < AMPLE, "it was not reset");
        }
        assert!(!transport.is_silent());
    }
}
