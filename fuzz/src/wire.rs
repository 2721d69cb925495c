//! Packets and compression.

use std::fmt::Debug;

use arbitrary::{Result, Unstructured};
use ft_transfer_area::wire::{
    crc_of_words, CameraFrameHeader, CmprHeader, CommandId, Compressor, ExchangeData,
    ExchangeDataResponse, Expander, I2cRequestHeader, I2cResponseHeader, QueryStatusResponse,
    ResponseId, StartCameraOnline, StartOnline, UpdateConfig, ID_LEN,
};
use ft_transfer_area::Error;

use super::take;

/// How a packet is read and written.
struct Kind<P> {
    id: [u8; ID_LEN],
    size: usize,
    /// How many bytes at its end are not read, and written as 0.
    unused: usize,
    parse: fn(&[u8]) -> std::result::Result<P, Error>,
    emit: fn(&P, &mut Vec<u8>),
}

/// Reads the bytes as each kind of packet, as they are and with the kind's id and size. Writing the
/// packet must give the same bytes.
pub fn wire(data: &[u8]) {
    if let Some(id) = data.first_chunk().map(|id| u32::from_le_bytes(*id)) {
        if let Some(command) = CommandId::from_id(id) {
            assert_eq!(command.id(), id);
            assert!(command.response().check(data).is_err(), "a command is not a response");
        }
        if let Some(response) = ResponseId::from_id(id) {
            let is_right = response.check(data);
            assert!(is_right.is_ok(), "{is_right:?}");
        }
    }
    let query_status = Kind {
        id: ResponseId::QueryStatus.id().to_le_bytes(),
        size: QueryStatusResponse::LEN,
        unused: 0,
        parse: QueryStatusResponse::parse,
        emit: QueryStatusResponse::emit,
    };
    if let Some(status) = query_status.check(data) {
        assert!(!status.name().contains('\0'));
        let _ = status.version.to_string();
    }
    Kind {
        id: CommandId::StartOnline.id().to_le_bytes(),
        size: StartOnline::LEN,
        unused: 0,
        parse: StartOnline::parse,
        emit: StartOnline::emit,
    }
    .check(data);
    Kind {
        id: CommandId::UpdateConfig.id().to_le_bytes(),
        size: UpdateConfig::LEN,
        unused: 0,
        parse: UpdateConfig::parse,
        emit: UpdateConfig::emit,
    }
    .check(data);
    Kind {
        id: CommandId::ExchangeData.id().to_le_bytes(),
        size: ExchangeData::LEN,
        unused: 2,
        parse: ExchangeData::parse,
        emit: ExchangeData::emit,
    }
    .check(data);
    Kind {
        id: ResponseId::ExchangeData.id().to_le_bytes(),
        size: ExchangeDataResponse::LEN,
        unused: 1,
        parse: ExchangeDataResponse::parse,
        emit: ExchangeDataResponse::emit,
    }
    .check(data);
    Kind {
        id: CommandId::ExchangeDataCmpr.id().to_le_bytes(),
        size: CmprHeader::LEN,
        unused: 2,
        parse: CmprHeader::parse_command,
        emit: CmprHeader::emit_command,
    }
    .check(data);
    Kind {
        id: ResponseId::ExchangeDataCmpr.id().to_le_bytes(),
        size: CmprHeader::LEN,
        unused: 2,
        parse: CmprHeader::parse_response,
        emit: CmprHeader::emit_response,
    }
    .check(data);
    Kind {
        id: CommandId::StartCameraOnline.id().to_le_bytes(),
        size: StartCameraOnline::LEN,
        unused: 0,
        parse: StartCameraOnline::parse,
        emit: StartCameraOnline::emit,
    }
    .check(data);
    Kind {
        id: CameraFrameHeader::ID.to_le_bytes(),
        size: CameraFrameHeader::LEN,
        unused: 0,
        parse: CameraFrameHeader::parse,
        emit: CameraFrameHeader::emit,
    }
    .check(data);
    let values = data.get(ID_LEN..).unwrap_or_default();
    let request = [&I2cRequestHeader::ID.to_le_bytes(), values].concat();
    values_survive(
        &request,
        I2cRequestHeader::LEN,
        I2cRequestHeader::parse,
        I2cRequestHeader::emit,
    );
    let response = [&I2cResponseHeader::ID.to_le_bytes(), values].concat();
    values_survive(
        &response,
        I2cResponseHeader::LEN,
        I2cResponseHeader::parse,
        I2cResponseHeader::emit,
    );
}

