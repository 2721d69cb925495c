//! I2C: requests and responses on a connection of their own, **big-endian** unlike all other packets.
//!
//! The kit does not describe them; this is what ftrobopy sends and expects.

use byteorder::{BigEndian, ByteOrder};

use super::{check_in, ID_LEN};
use crate::error::Error;

mod field {
    use std::ops::Range;

    pub(super) const COMMAND: usize = 4;
    pub(super) const DEVICE: Range<usize> = 5..9;
    pub(super) const WRITE_LEN: Range<usize> = 9..13;
    pub(super) const READ_LEN: Range<usize> = 13..15;
}

/// The header of each request to an I2C device; the bytes to write follow.
///
/// The controller writes them to the device, then reads.
///
/// Closed on purpose: the fields are those of the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct I2cRequestHeader {
    /// Each of ftrobopy's functions puts the number of bytes to write here: 1 to read a register,
    /// 2 to write one.
    pub command: u8,
    /// The device's address, which has 7 bits.
    pub device: u32,
    /// How many bytes to write.
    pub write_len: u32,
    /// How many bytes to read.
    pub read_len: u16,
}

impl I2cRequestHeader {
    /// Size of the header in bytes. The last one is 0.
    pub const LEN: usize = 16;

    /// The id it starts with.
    pub const ID: u32 = 0xB9DB_3B39;

    /// Reads the header. Fails when id or size are wrong; the values are not checked.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        check_in::<BigEndian>(bytes, "request to an I2C device", Self::ID, Self::LEN)?;
        Ok(Self {
            command: bytes[field::COMMAND],
            device: BigEndian::read_u32(&bytes[field::DEVICE]),
            write_len: BigEndian::read_u32(&bytes[field::WRITE_LEN]),
            read_len: BigEndian::read_u16(&bytes[field::READ_LEN]),
        })
    }

    /// Appends the header to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&Self::ID.to_be_bytes());
        out.push(self.command);
        out.extend_from_slice(&self.device.to_be_bytes());
        out.extend_from_slice(&self.write_len.to_be_bytes());
        out.extend_from_slice(&self.read_len.to_be_bytes());
        out.push(0);
    }
}

/// The header of each response of an I2C device; the bytes that were read follow.
///
/// Closed on purpose: the fields are those of the packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct I2cResponseHeader {
    /// 8 bytes with unknown meaning. ftrobopy reads them as a u8, a u32, a u16 and a u8.
    pub unknown: [u8; 8],
}

impl I2cResponseHeader {
    /// Size of the header in bytes.
    pub const LEN: usize = 12;

    /// The id it starts with.
    pub const ID: u32 = 0x87FD_0D90;

    /// The packet's name in messages.
    pub(crate) const NAME: &'static str = "response to an I2C request";

    /// Reads the header. Fails when id or size are wrong; the values are not checked.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        check_in::<BigEndian>(bytes, Self::NAME, Self::ID, Self::LEN)?;
        let mut unknown = [0; 8];
        unknown.copy_from_slice(&bytes[ID_LEN..]);
        Ok(Self { unknown })
    }

    /// Appends the header to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&Self::ID.to_be_bytes());
        out.extend_from_slice(&self.unknown);
    }
}

/// What comes instead of a response when no device has the address.
///
/// This is how the simulated TXT answers. What a real controller does is not known.
pub const I2C_NO_DEVICE: [u8; I2cResponseHeader::LEN] = [0; I2cResponseHeader::LEN];

#[cfg(test)]
mod tests {
    use super::*;

    /// Requests that ftrobopy 2.0.0 sent to a socket: `i2c_read(0x18, 0x3f, data_len=6)`,
    /// `i2c_write(0x18, 0x3e, 0x80)` and `i2c_write_buffer(0x18, b"\x40\x01\x02\x03", 4)`.
    const FTROBOPY: [(&[u8], I2cRequestHeader, &[u8]); 3] = [
        (
            &[0xB9, 0xDB, 0x3B, 0x39, 1, 0, 0, 0, 0x18, 0, 0, 0, 1, 0, 6, 0, 0x3F],
            I2cRequestHeader { command: 1, device: 0x18, write_len: 1, read_len: 6 },
            &[0x3F],
        ),
        (
            &[0xB9, 0xDB, 0x3B, 0x39, 2, 0, 0, 0, 0x18, 0, 0, 0, 2, 0, 0, 0, 0x3E, 0x80],
            I2cRequestHeader { command: 2, device: 0x18, write_len: 2, read_len: 0 },
            &[0x3E, 0x80],
        ),
        (
            &[0xB9, 0xDB, 0x3B, 0x39, 4, 0, 0, 0, 0x18, 0, 0, 0, 4, 0, 0, 0, 0x40, 1, 2, 3],
            I2cRequestHeader { command: 4, device: 0x18, write_len: 4, read_len: 0 },
            &[0x40, 1, 2, 3],
        ),
    ];

    #[test]
    fn requests_are_ftrobopys() {
        for (bytes, header, write) in FTROBOPY {
            let mut out = Vec::new();
            header.emit(&mut out);
            assert_eq!(out.len(), I2cRequestHeader::LEN);
            out.extend_from_slice(write);
            assert_eq!(out, bytes);
            assert_eq!(I2cRequestHeader::parse(&bytes[..I2cRequestHeader::LEN]), Ok(header));
        }
    }

    #[test]
    fn every_byte_of_a_request_has_its_place() {
        let header = I2cRequestHeader {
            command: 0x11,
            device: 0x2233_4455,
            write_len: 0x6677_8899,
            read_len: 0xAABB,
        };
        let mut out = vec![7];
        header.emit(&mut out);
        let values = [0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0x99, 0xAA, 0xBB, 0];
        assert_eq!(out[..5], [7, 0xB9, 0xDB, 0x3B, 0x39]);
        assert_eq!(out[5..], values);
        assert_eq!(I2cRequestHeader::parse(&out[1..]), Ok(header));
    }

    #[test]
    fn the_unknown_bytes_of_a_response_are_as_they_came() {
        let bytes = [0x87, 0xFD, 0x0D, 0x90, 1, 2, 3, 4, 5, 6, 7, 8];
        let header = I2cResponseHeader { unknown: [1, 2, 3, 4, 5, 6, 7, 8] };
        assert_eq!(I2cResponseHeader::parse(&bytes), Ok(header));
        let mut out = vec![7];
        header.emit(&mut out);
        assert_eq!(out[1..], bytes);
    }

    #[test]
    fn another_id_or_size_is_an_error() {
        let wrong_id = Error::WrongId {
            packet: "response to an I2C request",
            expected: 0x87FD_0D90,
            found: 0x900D_FD87,
        };
        let mut bytes = [0x90, 0x0D, 0xFD, 0x87, 1, 2, 3, 4, 5, 6, 7, 8];
        assert_eq!(I2cResponseHeader::parse(&bytes), Err(wrong_id));
        bytes[..4].copy_from_slice(&I2cRequestHeader::ID.to_be_bytes());
        assert!(matches!(I2cRequestHeader::parse(&bytes), Err(Error::WrongSize { found: 12, .. })));
        assert!(matches!(I2cResponseHeader::parse(&[0x87]), Err(Error::WrongSize { .. })));
        assert!(matches!(I2cResponseHeader::parse(&I2C_NO_DEVICE), Err(Error::WrongId { .. })));
    }
}
