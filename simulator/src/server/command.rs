//! Which commands there are, how long they are, what is wrong with others, and those that are not carried out yet.

use std::fmt;

use byteorder::{ByteOrder, LittleEndian};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::wire::{CmprHeader, CommandId, ID_LEN, MAX_EXTRA_SIZE};
use ft_transfer_area::Error;

/// Why a client's connection is closed without an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Misbehaviour {
    /// No command has this id.
    UnknownId(u32),
    /// The command came in pieces.
    InPieces,
    /// It ends the program of the controller, for this reason.
    EndsProgram(String),
    /// More extensions than possible.
    Extensions(u16),
    /// The packet can't be understood.
    Packet(Error),
}

impl fmt::Display for Misbehaviour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownId(id) => write!(f, "no command has the id {id:#010x}"),
            Self::InPieces => f.write_str("a command came in pieces"),
            Self::EndsProgram(why) => f.write_str(why),
            Self::Extensions(mask) => {
                write!(f, "extension mask {mask:#06x} has more than {MAX_EXTENSIONS} bits")
            }
            Self::Packet(error) => error.fmt(f),
        }
    }
}

impl From<Error> for Misbehaviour {
    fn from(error: Error) -> Self {
        Self::Packet(error)
    }
}

/// The size of the command that starts with these bytes, as far as they show it. With that many
/// bytes the result may be larger.
pub(crate) fn command_size(start: &[u8]) -> Result<usize, Misbehaviour> {
    let Some(id) = start.get(..ID_LEN) else { return Ok(ID_LEN) };
    Ok(command_id(id)?.size(start)?)
}

/// Which command these bytes are. There are at least [`ID_LEN`] of them.
pub(crate) fn command_id(command: &[u8]) -> Result<CommandId, Misbehaviour> {
    let id = LittleEndian::read_u32(command);
    CommandId::from_id(id).ok_or(Misbehaviour::UnknownId(id))
}

/// Whether this is an exchange, in either form.
pub(crate) fn is_exchange(command: CommandId) -> bool {
    matches!(command, CommandId::ExchangeData | CommandId::ExchangeDataCmpr)
}

/// What has arrived after a command before its response is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ahead {
    /// No whole command.
    Nothing,
    /// What a client sends on a connection that it gives up: StopOnline, perhaps after a last
    /// exchange.
    Farewell,
    /// Another command.
    Command(CommandId),
}

/// What these bytes are; a command may start with them.
pub(crate) fn ahead(bytes: &[u8]) -> Ahead {
    let Some((first, rest)) = split_command(bytes) else { return Ahead::Nothing };
    let last = if is_exchange(first) {
        split_command(rest).map(|(second, _)| second)
    } else {
        Some(first)
    };
    if last == Some(CommandId::StopOnline) {
        Ahead::Farewell
    } else {
        Ahead::Command(first)
    }
}

/// The command that these bytes start with, if it is whole, and what follows it.
fn split_command(bytes: &[u8]) -> Option<(CommandId, &[u8])> {
    let (command, rest) = bytes.split_at_checked(command_size(bytes).ok()?)?;
    Some((command_id(command).ok()?, rest))
}

/// The longest command.
const COMMAND_MAX: usize = CmprHeader::LEN + MAX_EXTRA_SIZE;

/// The longest end of a session, a last exchange and StopOnline, see [`ahead`].
const FAREWELL_MAX: usize = COMMAND_MAX + ID_LEN;

/// The bytes of a client that have been read and not been carried out.
pub(crate) struct Inbox {
    /// There is room for a command, and after it a last exchange and StopOnline.
    bytes: Vec<u8>,
    /// How many of them there are.
    count: usize,
}

impl Inbox {
    pub(crate) fn new() -> Self {
        Self { bytes: vec![0; COMMAND_MAX + FAREWELL_MAX], count: 0 }
    }

    /// Where the next bytes go. It is empty only when there is a whole command.
    pub(crate) fn room(&mut self) -> &mut [u8] {
        &mut self.bytes[self.count..]
    }

