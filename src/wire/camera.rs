//! The camera: commands on the main connection, frames on a connection of their own.

use byteorder::{ByteOrder, LittleEndian};

use super::{check, push_values, CommandId, ID_LEN};
use crate::error::Error;

/// The command that starts the camera server, which takes 1 to 2 seconds.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Command_StartCameraOnline")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartCameraOnline {
    /// Width of the picture in pixels.
    pub width: i32,
    /// Height of the picture in pixels.
    pub height: i32,
    /// Frames per second.
    pub framerate: i32,
    /// Frequency of the mains in Hz, 50 or 60; 0 is automatic.
    #[doc(alias = "m_powerlinefreq")]
    pub power_line_frequency: i32,
}

impl StartCameraOnline {
    /// Size of the packet in bytes.
    pub const LEN: usize = 20;

    /// Reads the packet. Fails when id or size are wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let kind = CommandId::StartCameraOnline;
        check(bytes, kind.name(), kind.id(), Self::LEN)?;
        let mut values = [0; 4];
        LittleEndian::read_i32_into(&bytes[ID_LEN..], &mut values);
        let [width, height, framerate, power_line_frequency] = values;
        Ok(Self { width, height, framerate, power_line_frequency })
    }

    /// Appends the packet to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        CommandId::StartCameraOnline.emit(out);
        for value in [self.width, self.height, self.framerate, self.power_line_frequency] {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
}

mod field {
    use std::ops::{Range, RangeFrom};

    pub(super) const FRAMES_READY: Range<usize> = 4..8;
    pub(super) const WIDTH: Range<usize> = 8..10;
    pub(super) const HEIGHT: Range<usize> = 10..12;
    pub(super) const SIZE_RAW: Range<usize> = 12..16;
    pub(super) const SIZE_COMPRESSED: RangeFrom<usize> = 16..;
}

/// The header of each frame on the camera connection; the JPEG bytes follow.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Response_CameraOnlineFrame")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraFrameHeader {
    /// 1 when the picture was waiting for the acknowledgement, otherwise 0 (the maker's firmware 4.7.0, measured under
    /// emulation).
    #[doc(alias = "m_numframeready")]
    pub frames_ready: i32,
    /// Width of the picture in pixels.
    #[doc(alias = "m_framewidth")]
    pub width: i16,
    /// Height of the picture in pixels.
    #[doc(alias = "m_frameheight")]
    pub height: i16,
    /// Size of the picture when decoded to YUV 4:2:2, usually width × height × 2 bytes.
    #[doc(alias = "m_framesizeraw")]
    pub size_raw: i32,
    /// How many bytes of JPEG follow.
    #[doc(alias = "m_framesizecompressed")]
    pub size_compressed: i32,
}

impl CameraFrameHeader {
    /// Size of the header in bytes.
    pub const LEN: usize = 20;

    /// The id it starts with.
    #[doc(alias = "ftIF2013DataId_CameraOnlineFrame")]
    pub const ID: u32 = 0xBDC2_D7A1;

    /// Reads the header. Fails when id or size are wrong; the values are not checked.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        check(bytes, "camera frame", Self::ID, Self::LEN)?;
        Ok(Self {
            frames_ready: LittleEndian::read_i32(&bytes[field::FRAMES_READY]),
            width: LittleEndian::read_i16(&bytes[field::WIDTH]),
            height: LittleEndian::read_i16(&bytes[field::HEIGHT]),
            size_raw: LittleEndian::read_i32(&bytes[field::SIZE_RAW]),
            size_compressed: LittleEndian::read_i32(&bytes[field::SIZE_COMPRESSED]),
        })
    }

    /// Appends the header to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&Self::ID.to_le_bytes());
        out.extend_from_slice(&self.frames_ready.to_le_bytes());
        push_values(out, [self.width, self.height]);
        out.extend_from_slice(&self.size_raw.to_le_bytes());
        out.extend_from_slice(&self.size_compressed.to_le_bytes());
    }
}

/// What the client sends when it has read a frame; then the next one comes.
#[doc(alias = "ftIF2013AcknowledgeId_CameraOnlineFrame")]
pub const CAMERA_FRAME_ACKNOWLEDGE: [u8; ID_LEN] = 0xADA0_9FBA_u32.to_le_bytes();

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_has_its_place() {
        let start =
            StartCameraOnline { width: 320, height: 240, framerate: 15, power_line_frequency: 50 };
        let mut out = Vec::new();
        start.emit(&mut out);
        assert_eq!(out.len(), StartCameraOnline::LEN);
        assert_eq!(out[..8], [0xA6, 0x40, 0x2A, 0x88, 0x40, 1, 0, 0]);
        assert_eq!(out[8..], [240, 0, 0, 0, 15, 0, 0, 0, 50, 0, 0, 0]);
        assert_eq!(StartCameraOnline::parse(&out), Ok(start));
    }

    #[test]
    fn every_field_of_a_frame_has_its_place() {
        let header = CameraFrameHeader {
            frames_ready: 2,
            width: 320,
            height: 240,
            size_raw: 153_600,
            size_compressed: -1,
        };
        let mut out = Vec::new();
        header.emit(&mut out);
        assert_eq!(out.len(), CameraFrameHeader::LEN);
        assert_eq!(out[..12], [0xA1, 0xD7, 0xC2, 0xBD, 2, 0, 0, 0, 0x40, 1, 240, 0]);
        assert_eq!(out[12..], [0x00, 0x58, 0x02, 0x00, 0xFF, 0xFF, 0xFF, 0xFF]);
        assert_eq!(CameraFrameHeader::parse(&out), Ok(header));
        out[0] = 0;
        assert!(matches!(CameraFrameHeader::parse(&out), Err(Error::WrongId { .. })));
    }
}
