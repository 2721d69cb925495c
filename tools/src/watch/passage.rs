//! One connection that passes through: bytes, half-closes and resets in both directions.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr};
use std::time::{Duration, Instant};

use mio::net::TcpStream;
use mio::{Interest, Registry, Token};
use socket2::SockRef;

use super::driven::Driven;
use super::halt::Halt;
use super::tap::{Piece, Tap, Telling, What};
use crate::seen::{Gone, Line, Side};

/// How much is passed on in one direction before the other connections have their turn.
pub(super) const TURN: usize = 1 << 20;
/// When a program that has gone meanwhile would have given up connecting.
const GIVEN_UP: Duration = Duration::from_secs(1);
/// How long a connection goes on of which one side has ended, when nothing passes any more. A side that has closed all
/// looks like one that only sends no more and still reads. StopOnline takes a second.
const HALF_LIMIT: Duration = Duration::from_secs(3);
/// How much is read at once.
pub(super) const CHUNK: usize = 64 * 1024;

/// The way in one direction.
#[derive(Default)]
struct Flow {
    /// What the receiver had no room for, and how much of it is sent.
    pending: Vec<u8>,
    sent: usize,
    /// The sender has said that nothing more comes.
    ended: bool,
    /// Whether the receiver knows that.
    told_end: bool,
    /// The connection is reset. That is not an end of a direction, and is not to be passed on as one.
    broken: bool,
    /// When something has passed last.
    used: Option<Instant>,
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
    /// The program has gone while it drove, so that the controller has to be stopped.
    Gone(Gone),
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
    /// What the program does on the main connection.
    driven: Option<Driven>,
    /// The controller is not stopped after it.
    pub(super) leaves_outputs: bool,
    /// The controller has broken the connection.
    controller_broke: bool,
    telling: Telling,
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
            driven: (line == Line::Main).then(Driven::new),
            leaves_outputs: false,
            controller_broke: false,
            telling: Telling::default(),
        })
    }

    /// Tries once more to connect to the controller.
    pub(super) fn try_again(
        &mut self,
        controller: SocketAddr,
        registry: &Registry,
        token: Token,
    ) -> io::Result<()> {
        self.controller = connect(controller, registry, token)?;
        self.stage = Stage::Connecting(Instant::now());
        Ok(())
    }

    /// Whether the connection to the controller is made by now. The error is why there is none.
    pub(super) fn is_connected(&mut self) -> io::Result<bool> {
        if self.stage == Stage::Open {
            return Ok(true);
        }
        let is_connected = is_connected(&self.controller)?;
        if is_connected {
            self.controller.set_nodelay(true)?;
            self.stage = Stage::Open;
        }
        Ok(is_connected)
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
        if let Some(gone) = self.gone(passed.as_ref().err(), chunk, tap) {
            return Then::Gone(gone);
        }
        if self.down.ended && !had_ended {
            let (line, connection) = (self.line, self.number);
            tap.report(Piece { line, connection, at: Instant::now(), what: What::ControllerEnded });
        }
        match passed {
            Ok(_) if self.up.told_end && self.down.told_end => Then::Closed,
            // The program's end was held back for nothing.
            Ok(false) if !(self.up.ended && !self.up.told_end && self.is_to_stop()) => Then::Waits,
            Ok(_) => Then::More,
            Err(Broken { side, error }) => {
                log::debug!("connection {} is reset: {error}", self.number);
                (self.up.broken, self.down.broken) = (true, true);
                self.controller_broke = side == Side::Controller;
                // What one side said before it reset the connection still arrives.
                let _ = self.pass_up(may_send, chunk, tap);
                let _ = self.pass_down(chunk, tap);
                self.reset();
                Then::Closed
            }
        }
    }

    /// Whether the program has gone while it drives. It may have sent StopOnline before its connection broke.
    fn gone(&mut self, broken: Option<&Broken>, chunk: &mut [u8], tap: &Tap) -> Option<Gone> {
        let is_broken = broken.is_some_and(|broken| broken.side == Side::Program);
        if is_broken && self.is_to_stop() {
            let _ = self.pass_up(true, chunk, tap);
        }
        let has_gone = is_broken || (broken.is_none() && self.up.ended && !self.down.ended);
        (has_gone && self.is_to_stop()).then_some(if is_broken {
            Gone::Reset
        } else {
            Gone::Closed
        })
    }

    /// Whether a program drives through it.
    pub(super) fn drives(&self) -> bool {
        self.driven.as_ref().is_some_and(Driven::drives)
    }

    /// When the controller has last answered an exchange of its program.
    pub(super) fn exchanged(&self) -> Option<Instant> {
        self.driven.as_ref().and_then(Driven::exchanged)
    }

    /// The same with the name of the controller, if its program has asked for it.
    pub(super) fn exchange(&self) -> Option<(Instant, Option<String>)> {
        let driven = self.driven.as_ref()?;
        Some((driven.exchanged()?, driven.name().map(str::to_owned)))
    }

    /// Whether the controller is to be stopped after it.
    pub(super) fn is_to_stop(&self) -> bool {
        self.drives() && !self.leaves_outputs
    }

    /// Whether the controller has said anything to a program that may drive.
    pub(super) fn is_served(&self) -> bool {
        self.driven.as_ref().is_some_and(Driven::is_served)
    }

    /// When the program will have been silent for too long.
    pub(super) fn silent_at(&self) -> Option<Instant> {
        let stops = self.driven.as_ref().filter(|_| !self.leaves_outputs);
        stops?.silent_at(!self.down.ended)
    }

    /// Whether the controller has ended it.
    pub(super) fn is_left(&self) -> bool {
        self.down.ended || self.controller_broke
    }

    /// When something has passed last.
    pub(super) fn used(&self) -> Instant {
        self.up.used.max(self.down.used).map_or(self.begun, |used| used.max(self.begun))
    }

    /// How much the program that drives through the main connection needs this one: it comes from the same computer,
    /// and the controller has said something on it since that program is there. A controller serves one connection
    /// to I2C or the camera at a time, and says nothing on others, whatever a stranger sends there.
    pub(super) fn serves(&self, main: &Self) -> (bool, bool) {
        let from = |one: &Self| one.program.peer_addr().ok().map(|from| from.ip());
        (from(self) == from(main), self.down.used.is_some_and(|heard| heard > main.begun))
    }

    /// Whether one side has ended, and the other has not.
    pub(super) fn is_half(&self) -> bool {
        self.up.ended != self.down.ended || self.up.told_end != self.down.told_end
    }

    /// When it will have been half a connection for too long. After one that drives, something else comes first.
    pub(super) fn ends_at(&self) -> Option<Instant> {
        (self.is_half() && !self.is_to_stop()).then(|| self.used() + HALF_LIMIT)
    }

    /// Stops the controller, if a program has driven it.
    pub(super) fn halt(self, gone: Gone, tap: &Tap) -> Option<Halt> {
        let driven = self.driven.filter(|one| one.drives() && !self.leaves_outputs)?;
        // Behind the part of a command, and after its end, the controller understands nothing.
        let is_clear = self.up.pending.is_empty() && !self.down.ended;
        let controller = Some(self.controller).filter(|_| is_clear);
        Some(Halt::now(gone, self.number, driven, controller, tap))
    }

    /// Stops the controller that has ended the connection, or has not answered a farewell, if no program comes back.
    pub(super) fn halt_later(self) -> Option<Halt> {
        let has_ended = self.is_left();
        let driven = self.driven.filter(|one| one.has_left_on() && !self.leaves_outputs)?;
        let gone = if has_ended || driven.drives() { Gone::Lost } else { Gone::Unanswered };
        Some(Halt::later(gone, self.number, driven))
    }

    fn pass_up(&mut self, may_send: bool, chunk: &mut [u8], tap: &Tap) -> Result<bool, Broken> {
        if !may_send {
            return Ok(false);
        }
        let witness = Witness {
            tap,
            line: self.line,
            connection: self.number,
            side: Side::Program,
            holds_end: !self.down.ended && !self.leaves_outputs,
            driven: self.driven.as_mut(),
            telling: &mut self.telling,
        };
        pass(&mut self.program, &mut self.controller, &mut self.up, chunk, witness)
    }

    fn pass_down(&mut self, chunk: &mut [u8], tap: &Tap) -> Result<bool, Broken> {
        let witness = Witness {
            tap,
            line: self.line,
            connection: self.number,
            side: Side::Controller,
            holds_end: false,
            driven: self.driven.as_mut(),
            telling: &mut self.telling,
        };
        pass(&mut self.controller, &mut self.program, &mut self.down, chunk, witness)
    }

    /// Both sides see that the connection has broken.
    pub(super) fn reset(&self) {
        reset(&self.program);
        reset(&self.controller);
    }
}

