//! Bytes to the controller and back: a command and its response, and the last bytes.

use std::time::Duration;

use super::connection::PacketNames;
use super::response::response_size;
use super::TxtClient;
use crate::error::Error;
use crate::wire::CommandId;

/// How long the last bytes on a failing connection may take.
const ABANDON_LIMIT: Duration = Duration::from_millis(500);

/// How often it is checked whether something holds the I2C connection open. A fraction of the time that it needs.
const I2C_LOOK: Duration = Duration::from_millis(500);

impl TxtClient {
    /// Stores the error after which the connection can't be used any more.
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
        let names = PacketNames { request: command.name(), response: command.response().name() };
        let Some(connection) = &mut self.connection else {
            return Err(Error::ConnectionClosed { command: names.request, received: 0 });
        };
        let result = connection.send(names.request, &self.request).and_then(|now| {
            // While the controller makes its response. In nearly all cycles nothing is due.
            if now >= self.i2c_look {
                self.i2c_look = now + I2C_LOOK;
                self.i2c.line.keep_open();
            }
            let size = |start: &[u8]| response_size(command, start);
            connection.read_response(names, &mut self.response[..], size)
        });
        result.map_err(|error| self.broken(error))
    }

    /// Leaves a connection on which something went wrong: sends this request and StopOnline, without
    /// waiting for a response in between, so that the controller gets them if it gets anything. Ignores
    /// errors, and closes the connection. Blocks for half a second at most.
    pub(crate) fn abandon(&mut self, last_request: &[u8]) {
        let mut last_words = last_request.to_vec();
        CommandId::StopOnline.emit(&mut last_words);
        let session = self.online.take();
        if let Some(mut connection) = self.connection.take() {
            let end_i2c = || drop(session);
            connection.abandon(&last_words, ABANDON_LIMIT, &mut self.response[..], end_i2c);
        }
    }
}
