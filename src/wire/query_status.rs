//! QueryStatus: name and firmware version.

use byteorder::{ByteOrder, LittleEndian};

use super::{check, ResponseId};
use crate::error::Error;
use crate::firmware::FirmwareVersion;

mod field {
    use std::ops::{Range, RangeFrom};

    pub(super) const DEVICE_NAME: Range<usize> = 4..20;
    pub(super) const VERSION: RangeFrom<usize> = 20..;
}

/// The controller's response to QueryStatus.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Response_QueryStatus")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueryStatusResponse {
    /// Name of the controller, filled up with NUL.
    #[doc(alias = "m_devicename")]
    pub device_name: [u8; 16],
    /// Version of its firmware.
    #[doc(alias = "m_version")]
    pub version: FirmwareVersion,
}

impl QueryStatusResponse {
    /// Size of the packet in bytes.
    pub const LEN: usize = 24;

    /// Reads the packet. Fails when id or size are wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let kind = ResponseId::QueryStatus;
        check(bytes, kind.name(), kind.id(), Self::LEN)?;
        let mut device_name = [0; 16];
        device_name.copy_from_slice(&bytes[field::DEVICE_NAME]);
        let version = FirmwareVersion::from_code(LittleEndian::read_u32(&bytes[field::VERSION]));
        Ok(Self { device_name, version })
    }

    /// Appends the packet to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        ResponseId::QueryStatus.emit(out);
        out.extend_from_slice(&self.device_name);
        out.extend_from_slice(&self.version.code().to_le_bytes());
    }

    /// The name up to the first NUL; bytes that are not UTF-8 are replaced.
    pub fn name(&self) -> String {
        let end = self.device_name.iter().position(|&byte| byte == 0);
        let name = &self.device_name[..end.unwrap_or(self.device_name.len())];
        String::from_utf8_lossy(name).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: &[u8; 24] = b"\x3e\x72\xc9\xbaTX2013\0\0\0\0\0\0\0\0\0\0\x00\x06\x01\x04";

    #[test]
    fn the_recorded_answer_is_read_and_written() {
        let response = QueryStatusResponse::parse(BYTES).unwrap();
        assert_eq!(response.name(), "TX2013");
        assert_eq!(response.version, FirmwareVersion::new(4, 1, 6));
        let mut out = Vec::new();
        response.emit(&mut out);
        assert_eq!(out, BYTES);
    }

    #[test]
    fn a_name_without_nul_has_all_16_characters() {
        let mut response = QueryStatusResponse::parse(BYTES).unwrap();
        response.device_name = *b"ROBOTICS TXT 001";
        assert_eq!(response.name(), "ROBOTICS TXT 001");
    }

    #[test]
    fn another_size_is_an_error() {
        assert_eq!(
            QueryStatusResponse::parse(&BYTES[..23]),
            Err(Error::WrongSize { packet: "QueryStatus response", expected: 24, found: 23 })
        );
    }
}
