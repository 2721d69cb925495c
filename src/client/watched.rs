//! A connection whose waits another thread can end on every system.
//!
//! On Windows `shutdown` does not wake a thread that is blocked in reading or writing. Nor can it wait in
//! short steps there: a limit for reading is at least half a second, and when it is over, bytes may be lost.
//! So the socket does not block; while there is nothing to read, or no room, the thread sleeps for a moment
//! and checks whether it is to end.

use std::io::{self, ErrorKind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::transport::Close;

/// How long each of the sleeps is: how late bytes and the end may be seen. `thread::sleep` has a timer of
/// high resolution on Windows.
const NAP: Duration = Duration::from_millis(2);

/// How another thread ends a wait on a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WaitEnds {
    /// It shuts the connection down, which wakes a thread that is blocked.
    ByShutdown,
    /// The waiting thread checks whether it is to end.
    ByLooking,
}

impl WaitEnds {
    /// What works on the system that this is compiled for. Looking works everywhere, but delays bytes.
    pub(crate) const ON_SYSTEM: Self =
        if cfg!(windows) { Self::ByLooking } else { Self::ByShutdown };
}

/// Says that the connection is closed, to the thread that looks.
impl Close for Arc<AtomicBool> {
    fn close(&self) {
        self.store(true, Ordering::Release);
    }
}

/// Tries a system call that does not block until it has moved something, the limit is over, or the connection
/// is closed by another thread.
pub(super) fn wait(
    closed: &AtomicBool,
    limit: Duration,
    mut attempt: impl FnMut() -> io::Result<usize>,
) -> io::Result<usize> {
    let deadline = Instant::now().checked_add(limit);
    loop {
        if closed.load(Ordering::Acquire) {
            return Err(ErrorKind::ConnectionAborted.into());
        }
        match attempt() {
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

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};
    use std::sync::atomic::AtomicUsize;
    use std::thread;

    use super::super::tcp::TcpTransport;
    use super::super::transport::Transport;
    use super::*;

    /// Longer than anything takes on a busy machine; only a failing test waits as long as this.
    const AMPLE: Duration = Duration::from_secs(30);

    /// A transport whose waits end by looking, what closes it, and the other side.
    fn connected() -> (TcpTransport, Box<dyn Close>, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let mut transport = TcpTransport::new(stream, AMPLE, AMPLE, WaitEnds::ByLooking).unwrap();
        let closer = transport.closer().unwrap();
        (transport, closer, listener.accept().unwrap().0)
    }

    /// How calls end that wait until another thread closes the connection.
    fn ended(call: impl Fn(&mut dyn Transport) -> io::Result<()> + Sync) -> ErrorKind {
        let (mut transport, closer, mut other_side) = connected();
        let begin = Instant::now();
        let error = thread::scope(|scope| {
            let waiting = scope.spawn(|| loop {
                if let Err(error) = call(&mut transport) {
                    return error;
                }
            });
            closer.close();
            waiting.join().unwrap()
        });
        assert!(begin.elapsed() < AMPLE, "it waited for its limit");
        other_side.set_nonblocking(true).unwrap();
        let end = io::copy(&mut other_side, &mut io::sink()).unwrap_err();
        assert_eq!(end.kind(), ErrorKind::WouldBlock, "the connection was touched");
        error.kind()
    }

    #[test]
    fn a_wait_that_another_thread_ends_has_looked_again_and_again_before() {
        let (closed, attempts) = (Arc::new(AtomicBool::new(false)), AtomicUsize::new(0));
        let begin = Instant::now();
        let attempt = || {
            attempts.fetch_add(1, Ordering::SeqCst);
            Err(ErrorKind::WouldBlock.into())
        };
        let error = thread::scope(|scope| {
            let waiting = scope.spawn(|| wait(&closed, AMPLE, attempt).unwrap_err());
            while attempts.load(Ordering::SeqCst) < 3 {
                thread::yield_now();
            }
            closed.close();
            waiting.join().unwrap()
        });
        assert_eq!(error.kind(), ErrorKind::ConnectionAborted);
        assert!(begin.elapsed() < AMPLE, "it waited for its limit");
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
        let (mut transport, _closer, mut server) = connected();
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
        let (mut transport, _closer, _server) = connected();
        for limit in [Duration::ZERO, 3 * NAP] {
            let begin = Instant::now();
            let error = transport.read(&mut [0], limit).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::WouldBlock);
            assert!(begin.elapsed() >= limit, "it ended early");
        }
    }
}
