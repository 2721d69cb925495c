//! StartOnline: begins online mode.

use super::{check, CommandId, ID_LEN};
use crate::error::Error;

/// The command that begins online mode and resets the compression on the controller.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Command_StartOnline")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartOnline {
    /// Name of the program, filled up with NUL.
    pub name: [u8; 64],
}

impl StartOnline {
    /// Size of the packet in bytes.
    pub const LEN: usize = 68;

    /// The command as the kit sends it, with the name `Online`.
    pub fn new() -> Self {
        let mut name = [0; 64];
        name[..6].copy_from_slice(b"Online");
        Self { name }
    }

    /// Reads the packet. Fails when id or size are wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let kind = CommandId::StartOnline;
        check(bytes, kind.name(), kind.id(), Self::LEN)?;
        let mut name = [0; 64];
        name.copy_from_slice(&bytes[ID_LEN..]);
        Ok(Self { name })
    }

    /// Appends the packet to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        CommandId::StartOnline.emit(out);
        out.extend_from_slice(&self.name);
    }
}

/// The command as the kit sends it.
impl Default for StartOnline {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_packet_is_the_kits() {
        let mut out = Vec::new();
        StartOnline::new().emit(&mut out);
        assert_eq!(out.len(), StartOnline::LEN);
        assert_eq!(out[..12], *b"\x1d\xf6\x3f\x16Online\0\0");
        assert_eq!(StartOnline::parse(&out), Ok(StartOnline::new()));
    }
}