/// The other side sees that the connection has broken when this one is closed.
pub(super) fn reset(side: &TcpStream) {
    // Without it, the connection ends a little more politely.
    let _ = SockRef::from(side).set_linger(Some(Duration::ZERO));
}

/// Begins to connect to a controller.
pub(super) fn connect(to: SocketAddr, registry: &Registry, token: Token) -> io::Result<TcpStream> {
    let mut stream = TcpStream::connect(to)?;
    registry.register(&mut stream, token, Interest::READABLE | Interest::WRITABLE)?;
    Ok(stream)
}

/// Whether a connection to a controller is made by now. The error is why there is none.
pub(super) fn is_connected(controller: &TcpStream) -> io::Result<bool> {
    if let Some(error) = controller.take_error()? {
        return Err(error);
    }
    match controller.peer_addr() {
        // Where nothing listens on this computer, a system may connect the port with itself.
        Ok(peer) if controller.local_addr()? == peer => Err(ErrorKind::ConnectionRefused.into()),
        Ok(_) => Ok(true),
        Err(error) if is_pending(&error) => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whose connection has broken.
struct Broken {
    side: Side,
    error: io::Error,
}

/// Sees what has passed from one side, after it has passed.
struct Witness<'a> {
    tap: &'a Tap,
    line: Line,
    connection: u64,
    side: Side,
    /// The end of this side is not passed on while a program drives: it is gone then, and something else comes first.
    holds_end: bool,
    driven: Option<&'a mut Driven>,
    telling: &'a mut Telling,
}

impl Witness<'_> {
    fn report(&mut self, at: Instant, bytes: &[u8]) {
        match (self.side, &mut self.driven) {
            (Side::Program, Some(driven)) => driven.sent(at, bytes),
            (Side::Controller, Some(driven)) => driven.received(at, bytes),
            (_, None) => {}
        }
        // The controller serves one: others that go online, too, have no more room than those that look.
        let drives = self.driven.as_ref().is_some_and(|one| one.drives() && one.is_served());
        let connection = (self.line, self.connection);
        self.tap.pass_bytes(connection, self.side, at, bytes, (self.telling, drives));
    }

    /// Whether the end of this side is passed on.
    fn passes_end(&self) -> bool {
        !(self.holds_end && self.driven.as_ref().is_some_and(|driven| driven.drives()))
    }

    /// The side that sends is the one that has broken.
    fn sender_broke(&self, error: io::Error) -> Broken {
        Broken { side: self.side, error }
    }

    fn receiver_broke(&self, error: io::Error) -> Broken {
        let side = match self.side {
            Side::Program => Side::Controller,
            Side::Controller => Side::Program,
        };
        Broken { side, error }
    }
}

