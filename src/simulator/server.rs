//! The thread of the main connection and its sockets.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::camera::Doorman;
use super::command::{ahead, command_id, command_size, Ahead, Misbehaviour};
use super::end::End;
use super::faults::{Faults, Position};
use super::machine::Machine;
use super::oddity::Oddity;
use super::outgoing::Outgoing;
use super::session::{Script, Session, Settings};
use super::shared::{is_due_to_waiting, try_accept, Shared, Stopped};
use crate::wire::{CmprHeader, CommandId, ID_LEN, MAX_EXTRA_SIZE};

/// How long a client may leave a response unread before it is cut off. The buffers of the
/// operating system hold hundreds of responses, so only a client that never reads is cut off.
const WRITE_LIMIT: Duration = Duration::from_secs(1);

/// How many bytes after a command are checked: the longest farewell.
const FAREWELL_LEN: usize = CmprHeader::LEN + MAX_EXTRA_SIZE + ID_LEN;

/// Serves one client after another.
pub(super) struct Server {
    pub(super) listener: TcpListener,
    pub(super) shared: Arc<Shared>,
    pub(super) settings: Settings,
    pub(super) pace: Duration,
    /// Whether time passes by exchanges only.
    pub(super) lock_step: bool,
    pub(super) idle_limit: Duration,
    pub(super) faults: Faults,
    pub(super) script: Script,
    /// Looks for a camera client when the camera is started, if the camera itself does not.
    pub(super) camera_doorman: Option<Doorman>,
    /// A client that came while another was online. Perhaps the other one has already left.
    pub(super) next: Option<(TcpStream, SocketAddr)>,
}

impl Server {
    /// Serves clients until the thread should end.
    pub(super) fn run(mut self) {
        while let Ok(stream) = self.next_client() {
            if self.shared.look(Machine::absent) {
                log::info!("the client is not served: the controller is away");
                continue;
            }
            self.shared.with_machine(Machine::client_came);
            let end = self.serve(stream);
            self.shared.with_machine(Machine::client_left);
            if let Err(end) = end {
                end.tell("the client");
            }
        }
    }

    fn next_client(&mut self) -> Result<TcpStream, Stopped> {
        match self.next.take() {
            Some((stream, client)) => {
                log::info!("{client} connects to the main port");
                Ok(stream)
            }
            None => self.shared.accept(&self.listener, "main"),
        }
    }

    fn serve(&mut self, stream: TcpStream) -> Result<(), End> {
        stream.set_write_timeout(Some(WRITE_LIMIT))?;
        let session = Session::new(self.settings.clone());
        let mut connection = Connection {
            server: self,
            stream,
            session,
            responses: 0,
            exchanges: 0,
            last_exchange: None,
        };
        loop {
            connection.serve_command()?;
        }
    }
}

impl Drop for Server {
    /// If a script panics, the camera ends too.
    fn drop(&mut self) {
        self.shared.stop();
    }
}

impl From<Misbehaviour> for End {
    fn from(what: Misbehaviour) -> Self {
        Self::Misbehaved(what.to_string())
    }
}

struct Connection<'a> {
    server: &'a mut Server,
    stream: TcpStream,
    session: Session,
    /// The number of responses, sent or not.
    responses: u64,
    /// The number of responses to exchanges.
    exchanges: u64,
    /// When the last exchange response was sent.
    last_exchange: Option<Instant>,
}

