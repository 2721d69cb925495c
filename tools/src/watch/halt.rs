//! Stops a controller whose program has gone, on the connection that the program had.
//!
//! The maker's firmware switches nothing off when a connection ends. So the command that does goes out before anything
//! else is done, and then StopOnline. Where that can't be, a new connection does the same.

use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CommandId, StartOnline};
use mio::net::TcpStream;

use super::driven::{Driven, Responses};
use super::passage::{is_connected, reset, TURN};
use super::tap::{Piece, Tap, Telling, What};
use crate::print;
use crate::seen::{Gone, Line, Side};

/// How long the controller may take for an answer. StopOnline and a board that does not answer take a second each.
const ANSWER: Duration = Duration::from_secs(2);
/// How long all of it may take. A controller whose firmware has crashed is back after two seconds.
const WHOLE: Duration = Duration::from_secs(6);
/// The pause between two connections.
const RETRY: Duration = Duration::from_millis(100);
/// How long a program may take to come back to a controller that has ended the connection.
const RETURN: Duration = Duration::from_secs(2);
/// The same for all that come back and do not exchange.
const LATEST: Duration = Duration::from_secs(6);

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// The program may come back until then.
    Waits(Instant),
    /// A new connection is made then.
    Pauses(Instant),
    Connects,
    /// A command was sent, and its response is waited for.
    Asks,
    Starts,
    SwitchesOff,
    Ends,
    Done,
}

pub(super) struct Halt {
    gone: Gone,
    /// The number of the program's connection.
    pub(super) connection: u64,
    step: Step,
    controller: Option<TcpStream>,
    /// The firmware waits for a connection to I2C for 5 s from StartOnline on. One that is made and closed ends that:
    /// then StopOnline takes no second, and the firmware survives the next StartOnline.
    i2c: Option<TcpStream>,
    /// The connection is still the program's, and what passes on it is reported. Afterwards its end was reported.
    is_own: bool,
    telling: Telling,
    responses: Responses,
    /// The controller may have said more.
    has_more: bool,
    zeros: Vec<u8>,
    /// The name of the controller that the program has driven.
    name: Option<String>,
    /// When the program has gone.
    begun: Instant,
    /// When the present step is given up, and when everything.
    answer_until: Instant,
    until: Instant,
    /// Until when programs that do not exchange put it off.
    latest: Instant,
}

impl Halt {
    /// Sends the command, at once, if there is a connection on which it is understood.
    pub(super) fn now(
        gone: Gone,
        connection: u64,
        driven: Driven,
        controller: Option<TcpStream>,
        tap: &Tap,
    ) -> Self {
        let mut halt = Self::new(gone, connection, driven, controller);
        let sent = halt.controller.as_mut().map(|controller| send(controller, &halt.zeros));
        halt.report(tap, What::Gone);
        if matches!(sent, Some(Ok(()))) {
            halt.step = Step::SwitchesOff;
            halt.responses.expect(&halt.zeros);
            halt.pass_bytes(tap, Side::Program, &halt.zeros.clone());
        } else {
            halt.close(tap);
        }
        halt
    }

    /// Waits some time for the program to come back, as after the controller has ended the connection.
    pub(super) fn later(gone: Gone, connection: u64, driven: Driven) -> Self {
        let mut halt = Self::new(gone, connection, driven, None);
        halt.is_own = false;
        halt.put_off();
        halt
    }

    fn new(gone: Gone, connection: u64, driven: Driven, controller: Option<TcpStream>) -> Self {
        let now = Instant::now();
        Self {
            gone,
            connection,
            step: Step::Pauses(now),
            controller: controller.filter(|controller| is_clear(controller, &driven)),
            i2c: None,
            is_own: true,
            telling: Telling::default(),
            zeros: driven.zeros(),
            name: driven.name().map(str::to_owned),
            responses: driven.into_responses(),
            has_more: false,
            begun: now,
            answer_until: now + ANSWER,
            until: now + WHOLE,
            latest: now + LATEST,
        }
    }

