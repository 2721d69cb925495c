//! Stops a controller whose program has gone, on the connection that the program had.
//!
//! A TXT switches nothing off when a connection ends. So the command that does goes out before anything else is done,
//! and then StopOnline. Where that can't be, a new connection does the same.

use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CommandId, StartOnline};
use mio::net::TcpStream;

use super::driven::{Driven, Responses};
use super::passage::is_connected;
use crate::told::Side;

/// How long the controller may take for an answer. StopOnline and a board that does not answer take a second each.
const ANSWER: Duration = Duration::from_secs(2);
/// How long all of it may take. A controller whose firmware has crashed is back after two seconds.
const WHOLE: Duration = Duration::from_secs(6);
/// The pause between two connections.
const RETRY: Duration = Duration::from_millis(100);

/// What has become of it.
#[derive(Debug)]
pub(super) enum News {
    /// The controller has answered the command that switches all outputs off.
    Off,
    /// It could not be sent, or was not answered.
    Failed(io::Error),
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// A new connection is made then.
    Pauses(Instant),
    Connects,
    /// A command was sent, and its response is waited for.
    Starts,
    SwitchesOff,
    Ends,
    Done,
}

/// Takes what passes on the program's own connection.
pub(super) type Tell<'a> = &'a mut dyn FnMut(Side, &[u8]);

pub(super) struct Halt {
    step: Step,
    responses: Responses,
    zeros: Vec<u8>,
    /// The connection is still the program's.
    is_own: bool,
    /// When the present step is given up, and when everything.
    answer_until: Instant,
    until: Instant,
}

impl Halt {
    /// Sends the command, at once. Not on a connection where it would not be understood: with `is_clear` false, the
    /// controller waits for the rest of another one.
    pub(super) fn begin(driven: Driven, is_clear: bool, controller: &mut TcpStream) -> Self {
        let zeros = driven.zeros();
        let is_own = is_clear && driven.is_between_commands() && send(controller, &zeros).is_ok();
        let now = Instant::now();
        let step = if is_own { Step::SwitchesOff } else { Step::Pauses(now) };
        let mut responses = driven.into_responses();
        responses.expect();
        Self { step, responses, zeros, is_own, answer_until: now + ANSWER, until: now + WHOLE }
    }

    /// What has passed on the program's connection.
    pub(super) fn sent(&self) -> Option<&[u8]> {
        self.is_own.then_some(&self.zeros)
    }

    pub(super) fn is_done(&self) -> bool {
        self.step == Step::Done
    }

    /// When to go on at the latest.
    pub(super) fn next_at(&self) -> Instant {
        match self.step {
            Step::Pauses(at) => at,
            _ => self.answer_until,
        }
    }

    /// Goes on as far as it can, and says once what has become of the outputs. `connect` makes a new connection.
    pub(super) fn go_on(
        &mut self,
        controller: &mut TcpStream,
        connect: impl Fn() -> io::Result<TcpStream>,
        chunk: &mut [u8],
        tell: Tell,
    ) -> Option<News> {
        while !self.is_done() {
            let step = self.step;
            let over = match self.is_over(controller, chunk, tell) {
                Ok(false) => return None,
                Ok(true) => Ok(()),
                Err(error) => Err(error),
            };
            let is_off = over.is_ok() && step == Step::SwitchesOff;
            if let Err(error) = over.and_then(|()| self.next(controller, &connect, tell)) {
                if is_off || step == Step::Ends {
                    // A controller that does not hear the farewell has its outputs off, too.
                    self.step = Step::Done;
                } else if Instant::now() + RETRY > self.until {
                    self.step = Step::Done;
                    return Some(News::Failed(error));
                } else {
                    self.step = Step::Pauses(Instant::now() + RETRY);
                }
            }
            if is_off {
                return Some(News::Off);
            }
        }
        None
    }

    /// Whether the present step is done.
    fn is_over(
        &mut self,
        controller: &mut TcpStream,
        chunk: &mut [u8],
        tell: Tell,
    ) -> io::Result<bool> {
        let now = Instant::now();
        let is_over = match self.step {
            Step::Pauses(at) => return Ok(at <= now),
            Step::Connects => is_connected(controller)?,
            _ => {
                self.hear(controller, chunk, tell)?;
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
        controller: &mut TcpStream,
        connect: &impl Fn() -> io::Result<TcpStream>,
        tell: Tell,
    ) -> io::Result<()> {
        let mut packet = Vec::new();
        let step = match self.step {
            Step::Pauses(_) => {
                self.is_own = false;
                self.responses = Responses::default();
                *controller = connect()?;
                Step::Connects
            }
            Step::Connects => {
                controller.set_nodelay(true)?;
                StartOnline::new().emit(&mut packet);
                Step::Starts
            }
            Step::Starts => {
                packet.clone_from(&self.zeros);
                Step::SwitchesOff
            }
            Step::SwitchesOff => {
                CommandId::StopOnline.emit(&mut packet);
                Step::Ends
            }
            Step::Ends | Step::Done => Step::Done,
        };
        if !packet.is_empty() {
            send(controller, &packet)?;
            self.responses.expect();
            if self.is_own {
                tell(Side::Program, &packet);
            }
        }
        self.answer_until = self.until.min(Instant::now() + ANSWER);
        self.step = step;
        Ok(())
    }

    /// Takes in what the controller has said.
    fn hear(&mut self, controller: &mut TcpStream, chunk: &mut [u8], tell: Tell) -> io::Result<()> {
        loop {
            match controller.read(chunk) {
                // What it has said before counts.
                Ok(0) if self.responses.are_all_here() => return Ok(()),
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    self.responses.take(&chunk[..count]);
                    if self.is_own {
                        tell(Side::Controller, &chunk[..count]);
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

/// Sends a command in one piece: a TXT takes no other. Where there is no room for one, the controller reads nothing.
fn send(controller: &mut TcpStream, command: &[u8]) -> io::Result<()> {
    match controller.write(command)? {
        sent if sent == command.len() => Ok(()),
        _ => Err(ErrorKind::WriteZero.into()),
    }
}
