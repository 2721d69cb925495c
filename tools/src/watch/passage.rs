//! One connection that passes through: bytes, half-closes and resets in both directions.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr};
use std::time::{Duration, Instant};

use mio::net::TcpStream;
use mio::{Interest, Registry, Token};
use socket2::SockRef;

use super::tap::{Piece, Tap, What};
use crate::told::Line;

/// How much is passed on in one direction before the other connections have their turn.
const TURN: usize = 1 << 20;
/// When a program that has gone meanwhile would have given up connecting.
const GIVEN_UP: Duration = Duration::from_secs(1);
/// How much is read at once.
pub(super) const CHUNK: usize = 64 * 1024;

/// The way in one direction.
#[derive(Default)]
struct Flow {
    /// What the receiver had no room for, and how much of it is sent.
    pending: Vec<u8>,
    sent: usize,
    /// The sender has said that nothing more comes, and whether the receiver was told.
    ended: bool,
    told_end: bool,
    /// The connection is reset. That is not an end of a direction, and is not to be passed on as one.
    broken: bool,
}

/// Where a connection stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// Since then.
    Connecting(Instant),
    /// The camera's port was not open yet: the next attempt is at this time.
    Again(Instant),
    Open,
}

/// What has become of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Then {
    /// It waits for more.
    Waits,
    /// There is more to pass on at once.
    More,
    Closed,
}

pub(super) struct Passage {
    pub(super) line: Line,
    pub(super) number: u64,
    pub(super) stage: Stage,
    /// When the program came.
    pub(super) begun: Instant,
    /// The program has gone, or sends nothing more, since before it was connected.
    pub(super) program_ended: bool,
    program: TcpStream,
    controller: TcpStream,
    up: Flow,
    down: Flow,
    /// Nothing of it is reported any more, because too much waited to be looked at.
    missed: bool,
}

impl Passage {
    /// Begins to connect to the controller for a program that has connected.
    pub(super) fn begin(
        (line, number): (Line, u64),
        mut program: TcpStream,
        controller: SocketAddr,
        registry: &Registry,
        [of_program, of_controller]: [Token; 2],
    ) -> io::Result<Self> {
        program.set_nodelay(true)?;
        let mut to_controller = TcpStream::connect(controller).inspect_err(|_| reset(&program))?;
        let both = Interest::READABLE | Interest::WRITABLE;
        registry.register(&mut program, of_program, both)?;
        registry.register(&mut to_controller, of_controller, both)?;
        let now = Instant::now();
        Ok(Self {
            line,
            number,
            stage: Stage::Connecting(now),
            begun: now,
            program_ended: false,
            program,
            controller: to_controller,
            up: Flow::default(),
            down: Flow::default(),
            missed: false,
        })
    }

    /// Tries once more to connect to the controller.
    pub(super) fn try_again(
        &mut self,
        controller: SocketAddr,
        registry: &Registry,
        token: Token,
    ) -> io::Result<()> {
        self.controller = TcpStream::connect(controller)?;
        registry.register(&mut self.controller, token, Interest::READABLE | Interest::WRITABLE)?;
        self.stage = Stage::Connecting(Instant::now());
        Ok(())
    }

