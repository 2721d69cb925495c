//! The ids that packets start with.

use std::fmt;

use super::{
    check_id, CmprHeader, ExchangeData, ExchangeDataResponse, QueryStatusResponse,
    StartCameraOnline, StartOnline, UpdateConfig, ID_LEN,
};
use crate::error::Error;

/// Makes an enum of packet kinds, with their ids and their names in messages.
macro_rules! ids {
    ($(#[$meta:meta])* $name:ident { $($(#[$variant_meta:meta])* $variant:ident = $id:literal, $text:literal;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u32)]
        pub enum $name {
            $($(#[$variant_meta])* $variant = $id,)*
        }

        impl $name {
            /// The packet kind with this id, if there is one.
            pub const fn from_id(id: u32) -> Option<Self> {
                match id {
                    $($id => Some(Self::$variant),)*
                    _ => None,
                }
            }

            /// The id, the first four bytes of the packet in little-endian order.
            pub const fn id(self) -> u32 {
                self as u32
            }

            /// The name used in messages.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

ids! {
    /// The commands that a client sends on the main connection (port 65000).
    #[doc(alias = "ftIF2013CommandId")]
    CommandId {
        /// Asks for name and firmware version. The packet is only the id.
        #[doc(alias = "ftIF2013CommandId_QueryStatus")]
        QueryStatus = 0xDC21_219A, "QueryStatus";
        /// Begins online mode and resets the compression: [`StartOnline`](super::StartOnline).
        #[doc(alias = "ftIF2013CommandId_StartOnline")]
        StartOnline = 0x163F_F61D, "StartOnline";
        /// Sends a configuration: [`UpdateConfig`](super::UpdateConfig).
        #[doc(alias = "ftIF2013CommandId_UpdateConfig")]
        UpdateConfig = 0x060E_F27E, "UpdateConfig";
        /// Exchanges the master's outputs and inputs: [`ExchangeData`](super::ExchangeData).
        #[doc(alias = "ftIF2013CommandId_ExchangeData")]
        ExchangeData = 0xCC35_97BA, "ExchangeData";
        /// Exchanges outputs and inputs, compressed: [`CmprHeader`](super::CmprHeader) and data.
        #[doc(alias = "ftIF2013CommandId_ExchangeDataCmpr")]
        ExchangeDataCmpr = 0xFBC5_6F98, "ExchangeDataCmpr";
        /// Ends online mode. The packet is only the id.
        #[doc(alias = "ftIF2013CommandId_StopOnline")]
        StopOnline = 0x9BE5_082C, "StopOnline";
        /// Starts the camera server.
        #[doc(alias = "ftIF2013CommandId_StartCameraOnline")]
        StartCameraOnline = 0x882A_40A6, "StartCameraOnline";
        /// Stops the camera server. The packet is only the id.
        #[doc(alias = "ftIF2013CommandId_StopCameraOnline")]
        StopCameraOnline = 0x17C3_1F2F, "StopCameraOnline";
    }
}

ids! {
    /// The responses of the controller on the main connection, one per command.
    #[doc(alias = "ftIF2013ResponseId")]
    ResponseId {
        /// Name and firmware version: [`QueryStatusResponse`](super::QueryStatusResponse).
        #[doc(alias = "ftIF2013ResponseId_QueryStatus")]
        QueryStatus = 0xBAC9_723E, "QueryStatus response";
        /// Online mode has begun. The packet is only the id.
        #[doc(alias = "ftIF2013ResponseId_StartOnline")]
        StartOnline = 0xCA68_9F75, "StartOnline response";
        /// The configuration has arrived. The packet is only the id.
        #[doc(alias = "ftIF2013ResponseId_UpdateConfig")]
        UpdateConfig = 0x9689_A68C, "UpdateConfig response";
        /// The master's inputs: [`ExchangeDataResponse`](super::ExchangeDataResponse).
        #[doc(alias = "ftIF2013ResponseId_ExchangeData")]
        ExchangeData = 0x4EEF_AC41, "ExchangeData response";
        /// Inputs, compressed: [`CmprHeader`](super::CmprHeader) and data.
        #[doc(alias = "ftIF2013ResponseId_ExchangeDataCmpr")]
        ExchangeDataCmpr = 0x6F3B_54E6, "ExchangeDataCmpr response";
        /// Online mode has ended. The packet is only the id.
        #[doc(alias = "ftIF2013ResponseId_StopOnline")]
        StopOnline = 0xFBF6_00D2, "StopOnline response";
        /// The camera server starts. The packet is only the id.
        #[doc(alias = "ftIF2013ResponseId_StartCameraOnline")]
        StartCameraOnline = 0xCF41_B24E, "StartCameraOnline response";
        /// The camera server stops. The packet is only the id.
        #[doc(alias = "ftIF2013ResponseId_StopCameraOnline")]
        StopCameraOnline = 0x4B3C_1EB6, "StopCameraOnline response";
    }
}

impl CommandId {
    /// The response that this command gets.
    pub const fn response(self) -> ResponseId {
        match self {
            Self::QueryStatus => ResponseId::QueryStatus,
            Self::StartOnline => ResponseId::StartOnline,
            Self::UpdateConfig => ResponseId::UpdateConfig,
            Self::ExchangeData => ResponseId::ExchangeData,
            Self::ExchangeDataCmpr => ResponseId::ExchangeDataCmpr,
            Self::StopOnline => ResponseId::StopOnline,
            Self::StartCameraOnline => ResponseId::StartCameraOnline,
            Self::StopCameraOnline => ResponseId::StopCameraOnline,
        }
    }

    /// Appends the id to `out`: the whole packet of a command without arguments, the start of
    /// the others.
    pub fn emit(self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.id().to_le_bytes());
    }

    /// The size of the command that starts with `start` and has this id, in bytes, as far as
    /// `start` shows it: with that many bytes the result may be larger.
    ///
    /// # Errors
    ///
    /// As [`CmprHeader::parse_command`].
    pub fn size(self, start: &[u8]) -> Result<usize, Error> {
        Ok(match self {
            Self::QueryStatus | Self::StopOnline | Self::StopCameraOnline => ID_LEN,
            Self::StartOnline => StartOnline::LEN,
            Self::UpdateConfig => UpdateConfig::LEN,
            Self::StartCameraOnline => StartCameraOnline::LEN,
            Self::ExchangeData => ExchangeData::LEN,
            Self::ExchangeDataCmpr => compressed_size(start, CmprHeader::parse_command)?,
        })
    }
}

/// The size of a compressed packet, as far as its start shows it.
fn compressed_size(
    start: &[u8],
    parse: fn(&[u8]) -> Result<CmprHeader, Error>,
) -> Result<usize, Error> {
    let header = match start.get(..CmprHeader::LEN) {
        None => return Ok(CmprHeader::LEN),
        Some(header) => parse(header)?,
    };
    Ok(CmprHeader::LEN + header.extra_size as usize)
}

impl ResponseId {
    /// Appends the id to `out`: the whole packet of a response without values, the start of the
    /// others.
    pub fn emit(self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.id().to_le_bytes());
    }

    /// The size of the response that starts with `start` and has this id, in bytes, as far as
    /// `start` shows it: with that many bytes the result may be larger.
    ///
    /// # Errors
    ///
    /// As [`CmprHeader::parse_response`].
    pub fn size(self, start: &[u8]) -> Result<usize, Error> {
        Ok(match self {
            Self::StartOnline
            | Self::UpdateConfig
            | Self::StopOnline
            | Self::StartCameraOnline
            | Self::StopCameraOnline => ID_LEN,
            Self::QueryStatus => QueryStatusResponse::LEN,
            Self::ExchangeData => ExchangeDataResponse::LEN,
            Self::ExchangeDataCmpr => compressed_size(start, CmprHeader::parse_response)?,
        })
    }

    /// Checks that `bytes`, at least [`ID_LEN`] of them, start with this id.
    pub fn check(self, bytes: &[u8]) -> Result<(), Error> {
        check_id(bytes, self.name(), self.id())
    }
}

/// A packet starts with its id, so the shortest packet has the size of an id.
const _: () = assert!(ID_LEN == std::mem::size_of::<CommandId>());

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_known_by_its_id_and_no_other_number_is_one() {
        assert_eq!(CommandId::from_id(0x9BE5_082C), Some(CommandId::StopOnline));
        assert_eq!(CommandId::from_id(0x9BE5_082D), None);
        assert_eq!(ResponseId::from_id(0xFBF6_00D2), Some(ResponseId::StopOnline));
        assert_eq!(CommandId::StopOnline.response(), ResponseId::StopOnline);
    }

    #[test]
    fn an_id_is_written_from_its_lowest_byte() {
        let mut out = Vec::new();
        CommandId::QueryStatus.emit(&mut out);
        assert_eq!(out, [0x9A, 0x21, 0x21, 0xDC]);
        assert_eq!(
            ResponseId::QueryStatus.check(&out),
            Err(Error::WrongId {
                packet: "QueryStatus response",
                expected: 0xBAC9_723E,
                found: 0xDC21_219A
            })
        );
    }

    #[test]
    fn the_size_of_a_packet_is_told_by_its_start() {
        let header = CmprHeader { extra_size: 9, ..CmprHeader::default() };
        let (mut command, mut response) = (Vec::new(), Vec::new());
        header.emit_command(&mut command);
        header.emit_response(&mut response);
        for (there, size) in [(0, 16), (15, 16), (16, 25)] {
            assert_eq!(CommandId::ExchangeDataCmpr.size(&command[..there]), Ok(size));
            assert_eq!(ResponseId::ExchangeDataCmpr.size(&response[..there]), Ok(size));
        }
        assert_eq!(CommandId::StopOnline.size(&[]), Ok(4));
        assert_eq!(CommandId::ExchangeData.size(&[]), Ok(ExchangeData::LEN));
        assert_eq!(ResponseId::UpdateConfig.size(&[]), Ok(4));
        assert_eq!(ResponseId::QueryStatus.size(&[]), Ok(QueryStatusResponse::LEN));
    }

    #[test]
    fn a_packet_that_announces_too_much_has_no_size() {
        let header = CmprHeader { extra_size: 4097, ..CmprHeader::default() };
        let (mut command, mut response) = (Vec::new(), Vec::new());
        header.emit_command(&mut command);
        header.emit_response(&mut response);
        for size in [
            CommandId::ExchangeDataCmpr.size(&command),
            ResponseId::ExchangeDataCmpr.size(&response),
        ] {
            assert!(matches!(size, Err(Error::TooLarge { announced: 4097, .. })));
        }
    }
}
