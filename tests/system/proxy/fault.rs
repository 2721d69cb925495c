//! The faults of a connection.

use byteorder::{ByteOrder, LittleEndian};

use super::packets::Place;

/// What happens to a packet, or instead of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    Fin,
    Rst,
    /// The controller's side is closed, but it still reads.
    HalfClose,
    /// No response from now on, but requests arrive.
    Silence,
    /// Nothing arrives in either direction from now on.
    Cut,
    /// Half of the packet, and nothing after it.
    Half,
    HalfThenFin,
    Drip,
    /// So slowly that it takes longer than the read limit.
    SlowDrip,
    WrongId,
    WrongCrc,
    /// Announces more bytes than any packet has.
    TooLarge,
    /// Announces more bytes than come.
    TooLong,
    /// Announces fewer bytes than come.
    TooShort,
    /// Announces an extension that is not there.
    WrongMask,
    Surplus,
    /// Endless bytes after the packet, while requests are read.
    Endless,
}

/// A fault, and where it strikes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strike {
    pub(crate) place: Place,
    /// In the request, otherwise in its response.
    pub(crate) in_request: bool,
    pub(crate) fault: Fault,
}

impl Strike {
    /// Whether nothing that the program sends arrives from now on.
    pub(crate) fn cuts(self) -> bool {
        self.fault == Fault::Cut || self.in_request && self.fault == Fault::Half
    }

    /// Whether the program notices it by the read limit.
    pub(crate) fn is_silent(self) -> bool {
        matches!(
            self.fault,
            Fault::Silence | Fault::Cut | Fault::Half | Fault::SlowDrip | Fault::TooLong
        )
    }
}

impl Fault {
    /// The bytes of a packet after this fault.
    pub(crate) fn disturb(self, packet: &[u8]) -> Vec<u8> {
        let mut bytes = packet.to_vec();
        match self {
            Self::WrongId => bytes[..4].iter_mut().for_each(|byte| *byte = !*byte),
            Self::WrongCrc => bytes[8] ^= 1,
            Self::TooLarge => LittleEndian::write_u32(&mut bytes[4..8], u32::MAX),
            Self::TooLong => add(&mut bytes, 7),
            Self::TooShort => add(&mut bytes, -1),
            Self::WrongMask => bytes[12] ^= 1,
            Self::Surplus => bytes.extend([0xA5; 5]),
            fault => unreachable!("{fault:?} is not one of the bytes"),
        }
        bytes
    }
}

/// Adds to the announced size of the compressed data.
fn add(bytes: &mut [u8], count: i32) {
    let size = LittleEndian::read_u32(&bytes[4..8]);
    LittleEndian::write_u32(&mut bytes[4..8], size.wrapping_add_signed(count));
}
