//! I2C: requests and responses on a connection of their own.
//!
//! The kit does not describe them. Measured on the maker's firmware 4.7.0 under emulation; what ftrobopy sends and
//! expects agrees with it below 256 bytes.

use byteorder::{ByteOrder, LittleEndian};

use super::{check, ID_LEN};
use crate::error::Error;

mod field {
    use std::ops::Range;

    pub(super) const DATA_LEN: Range<usize> = 4..8;
    pub(super) const DEVICE: usize = 8;
    pub(super) const WRITE_LEN: Range<usize> = 12..14;
    pub(super) const READ_LEN: Range<usize> = 14..16;

    pub(super) const STATUS: Range<usize> = 8..10;
}

/// The header of each request to an I2C device; the bytes to write follow.
///
/// The controller writes them to the device, then reads.
///
/// Closed on purpose: the fields are those of the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct I2cRequestHeader {
    /// How many bytes follow. The firmware closes the connection when these are not the bytes to write.
    pub data_len: u32,
    /// The device's address, which has 7 bits.
    pub device: u8,
    /// How many bytes to write, up to 1024.
    pub write_len: u16,
    /// How many bytes to read, up to 1024.
    pub read_len: u16,
}

impl I2cRequestHeader {
    /// Size of the header in bytes. The three after the address are 0; the firmware ignores them.
    pub const LEN: usize = 16;

    /// The id it starts with.
    pub const ID: u32 = 0x393B_DBB9;

    /// Reads the header. Fails when id or size are wrong; the values are not checked.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        check(bytes, "request to an I2C device", Self::ID, Self::LEN)?;
        Ok(Self {
            data_len: LittleEndian::read_u32(&bytes[field::DATA_LEN]),
            device: bytes[field::DEVICE],
            write_len: LittleEndian::read_u16(&bytes[field::WRITE_LEN]),
            read_len: LittleEndian::read_u16(&bytes[field::READ_LEN]),
        })
    }

    /// Appends the header to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&Self::ID.to_le_bytes());
        out.extend_from_slice(&self.data_len.to_le_bytes());
        out.extend_from_slice(&[self.device, 0, 0, 0]);
        out.extend_from_slice(&self.write_len.to_le_bytes());
        out.extend_from_slice(&self.read_len.to_le_bytes());
    }
}

/// The header of each response of an I2C device; the bytes that were read follow, none if it has failed.
///
/// Closed on purpose: the fields are those of the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct I2cResponseHeader {
    /// How many bytes follow. The firmware repeats them in the last two bytes, which are not read.
    pub read_len: u16,
    /// Whether the device has answered. The firmware's failure for a missing device is all 0 after the id.
    pub is_ok: bool,
}

impl I2cResponseHeader {
    /// Size of the header in bytes.
    pub const LEN: usize = 12;

    /// The id it starts with.
    pub const ID: u32 = 0x900D_FD87;

    /// The packet's name in messages.
    pub(crate) const NAME: &'static str = "response to an I2C request";

    /// Reads the header. Fails when id or size are wrong; the values are not checked.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        check(bytes, Self::NAME, Self::ID, Self::LEN)?;
        Ok(Self {
            read_len: LittleEndian::read_u16(&bytes[ID_LEN..]),
            is_ok: LittleEndian::read_u16(&bytes[field::STATUS]) != 0,
        })
    }

    /// Appends the header to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&Self::ID.to_le_bytes());
        out.extend_from_slice(&u32::from(self.read_len).to_le_bytes());
        out.extend_from_slice(&u16::from(self.is_ok).to_le_bytes());
        out.extend_from_slice(&self.read_len.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Requests that ftrobopy 2.0.0 sent to a socket: `i2c_read(0x18, 0x3f, data_len=6)`,
    /// `i2c_write(0x18, 0x3e, 0x80)` and `i2c_write_buffer(0x18, b"\x40\x01\x02\x03", 4)`.
    const FTROBOPY: [(&[u8], I2cRequestHeader, &[u8]); 3] = [
        (
            &[0xB9, 0xDB, 0x3B, 0x39, 1, 0, 0, 0, 0x18, 0, 0, 0, 1, 0, 6, 0, 0x3F],
            I2cRequestHeader { data_len: 1, device: 0x18, write_len: 1, read_len: 6 },
            &[0x3F],
        ),
        (
            &[0xB9, 0xDB, 0x3B, 0x39, 2, 0, 0, 0, 0x18, 0, 0, 0, 2, 0, 0, 0, 0x3E, 0x80],
            I2cRequestHeader { data_len: 2, device: 0x18, write_len: 2, read_len: 0 },
            &[0x3E, 0x80],
        ),
        (
            &[0xB9, 0xDB, 0x3B, 0x39, 4, 0, 0, 0, 0x18, 0, 0, 0, 4, 0, 0, 0, 0x40, 1, 2, 3],
            I2cRequestHeader { data_len: 4, device: 0x18, write_len: 4, read_len: 0 },
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
            data_len: 0x4433_2211,
            device: 0x55,
            write_len: 0x7766,
            read_len: 0x9988,
        };
        let mut out = vec![7];
        header.emit(&mut out);
        let values = [0x11, 0x22, 0x33, 0x44, 0x55, 0, 0, 0, 0x66, 0x77, 0x88, 0x99];
        assert_eq!(out[..5], [7, 0xB9, 0xDB, 0x3B, 0x39]);
        assert_eq!(out[5..], values);
        assert_eq!(I2cRequestHeader::parse(&out[1..]), Ok(header));
    }

    /// Responses of the firmware 4.7.0: to a write, to a read of 1 and of 300 bytes, and of a missing device.
    #[test]
    fn responses_are_the_firmwares() {
        let id = [0x87, 0xFD, 0x0D, 0x90];
        let cases = [
            ([0, 0, 0, 0, 1, 0, 0, 0], I2cResponseHeader { read_len: 0, is_ok: true }),
            ([1, 0, 0, 0, 1, 0, 1, 0], I2cResponseHeader { read_len: 1, is_ok: true }),
            ([0x2C, 1, 0, 0, 1, 0, 0x2C, 1], I2cResponseHeader { read_len: 300, is_ok: true }),
            ([0; 8], I2cResponseHeader { read_len: 0, is_ok: false }),
        ];
        for (values, header) in cases {
            let bytes = [&id[..], &values].concat();
            assert_eq!(I2cResponseHeader::parse(&bytes), Ok(header));
            let mut out = Vec::new();
            header.emit(&mut out);
            assert_eq!(out, bytes);
        }
    }

    #[test]
    fn another_id_or_size_is_an_error() {
        let wrong_id = Error::WrongId {
            packet: "response to an I2C request",
            expected: 0x900D_FD87,
            found: 0x87FD_0D90,
        };
        let mut bytes = [0x90, 0x0D, 0xFD, 0x87, 1, 2, 3, 4, 5, 6, 7, 8];
        assert_eq!(I2cResponseHeader::parse(&bytes), Err(wrong_id));
        bytes[..4].copy_from_slice(&I2cRequestHeader::ID.to_le_bytes());
        assert!(matches!(I2cRequestHeader::parse(&bytes), Err(Error::WrongSize { found: 12, .. })));
        assert!(matches!(I2cResponseHeader::parse(&[0x87]), Err(Error::WrongSize { .. })));
        assert!(matches!(I2cResponseHeader::parse(&[0; 12]), Err(Error::WrongId { .. })));
    }
}