/// Passes on in one direction until there is nothing more, or no room. Returns whether there may be more at once.
fn pass(
    from: &mut TcpStream,
    to: &mut TcpStream,
    flow: &mut Flow,
    chunk: &mut [u8],
    mut witness: Witness,
) -> Result<bool, Broken> {
    let mut passed = 0;
    while !flow.told_end {
        if !send_pending(to, flow).map_err(|error| witness.receiver_broke(error))? {
            return Ok(false);
        }
        if flow.ended {
            if !witness.passes_end() {
                return Ok(false);
            }
            if !flow.broken {
                let seen = to.shutdown(Shutdown::Write).or_else(unless_gone);
                seen.map_err(|error| witness.receiver_broke(error))?;
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
                flow.used = Some(Instant::now());
                continue;
            }
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(false),
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(witness.sender_broke(error)),
        };
        let at = Instant::now();
        flow.used = Some(at);
        let sent = write(to, &chunk[..count]);
        witness.report(at, &chunk[..count]);
        let sent = sent.map_err(|error| witness.receiver_broke(error))?;
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
    let sent = write(to, &flow.pending[flow.sent..])?;
    if sent > 0 {
        flow.sent += sent;
        flow.used = Some(Instant::now());
    }
    let done = flow.sent == flow.pending.len();
    if done {
        flow.pending.clear();
        flow.sent = 0;
    }
    Ok(done)
}

/// Writes as many bytes as there is room for.
fn write(to: &mut impl Write, bytes: &[u8]) -> io::Result<usize> {
    let mut sent = 0;
    while sent < bytes.len() {
        match to.write(&bytes[sent..]) {
            // It never takes any more.
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
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

#[cfg(test)]
mod tests {
    use ft_transfer_area::wire::{ResponseId, StartOnline};

    use super::super::tap::tap;
    use super::*;

    #[test]
    fn only_a_program_that_the_controller_serves_has_the_room_of_the_one_that_drives() {
        let (tap, _pieces) = tap();
        for is_served in [false, true] {
            let (mut driven, mut start, at) = (Driven::new(), Vec::new(), Instant::now());
            StartOnline::new().emit(&mut start);
            driven.sent(at, &start);
            if is_served {
                driven.received(at, &ResponseId::StartOnline.id().to_le_bytes());
            }
            let mut telling = Telling::default();
            let mut witness = Witness {
                tap: &tap,
                line: Line::Main,
                connection: 1,
                side: Side::Program,
                holds_end: false,
                driven: Some(&mut driven),
                telling: &mut telling,
            };
            (0..(10 << 20) / CHUNK).for_each(|_| witness.report(at, &[0; CHUNK]));
            assert_eq!(telling.missed, !is_served);
        }
    }

    #[test]
    fn a_receiver_that_takes_nothing_is_an_error() {
        let mut room = [0; 2];
        let error = write(&mut &mut room[..], b"abc").unwrap_err();
        assert_eq!((error.kind(), room), (ErrorKind::WriteZero, *b"ab"));
    }
}
