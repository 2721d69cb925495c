//! The bytes of a client that have been read and not been carried out.

use crate::command::{command_size, Misbehaviour};
use ft_transfer_area::wire::{CmprHeader, ID_LEN, MAX_EXTRA_SIZE};

/// The longest command.
const COMMAND_MAX: usize = CmprHeader::LEN + MAX_EXTRA_SIZE;

/// The longest farewell, see [`ahead`](super::command::ahead).
const FAREWELL_MAX: usize = COMMAND_MAX + ID_LEN;

/// The bytes of a client that have been read and not been carried out.
pub(super) struct Inbox {
    /// There is room for a command and a farewell after it.
    bytes: Vec<u8>,
    /// How many of them there are.
    count: usize,
}

impl Inbox {
    pub(super) fn new() -> Self {
        Self { bytes: vec![0; COMMAND_MAX + FAREWELL_MAX], count: 0 }
    }

    /// Where the next bytes go. It is empty only when there is a whole command.
    pub(super) fn room(&mut self) -> &mut [u8] {
        &mut self.bytes[self.count..]
    }

    /// This many bytes have been put into the room.
    pub(super) fn add(&mut self, count: usize) {
        self.count += count;
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.count]
    }

    /// The first command, when it is whole.
    pub(super) fn command(&self) -> Result<Option<&[u8]>, Misbehaviour> {
        let bytes = self.bytes();
        Ok(bytes.get(..command_size(bytes)?))
    }

    /// Removes as many bytes as the first command has.
    pub(super) fn remove(&mut self, size: usize) {
        self.bytes.copy_within(size..self.count, 0);
        self.count -= size;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ft_transfer_area::wire::{CommandId, StartOnline};

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
