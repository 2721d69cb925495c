//! The I2C connection: requests and responses in turn.

use std::collections::VecDeque;
use std::time::Instant;

use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader};

use super::Reader;
use crate::seen::{Happened, I2cExchange, Side};
use crate::watch::packet::Inbox;

/// No request writes more.
const WRITE_MAX: u32 = 64 * 1024;
/// How many requests may wait for their responses.
const WAITING_MAX: usize = 64;

#[derive(Default)]
pub(super) struct I2cReader {
    requests: Inbox,
    responses: Inbox,
    waiting: VecDeque<Request>,
}

struct Request {
    device: u32,
    written: Vec<u8>,
    read: usize,
}

impl Reader for I2cReader {
    fn read(
        &mut self,
        side: Side,
        _: Instant,
        bytes: &[u8],
        report: &mut dyn FnMut(Happened),
    ) -> Result<(), String> {
        if side == Side::Program {
            self.requests.add(bytes);
            while let Some(packet) = self.requests.next(request_size)? {
                self.waiting.push_back(request(&packet)?);
                if self.waiting.len() > WAITING_MAX {
                    return Err(format!("{WAITING_MAX} requests were sent without a response"));
                }
            }
            return Ok(());
        }
        self.responses.add(bytes);
        while let Some(count) = self.waiting.front().map(|request| request.read) {
            let Some(packet) = self.responses.next(response_size)? else {
                return Ok(());
            };
            let Some(Request { device, written, .. }) = self.waiting.pop_front() else { break };
            let read = is_ok(&packet)?.then(|| packet[I2cResponseHeader::LEN..].to_vec());
            // Programs hold the connection open by requests for nothing.
            if !written.is_empty() || count > 0 {
                report(Happened::I2c(I2cExchange { device, written, read }));
            }
        }
        // What is left has no request.
        match self.responses.next(|start| Ok(start.len()))? {
            None => Ok(()),
            Some(_) => Err("a response came without a request".to_owned()),
        }
    }
}

fn request_size(start: &[u8]) -> Result<usize, String> {
    let Some(header) = start.get(..I2cRequestHeader::LEN) else {
        return Ok(I2cRequestHeader::LEN);
    };
    let header = I2cRequestHeader::parse(header).map_err(|error| error.to_string())?;
    if header.data_len > WRITE_MAX {
        return Err(format!("a request can't write {} bytes", header.data_len));
    }
    Ok(I2cRequestHeader::LEN + header.data_len as usize)
}

fn request(packet: &[u8]) -> Result<Request, String> {
    let (header, written) = packet.split_at(I2cRequestHeader::LEN);
    let header = I2cRequestHeader::parse(header).map_err(|error| error.to_string())?;
    Ok(Request {
        device: header.device.into(),
        written: written.to_vec(),
        read: usize::from(header.read_len),
    })
}

/// A controller sends fewer bytes than were asked for, if that is too many.
fn response_size(start: &[u8]) -> Result<usize, String> {
    let Some(header) = start.get(..I2cResponseHeader::LEN) else {
        return Ok(I2cResponseHeader::LEN);
    };
    let header = I2cResponseHeader::parse(header).map_err(|error| error.to_string())?;
    let follow = if header.is_ok { usize::from(header.read_len) } else { 0 };
    Ok(I2cResponseHeader::LEN + follow)
}

/// Whether the device has answered.
fn is_ok(response: &[u8]) -> Result<bool, String> {
    let header = I2cResponseHeader::parse(&response[..I2cResponseHeader::LEN]);
    Ok(header.map_err(|error| error.to_string())?.is_ok)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_has_as_many_bytes_as_it_says() {
        let mut reader = I2cReader::default();
        let mut seen = Vec::new();
        let mut read = |side, bytes: &[u8]| {
            reader.read(side, Instant::now(), bytes, &mut |happened| seen.push(happened)).unwrap();
        };
        for read_len in [2000, 1] {
            let mut request = Vec::new();
            I2cRequestHeader { data_len: 0, device: 0x18, write_len: 0, read_len }
                .emit(&mut request);
            read(Side::Program, &request);
        }
        // A controller sends no more than 1024.
        for read_len in [1024, 1] {
            let mut response = Vec::new();
            I2cResponseHeader { read_len, is_ok: true }.emit(&mut response);
            response.resize(response.len() + usize::from(read_len), 7);
            read(Side::Controller, &response);
        }
        let counts = seen.iter().map(|seen| match seen {
            Happened::I2c(exchange) => exchange.read.as_ref().map(Vec::len),
            other => panic!("{other:?}"),
        });
        assert_eq!(counts.collect::<Vec<_>>(), [Some(1024), Some(1)]);
    }
}