    /// Whether it waits for the program to come back.
    pub(super) fn waits(&self) -> bool {
        matches!(self.step, Step::Waits(_))
    }

    /// Whether nothing is left but a new connection.
    pub(super) fn pauses(&self) -> bool {
        matches!(self.step, Step::Pauses(_))
    }

    /// Whether it waits for nothing more, when a controller with this name has answered an exchange of another program at
    /// this time: what was left is off since then, or that program's. Nothing can be done any more about another controller.
    pub(super) fn is_over_since(&self, exchanged: Instant, now: Option<&str>, tap: &Tap) -> bool {
        let is_over = self.waits() && self.begun < exchanged;
        if is_over {
            self.tell_of_another(now, tap);
        }
        is_over
    }

    /// Tells that motors may go on, if the controller with this name is another one.
    pub(super) fn tell_of_another(&self, now: Option<&str>, tap: &Tap) {
        if let Err(other) = self.check_name(now) {
            self.report(tap, What::Halted(self.gone, Err(other)));
        }
    }

    /// Nobody comes back any more.
    pub(super) fn go_on_at_once(&mut self) {
        let now = Instant::now();
        (self.step, self.until) = (Step::Pauses(now), now + WHOLE);
    }

    /// Whether no program has come back and exchanged in all that time, but others are connected.
    pub(super) fn is_overdue(&self) -> bool {
        self.waits() && self.latest <= Instant::now()
    }

    /// Waits from now on.
    pub(super) fn put_off(&mut self) {
        let now = Instant::now();
        self.step = Step::Waits(self.latest.min(now + RETURN));
        self.until = now + RETURN + WHOLE;
    }

    /// When to go on at the latest.
    pub(super) fn next_at(&self) -> Instant {
        match self.step {
            Step::Waits(at) | Step::Pauses(at) => at,
            _ if self.has_more => Instant::now(),
            _ => self.answer_until,
        }
    }

    /// Goes on as far as it can. `connect` makes a new connection. Returns whether all is done.
    pub(super) fn go_on(
        &mut self,
        connect: impl Fn(Line) -> io::Result<TcpStream>,
        chunk: &mut [u8],
        tap: &Tap,
    ) -> bool {
        while self.step != Step::Done {
            let step = self.step;
            let over = match self.is_over(chunk, tap) {
                Ok(false) => return false,
                Ok(true) => Ok(()),
                Err(error) => Err(error),
            };
            let is_off = over.is_ok() && step == Step::SwitchesOff;
            if is_off {
                self.report(tap, What::Halted(self.gone, Ok(())));
            }
            if let Err(error) = over.and_then(|()| self.next(&connect, tap)) {
                if is_off || step == Step::Ends {
                    // The outputs are off, even if StopOnline does not reach the controller.
                    self.step = Step::Done;
                } else if Instant::now() + RETRY > self.until {
                    self.step = Step::Done;
                    self.report(tap, What::Halted(self.gone, Err(error)));
                } else {
                    self.step = Step::Pauses(Instant::now() + RETRY);
                    self.close(tap);
                }
            }
        }
        self.close(tap);
        true
    }

    /// Closes the connection, before that is reported.
    fn close(&mut self, tap: &Tap) {
        self.controller = None;
        if std::mem::take(&mut self.is_own) {
            self.report(tap, What::Closed);
        }
    }

    /// Whether the present step is done.
    fn is_over(&mut self, chunk: &mut [u8], tap: &Tap) -> io::Result<bool> {
        self.i2c.take_if(|i2c| !matches!(is_connected(i2c), Ok(false)));
        let now = Instant::now();
        let is_over = match (self.step, &self.controller) {
            (Step::Waits(at) | Step::Pauses(at), _) => return Ok(at <= now),
            (Step::Connects, Some(controller)) => is_connected(controller)?,
            _ => {
                self.hear(chunk, tap)?;
                self.responses.are_all_here()
            }
        };
        if !is_over && self.answer_until <= now {
            return Err(ErrorKind::TimedOut.into());
        }
        Ok(is_over)
    }