    /// This many bytes have been put into the room.
    pub(crate) fn add(&mut self, count: usize) {
        self.count += count;
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.count]
    }

    /// The first command, when it is whole.
    pub(crate) fn command(&self) -> Result<Option<&[u8]>, Misbehaviour> {
        let bytes = self.bytes();
        Ok(bytes.get(..command_size(bytes)?))
    }

    /// Whether there is a part of a command that does not end where the firmware reads on: after the id, and after the
    /// header of a compressed exchange.
    pub(crate) fn has_piece(&self) -> bool {
        let bytes = self.bytes();
        let is_compressed = || command_id(bytes) == Ok(CommandId::ExchangeDataCmpr);
        match bytes.len() {
            0 | ID_LEN => false,
            CmprHeader::LEN if is_compressed() => false,
            _ => self.command() == Ok(None),
        }
    }

    /// Removes as many bytes as the first command has.
    pub(crate) fn remove(&mut self, size: usize) {
        self.bytes.copy_within(size..self.count, 0);
        self.count -= size;
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::wire::{ExchangeData, StartOnline, UpdateConfig};

    use super::*;

    #[test]
    fn the_size_of_a_command_is_told_by_its_start() {
        let mut command = Vec::new();
        CmprHeader { extra_size: 9, ..CmprHeader::default() }.emit_command(&mut command);
        for (there, size) in [(0, 4), (3, 4), (4, 16), (15, 16), (16, 25)] {
            assert_eq!(command_size(&command[..there]), Ok(size));
        }
        let update = CommandId::UpdateConfig.id().to_le_bytes();
        assert_eq!(command_size(&update), Ok(UpdateConfig::LEN));
    }

    #[test]
    fn a_farewell_is_told_from_other_commands() {
        let id = |command: CommandId| command.id().to_le_bytes().to_vec();
        let (mut exchange, mut compressed) = (Vec::new(), Vec::new());
        ExchangeData::default().emit(&mut exchange);
        CmprHeader { extra_size: 2, ..CmprHeader::default() }.emit_command(&mut compressed);
        compressed.extend([0; 2]);
        let (query, stop) = (id(CommandId::QueryStatus), id(CommandId::StopOnline));
        assert_eq!(ahead(&stop), Ahead::Farewell);
        assert_eq!(ahead(&query), Ahead::Command(CommandId::QueryStatus));
        assert_eq!(ahead(&[query, stop.clone()].concat()), Ahead::Command(CommandId::QueryStatus));
        for (last, id) in
            [(exchange, CommandId::ExchangeData), (compressed, CommandId::ExchangeDataCmpr)]
        {
            assert_eq!(ahead(&last[..last.len() - 1]), Ahead::Nothing);
            assert_eq!(ahead(&last), Ahead::Command(id));
            assert_eq!(ahead(&[&last[..], &stop].concat()), Ahead::Farewell);
            assert_eq!(ahead(&[&last[..], &last, &stop].concat()), Ahead::Command(id));
        }
        assert_eq!(ahead(&[]), Ahead::Nothing);
        assert_eq!(ahead(&[0; 100]), Ahead::Nothing);
    }

    #[test]
    fn what_is_no_command_has_no_size() {
        assert_eq!(command_size(&[0; 4]), Err(Misbehaviour::UnknownId(0)));
        let mut command = Vec::new();
        CmprHeader { extra_size: 4097, ..CmprHeader::default() }.emit_command(&mut command);
        assert!(matches!(
            command_size(&command),
            Err(Misbehaviour::Packet(Error::TooLarge { announced: 4097, .. }))
        ));
    }

    fn put(inbox: &mut Inbox, bytes: &[u8]) {
        inbox.room()[..bytes.len()].copy_from_slice(bytes);
        inbox.add(bytes.len());
    }

    #[test]
    fn commands_come_out_whole_however_they_arrive() {
        let mut start = Vec::new();
        StartOnline::new().emit(&mut start);
        let query = CommandId::QueryStatus.id().to_le_bytes();
        let sent = [&start[..], &query, &start].concat();
        for size in 1..=sent.len() {
            let (mut inbox, mut commands) = (Inbox::new(), Vec::new());
            for piece in sent.chunks(size) {
                put(&mut inbox, piece);
                while let Some(command) = inbox.command().unwrap().map(<[u8]>::to_vec) {
                    inbox.remove(command.len());
                    commands.push(command);
                }
            }
            assert_eq!(commands, [&start[..], &query, &start]);
            assert!(inbox.bytes().is_empty());
        }
    }

    #[test]
    fn a_full_inbox_has_a_whole_command() {
        let mut longest = Vec::new();
        let header = CmprHeader { extra_size: MAX_EXTRA_SIZE as u32, ..CmprHeader::default() };
        header.emit_command(&mut longest);
        let mut inbox = Inbox::new();
        put(&mut inbox, &longest);
        assert_eq!(inbox.command(), Ok(None));
        inbox.add(MAX_EXTRA_SIZE);
        assert_eq!(inbox.command().unwrap().map(<[u8]>::len), Some(COMMAND_MAX));
        assert_eq!(inbox.room().len(), FAREWELL_MAX);
    }

    #[test]
    fn what_is_no_command_is_told_by_its_first_bytes() {
        let mut inbox = Inbox::new();
        put(&mut inbox, &[0; 3]);
        assert_eq!(inbox.command(), Ok(None));
        put(&mut inbox, &[0]);
        assert_eq!(inbox.command(), Err(Misbehaviour::UnknownId(0)));
    }
}
