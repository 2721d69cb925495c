//! Bytes to the controller and back: a command and its response, and the last words.

use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::time::{Duration, Instant};

use super::connect::{io_error, SHORTEST_LIMIT};
use super::TxtClient;
use crate::error::Error;
use crate::wire::{
    CmprHeader, CommandId, ExchangeDataResponse, QueryStatusResponse, ResponseId, ID_LEN,
};

/// How long a failing connection may take to say its last words.
const FAREWELL_LIMIT: Duration = Duration::from_millis(500);

impl TxtClient {
    /// Notes the error after which the connection is of no further use.
    pub(super) fn broken(&mut self, error: Error) -> Error {
        self.broken = Some(error.clone());
        error
    }

    /// Sends one command and reads its response.
    pub(super) fn command<T>(
        &mut self,
        command: CommandId,
        emit: impl FnOnce(&mut Vec<u8>),
        parse: impl FnOnce(&[u8]) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.usable()?;
        self.request.clear();
        emit(&mut self.request);
        let size = self.transact(command)?;
        parse(&self.response[..size]).map_err(|error| self.broken(error))
    }

    /// Sends what is in `request` and reads the response; returns its size.
    pub(super) fn transact(&mut self, command: CommandId) -> Result<usize, Error> {
        let result = self
            .stream
            .write_all(&self.request)
            .map_err(|error| io_error(command.name(), &error, 0))
            .and_then(|()| self.read_response(command));
        result.map_err(|error| self.broken(error))
    }

    /// Reads one whole response into `response` and returns its size.
    fn read_response(&mut self, command: CommandId) -> Result<usize, Error> {
        let deadline = Instant::now().checked_add(self.limits.read);
        let mut received = 0;
        let mut shortened = false;
        let size = loop {
            if let Some(size) = response_size(command, &self.response[..received])? {
                if received >= size {
                    break size;
                }
            }
            if received > 0 {
                // The limit is for the whole response, not for each piece of it.
                let rest =
                    deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
                if rest == Some(Duration::ZERO) {
                    return Err(self.no_answer(command, received));
                }
                self.set_read_limit(command, rest.unwrap_or(self.limits.read))?;
                shortened = true;
            }
            received += match self.stream.read(&mut self.response[received..]) {
                Ok(0) => return Err(Error::ConnectionClosed { command: command.name(), received }),
                Ok(count) => count,
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => 0,
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                        return Err(self.no_answer(command, received));
                    }
                    _ => return Err(io_error(command.name(), &error, received)),
                },
            };
        };
        if shortened {
            self.set_read_limit(command, self.limits.read)?;
        }
        if received > size {
            let packet = command.response().name();
            return Err(Error::WrongSize { packet, expected: size, found: received });
        }
        Ok(size)
    }

    fn set_read_limit(&self, command: CommandId, limit: Duration) -> Result<(), Error> {
        self.stream
            .set_read_timeout(Some(limit.max(SHORTEST_LIMIT)))
            .map_err(|error| io_error(command.name(), &error, 0))
    }

    fn no_answer(&self, command: CommandId, received: usize) -> Error {
        Error::NoAnswer { command: command.name(), limit: self.limits.read, received }
    }

    /// Leaves a connection on which something went wrong: sends this request and StopOnline
    /// whatever came before, so that the controller hears it if it can hear anything. Errors are
    /// of no interest any more. Blocks for half a second at most for each direction.
    pub(crate) fn abandon(&mut self, last_request: &[u8]) {
        let deadline = Instant::now() + FAREWELL_LIMIT;
        let mut farewell = last_request.to_vec();
        CommandId::StopOnline.emit(&mut farewell);
        let _ = self.stream.set_write_timeout(Some(FAREWELL_LIMIT));
        if self.stream.write_all(&farewell).is_err() {
            return;
        }
        let _ = self.stream.shutdown(Shutdown::Write);
        // Closing with unread bytes would reset the connection, and the controller might never
        // read what was just sent. So read until it has closed its side.
        while let Some(rest) = deadline.checked_duration_since(Instant::now()) {
            let _ = self.stream.set_read_timeout(Some(rest.max(SHORTEST_LIMIT)));
            if !matches!(self.stream.read(&mut self.response[..]), Ok(1..)) {
                return;
            }
        }
    }
}

/// The size of a response of which the first bytes have come in, once they tell it.
fn response_size(command: CommandId, start: &[u8]) -> Result<Option<usize>, Error> {
    let response = command.response();
    if start.len() < ID_LEN {
        return Ok(None);
    }
    response.check(start)?;
    Ok(match response {
        ResponseId::QueryStatus => Some(QueryStatusResponse::LEN),
        ResponseId::ExchangeData => Some(ExchangeDataResponse::LEN),
        ResponseId::ExchangeDataCmpr => match start.get(..CmprHeader::LEN) {
            Some(header) => {
                let header = CmprHeader::parse_response(header)?;
                Some(CmprHeader::LEN + header.extra_size as usize)
            }
            None => None,
        },
        ResponseId::StartOnline
        | ResponseId::UpdateConfig
        | ResponseId::StopOnline
        | ResponseId::StartCameraOnline
        | ResponseId::StopCameraOnline => Some(ID_LEN),
    })
}