    /// Begins the next step.
    fn next(
        &mut self,
        connect: &impl Fn(Line) -> io::Result<TcpStream>,
        tap: &Tap,
    ) -> io::Result<()> {
        let mut packet = Vec::new();
        let step = match self.step {
            Step::Waits(_) | Step::Pauses(_) => {
                self.responses = Responses::default();
                self.controller = Some(connect(Line::Main)?);
                Step::Connects
            }
            // Another one may have this address by now.
            Step::Connects if self.name.is_some() => {
                CommandId::QueryStatus.emit(&mut packet);
                Step::Asks
            }
            Step::Connects | Step::Asks => {
                self.check_name(self.responses.name())
                    .inspect_err(|_| self.until = Instant::now())?;
                StartOnline::new().emit(&mut packet);
                Step::Starts
            }
            Step::Starts => {
                packet.clone_from(&self.zeros);
                Step::SwitchesOff
            }
            Step::SwitchesOff => {
                self.i2c = connect(Line::I2c).ok();
                CommandId::StopOnline.emit(&mut packet);
                Step::Ends
            }
            Step::Ends | Step::Done => Step::Done,
        };
        if let Some(controller) = self.controller.as_mut().filter(|_| !packet.is_empty()) {
            send(controller, &packet)?;
            self.responses.expect(&packet);
            self.pass_bytes(tap, Side::Program, &packet);
        }
        self.answer_until = self.until.min(Instant::now() + ANSWER);
        self.step = step;
        Ok(())
    }

    /// An error if another controller answers now, which is left alone.
    fn check_name(&self, now: Option<&str>) -> io::Result<()> {
        match (&self.name, now) {
            (Some(before), Some(now)) if before != now => {
                let other = format!("{now} answers there in place of {before}");
                Err(io::Error::other(print::clean(&other).into_owned()))
            }
            _ => Ok(()),
        }
    }

    /// Takes in what the controller has said, as much as has its turn.
    fn hear(&mut self, chunk: &mut [u8], tap: &Tap) -> io::Result<()> {
        let mut heard = 0;
        self.has_more = false;
        while let Some(controller) = &mut self.controller {
            if heard >= TURN {
                self.has_more = true;
                break;
            }
            match controller.read(chunk) {
                // What it has said before counts.
                Ok(0) if self.responses.are_all_here() => break,
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    heard += count;
                    self.responses.take(&chunk[..count]);
                    self.pass_bytes(tap, Side::Controller, &chunk[..count]);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn report(&self, tap: &Tap, what: What) {
        let (line, connection) = (Line::Main, self.connection);
        tap.report(Piece { line, connection, at: Instant::now(), what });
    }

    fn pass_bytes(&mut self, tap: &Tap, side: Side, bytes: &[u8]) {
        if self.is_own {
            let (line, connection) = (Line::Main, self.connection);
            let seen = (&mut self.telling, true);
            tap.pass_bytes((line, connection), side, Instant::now(), bytes, seen);
        }
    }
}

/// Whether the controller understands a command on this connection, and soon.
fn is_clear(controller: &TcpStream, driven: &Driven) -> bool {
    if !driven.has_few_waiting() {
        // It need not go through all of them before it serves another connection.
        reset(controller);
    }
    driven.is_between_commands() && driven.has_few_waiting()
}

/// Sends a command in one piece: a TXT takes no other. Where there is no room for one, the controller reads nothing.
fn send(controller: &mut TcpStream, command: &[u8]) -> io::Result<()> {
    // Without it, a command waits for the answer to the one before.
    controller.set_nodelay(true)?;
    match controller.write(command)? {
        sent if sent == command.len() => Ok(()),
        _ => Err(ErrorKind::WriteZero.into()),
    }
}
