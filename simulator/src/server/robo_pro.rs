//! The commands of ROBO Pro, the maker's program for PCs, as far as the firmware answers them on any connection.
//! (Measured on the maker's firmware 4.7.0 under emulation.)

use byteorder::{ByteOrder, LittleEndian};
use ft_transfer_area::wire::ID_LEN;

/// Stops the programs on the controller.
const STOP_PROGRAMS: u32 = 0xACAB_31F7;
const PROGRAMS_STOPPED: u32 = 0x15B1_758E;

/// Asks for something of 16 bytes.
const ASK: u32 = 0xDAF8_4364;
const ANSWER: u32 = 0x5170_C53B;

/// Begins to transfer a file. The firmware waits for a block of bytes then.
const TRANSFER_FILE: u32 = 0x4A87_C47A;

/// The size of the first block of a file.
pub(crate) const BLOCK: usize = 256;

/// What is done with a command.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Reply {
    Answer(Vec<u8>),
    /// A [`BLOCK`] is waited for.
    Wait,
}

/// What is done with the command that these bytes start with; `None` if it is none of ROBO Pro's.
pub(crate) fn reply(bytes: &[u8]) -> Option<Reply> {
    match LittleEndian::read_u32(bytes.get(..ID_LEN)?) {
        STOP_PROGRAMS => Some(Reply::Answer(PROGRAMS_STOPPED.to_le_bytes().to_vec())),
        ASK => Some(Reply::Answer([&ANSWER.to_le_bytes()[..], &[0; 16]].concat())),
        TRANSFER_FILE => Some(Reply::Wait),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_ids_of_its_commands_are_answered() {
        let id = STOP_PROGRAMS.to_le_bytes();
        assert_eq!(reply(&id[..3]), None);
        assert_eq!(reply(&id), Some(Reply::Answer(vec![0x8E, 0x75, 0xB1, 0x15])));
        assert_eq!(reply(&TRANSFER_FILE.to_le_bytes()), Some(Reply::Wait));
        assert_eq!(reply(&[0; 4]), None);
    }
}