impl Connection<'_> {
    /// Reads a command, carries it out and sends the response.
    fn serve_command(&mut self) -> Result<(), End> {
        let command = self.read_command()?;
        let id = command_id(&command)?;
        let is_exchange = matches!(id, CommandId::ExchangeData | CommandId::ExchangeDataCmpr);
        if is_exchange {
            // Before the machine's step, so that the response is new when it is sent.
            self.keep_pace()?;
        }
        let outgoing = self.carry_out(&command, is_exchange)?;
        if let (CommandId::StartCameraOnline, Some(doorman)) = (id, &self.server.camera_doorman) {
            doorman.look();
        }
        self.delay(outgoing.delay)?;
        self.look_ahead(is_exchange)?;
        if is_exchange {
            self.last_exchange = Some(Instant::now());
        }
        self.send(&outgoing)?;
        Ok(self.refuse_others()?)
    }

    /// Refuses clients that come while this client is online. While it is not, others wait.
    ///
    /// The new client may be the one that has just closed this connection, and the end of this
    /// connection may come after commands that are not read yet. So no client is refused before all
    /// is read.
    fn refuse_others(&mut self) -> io::Result<()> {
        if !self.server.shared.look(Machine::online) {
            return Ok(());
        }
        loop {
            if self.server.next.is_none() {
                self.server.next = try_accept(&self.server.listener);
            }
            if self.server.next.is_none() || !self.is_silent()? {
                return Ok(());
            }
            if let Some((_, client)) = self.server.next.take() {
                self.server.shared.with_machine(Machine::note_refused);
                log::warn!("{client} is refused: another client is online");
            }
        }
    }

    /// Whether the client is connected and everything that it has sent is read.
    fn is_silent(&self) -> io::Result<bool> {
        self.stream.set_nonblocking(true)?;
        let peeked = self.stream.peek(&mut [0]);
        self.stream.set_nonblocking(false)?;
        Ok(peeked.is_err_and(|error| error.kind() == io::ErrorKind::WouldBlock))
    }

    fn read_command(&mut self) -> Result<Vec<u8>, End> {
        let begin = Instant::now();
        let mut command = Vec::new();
        loop {
            let read = command.len();
            let size = command_size(&command)?;
            if read == size {
                return Ok(command);
            }
            command.resize(size, 0);
            self.read(&mut command[read..], begin)?;
        }
    }

    /// Fills the buffer, at most until the idle limit.
    fn read(&mut self, mut buffer: &mut [u8], begin: Instant) -> Result<(), End> {
        while !buffer.is_empty() {
            match self.stream.read(buffer) {
                Ok(0) => return Err(End::Left),
                Ok(count) => buffer = &mut buffer[count..],
                Err(error) if is_due_to_waiting(&error) => self.refuse_others()?,
                Err(error) => return Err(error.into()),
            }
            self.server.shared.rest(Duration::ZERO)?;
            if !buffer.is_empty() && begin.elapsed() >= self.server.idle_limit {
                return Err(End::Idle);
            }
        }
        Ok(())
    }

    /// Waits until the next exchange response may be sent.
    fn keep_pace(&self) -> Result<(), End> {
        let passed = self.last_exchange.map_or(Duration::MAX, |last| last.elapsed());
        Ok(self.server.shared.rest(self.server.pace.saturating_sub(passed))?)
    }

    /// Delays a response by this time.
    fn delay(&self, time: Duration) -> Result<(), Stopped> {
        if self.server.lock_step && !time.is_zero() {
            self.server.shared.with_machine(|machine| machine.step(time));
            return Ok(());
        }
        self.server.shared.rest(time)
    }

    /// Carries out a command. Returns how its response is sent.
    fn carry_out(&mut self, command: &[u8], is_exchange: bool) -> Result<Outgoing, End> {
        let Server { shared, script, .. } = &mut *self.server;
        let mut response = Vec::new();
        let disturbances = shared.with_machine(|machine| {
            self.session.answer(command, machine, script, &mut response)?;
            Ok::<_, Misbehaviour>(machine.take_disturbances())
        })?;
        let Self { responses, exchanges, .. } = *self;
        let at = Position { responses, exchanges, is_exchange };
        let (outgoing, disturbed) = self.server.faults.disturb(response, at, disturbances);
        self.responses += 1;
        self.exchanges += u64::from(is_exchange);
        if disturbed && is_exchange {
            self.server.shared.with_machine(Machine::doubt_offer);
        }
        Ok(outgoing)
    }

    /// Notices a command that has arrived before the response is sent.
    fn look_ahead(&mut self, is_exchange: bool) -> Result<(), End> {
        let mut bytes = [0; FAREWELL_LEN];
        self.stream.set_nonblocking(true)?;
        // On an error there is nothing to read; sending will report it.
        let count = self.stream.peek(&mut bytes).unwrap_or(0);
        self.stream.set_nonblocking(false)?;
        match ahead(&bytes[..count]) {
            Ahead::Command(command) => {
                let oddity = Oddity::SentAhead(command);
                self.server.shared.with_machine(|machine| machine.note_oddity(&oddity));
            }
            // It was made before the client had this response.
            Ahead::Farewell if is_exchange => {
                self.server.shared.with_machine(Machine::doubt_offer);
            }
            Ahead::Farewell | Ahead::Nothing => {}
        }
        Ok(())
    }

    fn send(&mut self, outgoing: &Outgoing) -> Result<(), End> {
        for piece in outgoing.pieces() {
            self.stream.write_all(piece)?;
            self.stream.flush()?;
        }
        if outgoing.close {
            return Err(End::Closed("as ordered"));
        }
        Ok(())
    }
}
