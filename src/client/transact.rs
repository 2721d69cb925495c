//! Bytes to the controller and back: a command and its response, and the last words.

use std::time::Duration;

use super::connection::PacketNames;
use super::TxtClient;
use crate::error::Error;
use crate::wire::{
    CmprHeader, CommandId, ExchangeDataResponse, QueryStatusResponse, ResponseId, ID_LEN,
};

/// How long the last words on a failing connection may take.
const ABANDON_LIMIT: Duration = Duration::from_millis(500);

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
        let names = PacketNames { request: command.name(), response: command.response().name() };
        let Some(connection) = &mut self.connection else {
            return Err(Error::ConnectionClosed { command: names.request, received: 0 });
        };
        connection
            .transact(names, &self.request, &mut self.response[..], |start| {
                response_size(command, start)
            })
            .map_err(|error| self.broken(error))
    }

    /// Leaves a connection on which something went wrong: sends this request and StopOnline
    /// whatever came before, so that the controller hears it if it can hear anything. Errors are
    /// of no interest any more, and the connection is closed. Blocks for half a second at most.
    pub(crate) fn abandon(&mut self, last_request: &[u8]) {
        let mut last_words = last_request.to_vec();
        CommandId::StopOnline.emit(&mut last_words);
        if let Some(mut connection) = self.connection.take() {
            connection.abandon(&last_words, ABANDON_LIMIT, &mut self.response[..]);
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
