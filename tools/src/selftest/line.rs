//! A connection to one of the controller's ports, for checks that also want to know what does not come.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use crossbeam_channel::{never, Receiver};

use super::outcome::Trouble;

/// How long a packet and a connection may take.
pub(super) const LIMIT: Duration = Duration::from_secs(3);

/// How long a wait goes on without looking for Ctrl-C.
const SLICE: Duration = Duration::from_millis(50);

/// What has come within a limit.
pub(super) enum Heard {
    /// As many bytes as were waited for.
    Bytes(Vec<u8>),
    /// The controller has closed the connection.
    Closed,
    /// Fewer bytes, or none.
    Silence,
}

/// How long a connection that is given up is read: with answers unread, closing it would take away what was sent.
const FAREWELL: Duration = Duration::from_millis(500);

/// No wait on it is longer than its limit. Ctrl-C ends each, but none for a packet that has to come.
pub(super) struct Line {
    stream: TcpStream,
    interrupted: Receiver<()>,
    /// What is sent when Ctrl-C is pressed while a packet has to come.
    pub(super) at_interrupt: Option<Vec<u8>>,
}

impl Line {
    /// `None` when the controller refuses.
    pub(super) fn connect(
        address: SocketAddr,
        interrupted: &Receiver<()>,
    ) -> Result<Option<Self>, Trouble> {
        let stream = match TcpStream::connect_timeout(&address, LIMIT) {
            Ok(stream) => stream,
            Err(error) if is_end(error.kind()) => return Ok(None),
            Err(error) => return Err(Trouble::Lost(format!("no connection: {error:#}"))),
        };
        // A request is one segment, sent at once.
        stream.set_nodelay(true).map_err(|error| Trouble::Lost(error.to_string()))?;
        Ok(Some(Self { stream, interrupted: interrupted.clone(), at_interrupt: None }))
    }

    /// From now on Ctrl-C ends nothing.
    pub(super) fn go_on(&mut self) {
        self.interrupted = never();
    }

    /// Whether Ctrl-C was pressed, as an error.
    pub(super) fn check(&self) -> Result<(), Trouble> {
        check(&self.interrupted)
    }

    /// Sends this in one segment. That the connection is closed shows when its answer is read.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        let sent = self.stream.set_write_timeout(Some(LIMIT));
        match sent.and_then(|()| self.stream.write_all(bytes)) {
            Err(error) if !is_end(error.kind()) => Err(Trouble::Lost(error.to_string())),
            _ => Ok(()),
        }
    }

    /// Waits for this number of bytes.
    pub(super) fn hear(&mut self, count: usize, limit: Duration) -> Result<Heard, Trouble> {
        let interrupted = self.interrupted.clone();
        self.hear_unless(&interrupted, count, limit)
    }

    fn hear_unless(
        &mut self,
        interrupted: &Receiver<()>,
        count: usize,
        limit: Duration,
    ) -> Result<Heard, Trouble> {
        let begin = Instant::now();
        let mut bytes = vec![0; count];
        let mut there = 0;
        while there < count {
            check(interrupted)?;
            if let Some(request) = self.at_interrupt.take_if(|_| !self.interrupted.is_empty()) {
                self.send(&request)?;
            }
            let left = limit.saturating_sub(begin.elapsed());
            if left.is_zero() {
                return Ok(Heard::Silence);
            }
            let limited = self.stream.set_read_timeout(Some(left.min(SLICE)));
            match limited.and_then(|()| self.stream.read(&mut bytes[there..])) {
                Ok(0) => return Ok(Heard::Closed),
                Ok(more) => there += more,
                Err(error) if is_pause(error.kind()) => {}
                Err(_) => return Ok(Heard::Closed),
            }
        }
        Ok(Heard::Bytes(bytes))
    }

    /// Sends this on a connection that is given up.
    pub(super) fn send_last(&mut self, bytes: &[u8]) {
        let sent = self.send(bytes).is_ok() && self.stream.shutdown(Shutdown::Write).is_ok();
        let begin = Instant::now();
        while sent && begin.elapsed() < FAREWELL {
            let limited = self.stream.set_read_timeout(Some(SLICE));
            match limited.and_then(|()| self.stream.read(&mut [0; 4096])) {
                Ok(1..) => {}
                Err(error) if is_pause(error.kind()) => {}
                Ok(0) | Err(_) => return,
            }
        }
    }

    /// The answer to `request`, which has this number of bytes.
    pub(super) fn ask(&mut self, request: &[u8], count: usize) -> Result<Vec<u8>, Trouble> {
        self.send(request)?;
        self.receive(count)
    }

    /// Bytes without which a check can't go on.
    pub(super) fn receive(&mut self, count: usize) -> Result<Vec<u8>, Trouble> {
        match self.hear_unless(&never(), count, LIMIT)? {
            Heard::Bytes(bytes) => Ok(bytes),
            Heard::Closed => Err(Trouble::Lost("the controller closed the connection".to_owned())),
            Heard::Silence => Err(Trouble::Lost(format!("no answer within {LIMIT:?}"))),
        }
    }
}

fn check(interrupted: &Receiver<()>) -> Result<(), Trouble> {
    if interrupted.is_empty() {
        Ok(())
    } else {
        Err(Trouble::Interrupted)
    }
}

/// Whether the other side has ended the connection, or does not want it.
fn is_end(kind: ErrorKind) -> bool {
    use ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionRefused, ConnectionReset};

    matches!(kind, ConnectionRefused | ConnectionReset | ConnectionAborted | BrokenPipe)
}

fn is_pause(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// Waits, unless Ctrl-C is pressed.
pub(super) fn pause(time: Duration, interrupted: &Receiver<()>) -> Result<(), Trouble> {
    let begin = Instant::now();
    while begin.elapsed() < time {
        check(interrupted)?;
        std::thread::sleep(SLICE.min(time.saturating_sub(begin.elapsed())));
    }
    Ok(())
}
