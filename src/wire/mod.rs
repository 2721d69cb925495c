//! The bytes on the wire: ids, packets, compression and checksum.
//!
//! Nothing here does I/O or reads a clock, and nothing panics on bytes from outside: `parse` checks id
//! and size and returns an [`Error`]. All integers are little-endian. There is one
//! file per packet kind. Each packet is a plain struct with `parse`, a size, and `emit`, which writes
//! into a buffer.
//!
//! The fields of each packet are those of the protocol, so these structs are closed on purpose: a program
//! can write them out. The enums of ids are exhaustive, too.
//!
//! Source: the sections of the kit's document on the commands, and for the rest
//! [`guide::protocol`](crate::guide::protocol).

mod camera;
mod compression;
mod crc;
mod exchange_data;
mod exchange_data_cmpr;
mod i2c;
mod id;
mod query_status;
mod start_online;
mod update_config;

pub use camera::{CameraFrameHeader, StartCameraOnline, CAMERA_FRAME_ACKNOWLEDGE};
pub use compression::{Compressor, Expander};
pub use crc::crc_of_words;
pub use exchange_data::{ExchangeData, ExchangeDataResponse, IrRemote};
pub use exchange_data_cmpr::{CmprHeader, MAX_EXTRA_SIZE};
pub use i2c::{I2cRequestHeader, I2cResponseHeader};
pub use id::{CommandId, ResponseId};
pub use query_status::QueryStatusResponse;
pub use start_online::StartOnline;
pub use update_config::UpdateConfig;

use byteorder::{ByteOrder, LittleEndian};

use crate::error::Error;

/// Size of an id, and so of a packet that has only an id.
pub const ID_LEN: usize = 4;

/// Checks that `bytes` are a whole packet with this id and size.
fn check(bytes: &[u8], packet: &'static str, id: u32, size: usize) -> Result<(), Error> {
    check_id(bytes, packet, id)?;
    if bytes.len() != size {
        return Err(Error::WrongSize { packet, expected: size, found: bytes.len() });
    }
    Ok(())
}

/// Checks the id at the start of `bytes`.
fn check_id(bytes: &[u8], packet: &'static str, id: u32) -> Result<(), Error> {
    let Some(start) = bytes.get(..ID_LEN) else {
        return Err(Error::WrongSize { packet, expected: ID_LEN, found: bytes.len() });
    };
    let found = LittleEndian::read_u32(start);
    if found != id {
        return Err(Error::WrongId { packet, expected: id, found });
    }
    Ok(())
}

/// Appends a field of words to `out`.
fn push_words(out: &mut Vec<u8>, words: impl IntoIterator<Item = u16>) {
    for word in words {
        out.extend_from_slice(&word.to_le_bytes());
    }
}

/// Appends a field of signed words to `out`.
fn push_values(out: &mut Vec<u8>, values: impl IntoIterator<Item = i16>) {
    push_words(out, values.into_iter().map(|value| value as u16));
}
