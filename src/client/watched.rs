//! A connection whose waits another thread can end on every system.
//!
//! On Windows `shutdown` does not wake a thread that is blocked in reading or writing. Nor can it wait in
//! short steps there: a limit for reading is at least half a second, and when it is over, bytes may be lost.
//! So the socket does not block; while there is nothing to read, or no room, the thread sleeps for a moment
//! and looks whether it is to end.

use std::fmt;
use std::io::{self, ErrorKind};
use std::net::{IpAddr, Shutdown, TcpStream};
use std::time::{Duration, Instant};

use super::transport::Transport;

/// How long each of the sleeps is: how late bytes and the end may be seen. `thread::sleep` has a timer of
/// high resolution on Windows.
const NAP: Duration = Duration::from_millis(2);

/// How another thread ends a wait on a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WaitEnds {
    /// It shuts the connection down, which wakes a thread that is blocked.
    ByShutdown,
    /// The waiting thread looks whether it is to end.
    ByLooking,
}

impl WaitEnds {
    /// What works on the system that this is compiled for. Looking works everywhere, but delays bytes.
    pub(crate) const ON_SYSTEM: Self =
        if cfg!(windows) { Self::ByLooking } else { Self::ByShutdown };
}

/// A TCP connection that looks, while it waits, whether it is to end.
pub(super) struct WatchedTransport<F> {
    stream: TcpStream,
    is_over: F,
}

impl<F: Fn() -> bool> WatchedTransport<F> {
    pub(super) fn new(stream: TcpStream, is_over: F) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        Ok(Self { stream, is_over })
    }

    /// Tries until something was moved, the limit is over, or the connection is to end.
    fn move_bytes(
        &self,
        limit: Duration,
        mut attempt: impl FnMut(&TcpStream) -> io::Result<usize>,
    ) -> io::Result<usize> {
        let deadline = Instant::now().checked_add(limit);
        loop {
            if (self.is_over)() {
                return Err(ErrorKind::ConnectionAborted.into());
            }
            match attempt(&self.stream) {
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if deadline.is_some_and(|deadline| deadline <= Instant::now()) {
                        return Err(error);
                    }
                }
                result => return result,
            }
            std::thread::sleep(NAP);
        }
    }
}

impl<F: Fn() -> bool + Send + Sync> Transport for WatchedTransport<F> {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn read(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        self.move_bytes(limit, |mut stream| io::Read::read(&mut stream, buffer))
    }

    fn write(&mut self, bytes: &[u8], limit: Duration) -> io::Result<usize> {
        self.move_bytes(limit, |mut stream| io::Write::write(&mut stream, bytes))
    }

    fn end_writing(&mut self) -> io::Result<()> {
        self.stream.shutdown(Shutdown::Write)
    }

    fn is_silent(&self) -> bool {
        self.stream.peek(&mut [0]).is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
    }

    fn peer_ip(&self) -> Option<IpAddr> {
        self.stream.peer_addr().ok().map(|address| address.ip())
    }
}

impl<F> fmt::Debug for WatchedTransport<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WatchedTransport").field("stream", &self.stream).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpListener;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;

    use super::*;

    /// Longer than anything takes on a busy machine; only a failing test waits as long as this.
    const AMPLE: Duration = Duration::from_secs(30);

    fn connected<F: Fn() -> bool>(is_over: F) -> (WatchedTransport<F>, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        (WatchedTransport::new(stream, is_over).unwrap(), listener.accept().unwrap().0)
    }

    /// How calls end that wait until another thread says so by nothing but the flag.
    fn ended(wait: impl Fn(&mut dyn Transport) -> io::Result<()> + Sync) -> ErrorKind {
        let (is_over, looked) = (AtomicBool::new(false), AtomicBool::new(false));
        let (mut transport, _other_side) = connected(|| {
            looked.store(true, Ordering::SeqCst);
            is_over.load(Ordering::SeqCst)
        });
        let begin = Instant::now();
        let error = thread::scope(|scope| {
            let waiting = scope.spawn(|| loop {
                if let Err(error) = wait(&mut transport) {
                    return error;
                }
            });
            // It looks again and again, so it waits.
            for _ in 0..2 {
                looked.store(false, Ordering::SeqCst);
                while !looked.load(Ordering::SeqCst) {
                    thread::yield_now();
                }
            }
            is_over.store(true, Ordering::SeqCst);
            waiting.join().unwrap()
        });
        assert!(begin.elapsed() < AMPLE, "it waited for its limit");
        error.kind()
    }

    #[test]
    fn another_thread_ends_a_wait_without_touching_the_connection() {
        let read = |transport: &mut dyn Transport| transport.read(&mut [0], AMPLE).map(drop);
        assert_eq!(ended(read), ErrorKind::ConnectionAborted);
        // Until there is no room.
        let write = |transport: &mut dyn Transport| transport.write(&[0; 1 << 16], AMPLE).map(drop);
        assert_eq!(ended(write), ErrorKind::ConnectionAborted);
    }

    #[test]
    fn bytes_that_are_there_are_moved_and_the_end_is_read() {
        let (mut transport, mut server) = connected(|| false);
        assert!(transport.is_silent());
        server.write_all(&[1, 2]).unwrap();
        let mut buffer = [0; 3];
        assert_eq!(transport.read(&mut buffer, AMPLE).unwrap(), 2);
        assert_eq!(buffer, [1, 2, 0]);
        assert_eq!(transport.write(&[3], AMPLE).unwrap(), 1);
        server.read_exact(&mut buffer[..1]).unwrap();
        assert_eq!(buffer[0], 3);
        drop(server);
        assert_eq!(transport.read(&mut buffer, AMPLE).unwrap(), 0);
    }

    #[test]
    fn a_wait_has_its_limit() {
        let (mut transport, _server) = connected(|| false);
        for limit in [Duration::ZERO, 3 * NAP] {
            let begin = Instant::now();
            let error = transport.read(&mut [0], limit).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::WouldBlock);
            assert!(begin.elapsed() >= limit, "it ended early");
        }
    }
}
