//! The thread of the main connection and its sockets, and what the threads of all three ports need.

pub(crate) mod command;
pub(crate) mod faults;
mod outgoing;
mod pause;
pub(crate) mod port;
pub(crate) mod ports;
pub(crate) mod protocol;
pub(crate) mod reserved;
mod robo_pro;
pub(crate) mod shared;

use std::time::{Duration, Instant};

use command::{ahead, command_id, is_exchange, Ahead, Inbox, Misbehaviour};
use faults::{Faults, Position};
use ft_transfer_area::wire::{CommandId, ID_LEN};
use mio::net::TcpStream;
use outgoing::Outgoing;
use port::{has_passed, End, Link, Port, WRITE_LIMIT};
use protocol::{Protocol, Script, Settings};
use reserved::Reserved;
use robo_pro::{Reply, BLOCK};
use shared::{Shared, Stopped};

use crate::camera::ClientFinder;
use crate::fault::FaultKind;
use crate::machine::journal::notice;
use crate::machine::oddity::Oddity;
use crate::machine::Machine;

/// Serves one client after another.
pub(super) struct Server {
    pub(super) port: Port,
    pub(super) settings: Settings,
    pub(super) pace: Duration,
    /// Whether time passes by exchanges only.
    pub(super) lock_step: bool,
    pub(super) idle_limit: Duration,
    pub(super) faults: Faults,
    pub(super) script: Script,
    /// Looks for a camera client when the camera is started, if the camera itself does not.
    pub(super) camera_client_finder: Option<ClientFinder>,
    /// The port, if it ends and comes back as the firmware's program.
    pub(super) reserved: Option<Reserved>,
    /// Whether StartOnline and StopOnline take as long as with the firmware.
    pub(super) takes_its_time: bool,
}

/// How long the firmware's program is away when it has ended.
const AWAY: Duration = Duration::from_secs(2);

/// How long StartOnline takes.
const START: Duration = Duration::from_millis(520);

/// How long it waits for the port of the I2C server at most.
const I2C_START: Duration = Duration::from_secs(4);

/// How long StopOnline waits for the end of the I2C server.
const STOP: Duration = Duration::from_secs(1);

impl Server {
    /// Serves clients until the thread should end.
    pub(super) fn run(mut self) {
        while let Ok(stream) = self.port.accept() {
            if self.shared().read(Machine::absent) {
                notice!(Info, "the client is not served: the controller is away");
                continue;
            }
            let number = self.shared().with_machine(|machine| {
                machine.client_came();
                machine.connections()
            });
            let end = self.serve(stream);
            self.shared().with_machine(Machine::client_left);
            let Err(end) = end else { continue };
            let has_ended = matches!(end, End::EndsProgram(_));
            end.log(&format!("client {number}"));
            if has_ended && self.come_back().is_err() {
                return;
            }
        }
    }

    /// The program of the controller ends, and comes back.
    fn come_back(&mut self) -> Result<(), Stopped> {
        let Some(reserved) = &mut self.reserved else { return Ok(()) };
        self.port.close();
        reserved.refuse();
        self.port.shared().with_machine(Machine::program_ended);
        self.port.shared().sleep(AWAY)?;
        if let Err(error) = reserved.listen(&mut self.port) {
            notice!(Error, "the controller does not come back at {}: {error}", reserved.address);
            return Err(Stopped);
        }
        Ok(())
    }

    fn shared(&self) -> &Shared {
        self.port.shared()
    }

    fn serve(&mut self, stream: TcpStream) -> Result<(), End> {
        let link = Link::new(&self.port, stream)?;
        let protocol = Protocol::new(self.settings.clone());
        let mut connection = Connection {
            server: self,
            link,
            inbox: Inbox::new(),
            end: None,
            protocol,
            response: Vec::new(),
            responses: 0,
            exchanges: 0,
            due: None,
        };
        loop {
            connection.serve_command()?;
        }
    }
}

impl Drop for Server {
    /// If a script panics, the camera ends too.
    fn drop(&mut self) {
        self.shared().stop();
    }
}

impl From<Misbehaviour> for End {
    fn from(what: Misbehaviour) -> Self {
        match what {
            Misbehaviour::EndsProgram(why) => Self::EndsProgram(why),
            what => Self::Misbehaved(what.to_string()),
        }
    }
}