    /// Whether the connection to the controller is made by now. The error is why there is none.
    pub(super) fn is_connected(&mut self) -> io::Result<bool> {
        if self.stage == Stage::Open {
            return Ok(true);
        }
        if let Some(error) = self.controller.take_error()? {
            return Err(error);
        }
        match self.controller.peer_addr() {
            // Where nothing listens on this computer, a system may connect the port with itself.
            Ok(peer) if self.controller.local_addr()? == peer => {
                Err(ErrorKind::ConnectionRefused.into())
            }
            Ok(_) => {
                self.controller.set_nodelay(true)?;
                self.stage = Stage::Open;
                Ok(true)
            }
            Err(error) if is_pending(&error) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Whether the program still waits for a connection that is not made yet.
    pub(super) fn program_waits(&self) -> bool {
        match self.program.peek(&mut [0]) {
            Ok(0) => false,
            Ok(_) => true,
            Err(error) => error.kind() == ErrorKind::WouldBlock,
        }
    }

    /// When the program has given up a connection, if it has gone.
    pub(super) fn given_up_at(&self) -> Instant {
        self.begun + GIVEN_UP
    }

    /// Whether the program has gone before the connection was made, and would not have waited for it.
    pub(super) fn is_given_up(&self) -> bool {
        self.program_ended && self.given_up_at() < Instant::now()
    }

    /// Passes on what is there in both directions. `may_send` is false while the program's bytes have to wait.
    pub(super) fn pass(&mut self, may_send: bool, chunk: &mut [u8], tap: &Tap) -> Then {
        let had_ended = self.down.ended;
        let passed = self.pass_up(may_send, chunk, tap).and_then(|up| {
            let down = self.pass_down(chunk, tap)?;
            Ok(up || down)
        });
        if self.down.ended && !had_ended {
            let (line, connection) = (self.line, self.number);
            tap.tell(Piece { line, connection, at: Instant::now(), what: What::ControllerEnded });
        }
        match passed {
            Ok(_) if self.up.told_end && self.down.told_end => Then::Closed,
            Ok(true) => Then::More,
            Ok(false) => Then::Waits,
            Err(error) => {
                log::debug!("connection {} is reset: {error}", self.number);
                (self.up.broken, self.down.broken) = (true, true);
                // What one side said before it reset the connection still arrives.
                let _ = self.pass_up(may_send, chunk, tap);
                let _ = self.pass_down(chunk, tap);
                self.reset();
                Then::Closed
            }
        }
    }

    fn pass_up(&mut self, may_send: bool, chunk: &mut [u8], tap: &Tap) -> io::Result<bool> {
        if !may_send {
            return Ok(false);
        }
        let mut witness =
            Witness { tap, line: self.line, number: self.number, missed: &mut self.missed };
        let tell = |at, bytes: &[u8]| witness.tell(at, bytes, What::FromProgram);
        pass(&mut self.program, &mut self.controller, &mut self.up, chunk, tell)
    }

    fn pass_down(&mut self, chunk: &mut [u8], tap: &Tap) -> io::Result<bool> {
        let mut witness =
            Witness { tap, line: self.line, number: self.number, missed: &mut self.missed };
        let tell = |at, bytes: &[u8]| witness.tell(at, bytes, What::FromController);
        pass(&mut self.controller, &mut self.program, &mut self.down, chunk, tell)
    }

    /// Both sides see that the connection has broken.
    pub(super) fn reset(&self) {
        reset(&self.program);
        reset(&self.controller);
    }
}

/// The other side sees that the connection has broken when this one is closed.
fn reset(side: &TcpStream) {
    // Without it, the connection ends a little more politely.
    let _ = SockRef::from(side).set_linger(Some(Duration::ZERO));
}

/// Tells what has passed, after it has passed.
struct Witness<'a> {
    tap: &'a Tap,
    line: Line,
    number: u64,
    missed: &'a mut bool,
}

impl Witness<'_> {
    fn tell(&mut self, at: Instant, bytes: &[u8], what: fn(Vec<u8>) -> What) {
        if *self.missed {
            return;
        }
        let what = if self.tap.reserve(bytes.len()) {
            what(bytes.to_vec())
        } else {
            *self.missed = true;
            What::Missed
        };
        self.tap.tell(Piece { line: self.line, connection: self.number, at, what });
    }
}

/// Passes on in one direction until there is nothing more, or no room. Returns whether there may be more at once.
fn pass(
    from: &mut TcpStream,
    to: &mut TcpStream,
    flow: &mut Flow,
    chunk: &mut [u8],
    mut tell: impl FnMut(Instant, &[u8]),
) -> io::Result<bool> {
    let mut passed = 0;
    while !flow.told_end {
        if !send_pending(to, flow)? {
            return Ok(false);
        }
        if flow.ended {
            if !flow.broken {
                to.shutdown(Shutdown::Write).or_else(unless_gone)?;
            }
            flow.told_end = true;
            break;
        }
        if passed >= TURN {
            return Ok(true);
        }
        let count = match from.read(chunk) {
            Ok(0) => {
                flow.ended = true;
                continue;
            }
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        let at = Instant::now();
        let sent = write(to, &chunk[..count]);
        tell(at, &chunk[..count]);
        let sent = sent?;
        flow.pending.extend_from_slice(&chunk[sent..count]);
        passed += count;
    }
    Ok(false)
}

/// Sends what had no room; returns whether nothing is left.
fn send_pending(to: &mut TcpStream, flow: &mut Flow) -> io::Result<bool> {
    if flow.pending.is_empty() {
        return Ok(true);
    }
    flow.sent += write(to, &flow.pending[flow.sent..])?;
    let done = flow.sent == flow.pending.len();
    if done {
        flow.pending.clear();
        flow.sent = 0;
    }
    Ok(done)
}

/// Writes as many bytes as there is room for.
fn write(to: &mut TcpStream, bytes: &[u8]) -> io::Result<usize> {
    let mut sent = 0;
    while sent < bytes.len() {
        match to.write(&bytes[sent..]) {
            Ok(count) => sent += count,
            Err(error) if error.kind() == ErrorKind::WouldBlock => break,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(sent)
}

/// A side that has gone need not be notified of an end.
fn unless_gone(error: io::Error) -> io::Result<()> {
    if error.kind() == ErrorKind::NotConnected {
        return Ok(());
    }
    Err(error)
}

/// Whether a connection is being made. The operating systems have several words for it.
fn is_pending(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::NotConnected | ErrorKind::WouldBlock)
}