/// For a packet with bytes in its middle that are not read: writing it must give a packet of the same values.
fn values_survive<P: Debug + PartialEq>(
    bytes: &[u8],
    size: usize,
    parse: fn(&[u8]) -> std::result::Result<P, Error>,
    emit: fn(&P, &mut Vec<u8>),
) {
    let Some(bytes) = bytes.get(..size) else { return };
    let packet = parse(bytes).expect("a packet with this id and size");
    let mut out = Vec::new();
    emit(&packet, &mut out);
    assert_eq!(parse(&out), Ok(packet));
}

impl<P: Debug + PartialEq> Kind<P> {
    /// The packet of these bytes with the right id and size.
    fn check(&self, data: &[u8]) -> Option<P> {
        self.round_trip(data);
        let mut bytes = self.id.to_vec();
        bytes.extend_from_slice(data);
        bytes.resize(self.size, 0);
        self.round_trip(&bytes)
    }

    fn round_trip(&self, bytes: &[u8]) -> Option<P> {
        let packet = match (self.parse)(bytes) {
            Ok(packet) => packet,
            Err(error) => {
                assert!(!error.to_string().is_empty());
                return None;
            }
        };
        let mut out = Vec::new();
        (self.emit)(&packet, &mut out);
        let used = self.size - self.unused;
        assert_eq!(bytes.len(), self.size);
        assert_eq!(out[..used], bytes[..used]);
        assert_eq!(out[used..], vec![0; self.unused]);
        assert_eq!((self.parse)(&out).as_ref(), Ok(&packet));
        Some(packet)
    }
}

/// Expands packet after packet. Compresses the words again, and expands them with another expander.
pub fn expansion(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = expand_packets(&mut Unstructured::new(data));
}

fn expand_packets(input: &mut Unstructured) -> Result<()> {
    let (mut expander, mut compressor, mut other) =
        (Expander::new(), Compressor::new(), Expander::new());
    while !input.is_empty() {
        // Areas have 27, 50 or 52 words. The longest run of the kit has 4370.
        let count = input.int_in_range(0..=5000)?;
        let packet = take(input, 1000)?;
        let Some(words) = expand(&mut expander, packet, count) else { continue };
        let mut compressed = Vec::new();
        let crc = compressor.compress(&words, &mut compressed);
        assert_eq!(other.expand(&compressed, count, crc), Ok(&words[..]));
    }
    Ok(())
}

/// The words of a packet with any checksum.
fn expand(expander: &mut Expander, packet: &[u8], count: usize) -> Option<Vec<u16>> {
    let mut before = expander.clone();
    let words = match expander.expand(packet, count, 0) {
        Ok(words) => words.to_vec(),
        Err(Error::WrongCrc { announced: 0, computed }) => {
            let words = expander.expand(packet, count, computed).map(<[u16]>::to_vec);
            let untouched = before.expand(packet, count, computed).map(<[u16]>::to_vec);
            assert_eq!(words, untouched, "a wrong checksum changed the expander");
            let words = words.expect("the checksum is right");
            assert_eq!(crc_of_words(&words), computed);
            words
        }
        Err(Error::DataEndsEarly { expected, found }) => {
            assert!(expected == count && found < count);
            return None;
        }
        Err(error) => panic!("{error}"),
    };
    assert_eq!(words.len(), count);
    Some(words)
}
