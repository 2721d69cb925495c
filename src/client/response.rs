//! The size of the responses.

use crate::error::Error;
use crate::wire::{
    CmprHeader, CommandId, ExchangeDataResponse, QueryStatusResponse, ResponseId, ID_LEN,
};

/// The size of a response, if the bytes that have come in are enough to know it.
pub(super) fn response_size(command: CommandId, start: &[u8]) -> Result<Option<usize>, Error> {
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
