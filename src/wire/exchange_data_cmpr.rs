//! ExchangeDataCmpr: the fixed part in front of the compressed words.

use byteorder::{ByteOrder, LittleEndian};

use super::{check, push_words, CommandId, ResponseId};
use crate::error::Error;

/// The most compressed bytes that a packet may announce, as in the kit.
///
/// Nine areas of 52 words need at most 1053.
pub const MAX_EXTRA_SIZE: usize = 4096;

mod field {
    use std::ops::Range;

    pub(super) const EXTRA_SIZE: Range<usize> = 4..8;
    pub(super) const CRC: Range<usize> = 8..12;
    pub(super) const ACTIVE_EXTENSIONS: Range<usize> = 12..14;
}

/// The fixed part of an ExchangeDataCmpr command or response; the compressed data follows.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Command_ExchangeDataCmpr")]
#[doc(alias = "ftIF2013Response_ExchangeDataCmpr")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CmprHeader {
    /// How many bytes of compressed data follow, at most [`MAX_EXTRA_SIZE`].
    #[doc(alias = "m_extrasize")]
    pub extra_size: u32,
    /// Checksum of the words before compression, see [`crc_of_words`](super::crc_of_words).
    #[doc(alias = "m_crc")]
    pub crc: u32,
    /// Which extensions' words follow the master's: bit 0 the first, bit 7 the eighth.
    #[doc(alias = "m_active_extensions")]
    pub active_extensions: u16,
}

impl CmprHeader {
    /// Size of the fixed part in bytes.
    pub const LEN: usize = 16;

    /// Reads the fixed part of a command. Fails when id or size are wrong, or when the
    /// packet announces too much data.
    pub fn parse_command(bytes: &[u8]) -> Result<Self, Error> {
        let kind = CommandId::ExchangeDataCmpr;
        Self::parse(bytes, kind.name(), kind.id())
    }

    /// Reads the fixed part of a response. Fails when id or size are wrong, or when the
    /// packet announces too much data.
    pub fn parse_response(bytes: &[u8]) -> Result<Self, Error> {
        let kind = ResponseId::ExchangeDataCmpr;
        Self::parse(bytes, kind.name(), kind.id())
    }

    fn parse(bytes: &[u8], packet: &'static str, id: u32) -> Result<Self, Error> {
        check(bytes, packet, id, Self::LEN)?;
        let header = Self {
            extra_size: LittleEndian::read_u32(&bytes[field::EXTRA_SIZE]),
            crc: LittleEndian::read_u32(&bytes[field::CRC]),
            active_extensions: LittleEndian::read_u16(&bytes[field::ACTIVE_EXTENSIONS]),
        };
        if header.extra_size > MAX_EXTRA_SIZE as u32 {
            let announced = header.extra_size;
            return Err(Error::TooLarge { packet, announced, limit: MAX_EXTRA_SIZE });
        }
        Ok(header)
    }

    /// Appends the fixed part of a command to `out`.
    pub fn emit_command(&self, out: &mut Vec<u8>) {
        CommandId::ExchangeDataCmpr.emit(out);
        self.emit(out);
    }

    /// Appends the fixed part of a response to `out`.
    pub fn emit_response(&self, out: &mut Vec<u8>) {
        ResponseId::ExchangeDataCmpr.emit(out);
        self.emit(out);
    }

    fn emit(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.extra_size.to_le_bytes());
        out.extend_from_slice(&self.crc.to_le_bytes());
        push_words(out, [self.active_extensions, 0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: CmprHeader =
        CmprHeader { extra_size: 5, crc: 0x36B7_4B4C, active_extensions: 0x81 };

    #[test]
    fn every_field_has_its_place() {
        let mut out = Vec::new();
        HEADER.emit_command(&mut out);
        assert_eq!(
            out,
            [0x98, 0x6F, 0xC5, 0xFB, 5, 0, 0, 0, 0x4C, 0x4B, 0xB7, 0x36, 0x81, 0, 0, 0]
        );
        assert_eq!(CmprHeader::parse_command(&out), Ok(HEADER));
        assert!(matches!(CmprHeader::parse_response(&out), Err(Error::WrongId { .. })));
    }

    #[test]
    fn more_data_than_the_limit_is_an_error() {
        let mut out = Vec::new();
        CmprHeader { extra_size: 4096, ..HEADER }.emit_response(&mut out);
        assert!(CmprHeader::parse_response(&out).is_ok());
        out.clear();
        CmprHeader { extra_size: 4097, ..HEADER }.emit_response(&mut out);
        assert_eq!(
            CmprHeader::parse_response(&out),
            Err(Error::TooLarge {
                packet: "ExchangeDataCmpr response",
                announced: 4097,
                limit: 4096
            })
        );
    }
}
