//! The I2C connection of a session.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader};

use super::line::{Heard, Line};
use super::outcome::Trouble;

/// After this silence a request for nothing keeps the connection. The firmware closes it after 5 s.
const KEEP: Duration = Duration::from_secs(2);

/// What a device has answered.
pub(super) enum I2cAnswer {
    Read(Vec<u8>),
    /// These bytes: a failure, or something else.
    Failed(Vec<u8>),
}

pub(super) struct I2c {
    pub(super) line: Line,
    last_use: Instant,
    /// How long it has been kept by requests for nothing alone.
    pub(super) kept: Duration,
    /// Whether it is kept open.
    pub(super) is_kept: bool,
}

impl I2c {
    pub(super) fn new(line: Line) -> Self {
        Self { line, last_use: Instant::now(), kept: Duration::ZERO, is_kept: true }
    }

    /// Sends a request for nothing when it is time.
    pub(super) fn keep(&mut self) -> Result<(), Trouble> {
        let silent = self.last_use.elapsed();
        if !self.is_kept || silent < KEEP {
            return Ok(());
        }
        let kept = self.kept + silent;
        let answer = self.transact(0, &[], 0);
        answer.map_err(|trouble| trouble.during("an I2C request for nothing"))?;
        self.kept = kept;
        Ok(())
    }

    /// One request and its answer.
    pub(super) fn transact(
        &mut self,
        device: u8,
        write: &[u8],
        read: u16,
    ) -> Result<I2cAnswer, Trouble> {
        let header = self.line.ask(&request(device, write, read), I2cResponseHeader::LEN)?;
        self.last_use = Instant::now();
        self.kept = Duration::ZERO;
        match I2cResponseHeader::parse(&header) {
            Ok(parsed) if parsed.is_ok => {
                Ok(I2cAnswer::Read(self.line.receive(parsed.read_len.into())?))
            }
            Ok(_) => Ok(I2cAnswer::Failed(header)),
            Err(error) => Err(Trouble::Lost(format!("{error:#}"))),
        }
    }

    /// Whether the controller closes it within this time.
    pub(super) fn is_closed_within(&mut self, limit: Duration) -> Result<bool, Trouble> {
        Ok(matches!(self.line.hear(1, limit)?, Heard::Closed))
    }
}

/// The packet that writes these bytes, then reads that many.
pub(super) fn request(device: u8, write: &[u8], read_len: u16) -> Vec<u8> {
    let write_len = write.len() as u16;
    let mut packet = Vec::new();
    I2cRequestHeader { data_len: write_len.into(), device, write_len, read_len }.emit(&mut packet);
    packet.extend(write);
    packet
}