struct Connection<'a> {
    server: &'a mut Server,
    link: Link,
    inbox: Inbox,
    /// How the client has ended the connection. What it sent before is still answered.
    end: Option<End>,
    protocol: Protocol,
    /// An empty buffer for the next response.
    response: Vec<u8>,
    /// The number of responses, sent or not.
    responses: u64,
    /// The number of responses to exchanges.
    exchanges: u64,
    /// When the next exchange response is due.
    due: Option<Instant>,
}

impl Connection<'_> {
    /// Waits for a command, carries it out and sends the response.
    fn serve_command(&mut self) -> Result<(), End> {
        let id = self.wait_for_command()?;
        let is_exchange = is_exchange(id);
        let outgoing = self.carry_out(is_exchange)?;
        self.take_time(id)?;
        if let (CommandId::StartCameraOnline, Some(finder)) =
            (id, &self.server.camera_client_finder)
        {
            finder.find();
        }
        self.delay(outgoing.delay)?;
        self.look_ahead(is_exchange);
        if is_exchange {
            self.due = Some(next_due(self.due, Instant::now(), self.server.pace));
        }
        self.send(outgoing)?;
        match self.server.shared().with_machine(Machine::take_end) {
            Some(end) => Err(end.into()),
            None => Ok(()),
        }
    }

    /// Takes the time that a command takes with the firmware.
    fn take_time(&self, id: CommandId) -> Result<(), Stopped> {
        let shared = self.server.shared();
        match id {
            CommandId::StartOnline if self.server.reserved.is_some() => {
                if self.server.takes_its_time {
                    shared.sleep(START)?;
                }
                // Its client may connect at once, and its thread be late on a busy computer.
                shared.wait_until(I2C_START, |machine| machine.i2c_session().has_begun());
                shared.check()
            }
            CommandId::StopOnline if self.server.takes_its_time => {
                // A client may just have closed its I2C connection.
                shared.wait_until(STOP, |machine| !machine.i2c_session().is_busy());
                shared.check()
            }
            _ => Ok(()),
        }
    }

    /// Waits for a command, at most until the idle limit. It is in the inbox then.
    fn wait_for_command(&mut self) -> Result<CommandId, End> {
        let deadline = Instant::now().checked_add(self.server.idle_limit);
        loop {
            if self.answer_robo_pro(deadline)? {
                continue;
            }
            if let Some(command) = self.inbox.command()? {
                return Ok(command_id(command)?);
            }
            if self.inbox.has_piece() {
                self.server.shared().with_machine(Machine::piece_came)?;
            }
            if let Some(end) = self.end.take() {
                return Err(end);
            }
            if self.link.may_have_bytes() {
                self.read_arrived();
                continue;
            }
            if has_passed(deadline) {
                return Err(End::Idle);
            }
            self.link.wait(&mut self.server.port, deadline)?;
        }
    }

    /// Answers a command of ROBO Pro, if there is one.
    fn answer_robo_pro(&mut self, deadline: Option<Instant>) -> Result<bool, End> {
        let Some(reply) = robo_pro::reply(self.inbox.bytes()) else { return Ok(false) };
        self.inbox.remove(ID_LEN);
        let port = &mut self.server.port;
        match reply {
            Reply::Answer(bytes) => {
                self.link.write_all(port, &bytes, Some(WRITE_LIMIT), |_| Ok(()))?;
                Ok(true)
            }
            Reply::Wait => {
                self.link.read_all(port, &mut [0; BLOCK], deadline, |_| Ok(()))?;
                Err(End::Closed("files are not transferred here"))
            }
        }
    }

    /// Puts what has arrived into the inbox, as far as there is room.
    fn read_arrived(&mut self) {
        let room = self.inbox.room();
        if room.is_empty() || self.end.is_some() {
            return;
        }
        match self.link.try_read(room) {
            Ok(None) => {}
            Ok(Some(0)) => self.end = Some(End::Left),
            Ok(Some(count)) => self.inbox.add(count),
            Err(error) => self.end = Some(error.into()),
        }
    }

    /// How long it is until the next exchange response may be sent. If that is past, the client is late, and
    /// no response is due any more.
    fn time_to_response(&mut self) -> Duration {
        let now = Instant::now();
        self.due = self.due.filter(|due| *due > now);
        self.due.map_or(Duration::ZERO, |due| due - now)
    }

    /// Delays a response by this time.
    fn delay(&self, time: Duration) -> Result<(), Stopped> {
        if self.server.lock_step && !time.is_zero() {
            self.server.shared().with_machine(|machine| machine.step(time));
            return Ok(());
        }
        self.server.shared().sleep(time)
    }

    /// Carries out the command in the inbox and removes it. Returns how its response is sent.
    fn carry_out(&mut self, is_exchange: bool) -> Result<Outgoing, End> {
        let rest = if is_exchange { self.time_to_response() } else { Duration::ZERO };
        let mut response = std::mem::take(&mut self.response);
        let disturbances = self.answer(rest, &mut response)?;
        let size = self.inbox.command()?.map_or(0, <[u8]>::len);
        self.inbox.remove(size);
        let Self { responses, exchanges, .. } = *self;
        let at = Position { responses, exchanges, is_exchange };
        let (outgoing, disturbed) = self.server.faults.disturb(response, at, disturbances);
        self.responses += 1;
        self.exchanges += u64::from(is_exchange);
        if disturbed && is_exchange {
            self.server.shared().with_machine(Machine::doubt_offer);
        }
        Ok(outgoing)
    }

    /// Carries out the command in the inbox. The outputs of an exchange count from now on, and after this rest
    /// its response has the inputs of that time. Returns what happens to the response.
    fn answer(&mut self, rest: Duration, response: &mut Vec<u8>) -> Result<Vec<FaultKind>, End> {
        let Self { server, protocol, inbox, .. } = self;
        let Server { port, script, .. } = &mut **server;
        let command = inbox.command()?.unwrap_or_default();
        if rest.is_zero() {
            return Ok(port.shared().with_machine(|machine| {
                machine.command_came();
                protocol.answer(command, machine, script, response)?;
                Ok::<_, Misbehaviour>(machine.take_disturbances())
            })?);
        }
        let exchange = port.shared().with_machine(|machine| {
            machine.command_came();
            protocol.begin(command, machine, response)
        })?;
        port.shared().sleep(rest)?;
        Ok(port.shared().with_machine(|machine| {
            if let Some(exchange) = exchange {
                protocol.finish(exchange, machine, script, response);
            }
            machine.take_disturbances()
        }))
    }

    /// Notices a command that has arrived before the response is sent.
    fn look_ahead(&mut self, is_exchange: bool) {
        self.read_arrived();
        match ahead(self.inbox.bytes()) {
            Ahead::Command(command) => {
                let oddity = Oddity::SentAhead(command);
                self.server.shared().with_machine(|machine| machine.note_oddity(&oddity));
            }
            // It was made before the client had this response.
            Ahead::Farewell if is_exchange => {
                self.server.shared().with_machine(Machine::doubt_offer);
            }
            Ahead::Farewell | Ahead::Nothing => {}
        }
    }

    fn send(&mut self, mut outgoing: Outgoing) -> Result<(), End> {
        let port = &mut self.server.port;
        for piece in outgoing.pieces() {
            self.link.write_all(port, piece, Some(WRITE_LIMIT), |_| Ok(()))?;
        }
        if outgoing.close {
            return Err(End::Closed("a fault was injected"));
        }
        outgoing.bytes.clear();
        self.response = outgoing.bytes;
        Ok(())
    }
}

/// When the exchange response is due that follows one sent now.
///
/// A response that a busy computer sends after it was `due` does not move those that follow, unless it is late by half
/// a pace: then the client would have too little time for the next request.
fn next_due(due: Option<Instant>, now: Instant, pace: Duration) -> Instant {
    due.filter(|due| now < *due + pace / 2).unwrap_or(now) + pace
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Duration = Duration::from_millis(10);

    #[test]
    fn a_response_that_is_a_little_late_does_not_move_the_next_one() {
        let due = Instant::now();
        let now = due + PACE / 2 - Duration::from_nanos(1);
        assert_eq!(next_due(Some(due), now, PACE), due + PACE);
    }

    #[test]
    fn a_response_that_is_late_by_half_a_pace_moves_the_next_one() {
        let due = Instant::now();
        let now = due + PACE / 2;
        assert_eq!(next_due(Some(due), now, PACE), now + PACE);
    }

    #[test]
    fn the_response_after_one_that_was_not_due_comes_a_pace_later() {
        let now = Instant::now();
        assert_eq!(next_due(None, now, PACE), now + PACE);
    }
}
