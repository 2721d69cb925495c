//! Where the packets of the main connection end.

use ft_transfer_area::wire::{CommandId, ResponseId, ID_LEN};

/// The bytes of one side that make no whole packet yet.
#[derive(Default)]
pub(super) struct Inbox {
    bytes: Vec<u8>,
    /// How many of them were taken out. They are removed together: one by one, small packets would take a time that
    /// grows with the square of their number.
    taken: usize,
}

impl Inbox {
    pub(super) fn add(&mut self, bytes: &[u8]) {
        self.bytes.drain(..std::mem::take(&mut self.taken));
        self.bytes.extend_from_slice(bytes);
    }

    /// Takes out the first packet when it is whole. `size` returns its length, as far as its start shows it: with
    /// that many bytes the result may be larger.
    pub(super) fn next(
        &mut self,
        size: impl Fn(&[u8]) -> Result<usize, String>,
    ) -> Result<Option<Vec<u8>>, String> {
        let rest = &self.bytes[self.taken..];
        let needed = size(rest)?;
        if rest.len() < needed || needed == 0 {
            return Ok(None);
        }
        let packet = rest[..needed].to_vec();
        self.taken += needed;
        Ok(Some(packet))
    }

    /// Takes out all.
    pub(super) fn take(&mut self) -> Vec<u8> {
        self.bytes.drain(..std::mem::take(&mut self.taken));
        std::mem::take(&mut self.bytes)
    }
}

/// The id at the start, if it is there.
pub(super) fn id(bytes: &[u8]) -> Option<u32> {
    bytes.first_chunk().map(|bytes: &[u8; ID_LEN]| u32::from_le_bytes(*bytes))
}

/// The size of the command that these bytes begin.
pub(super) fn command_size(start: &[u8]) -> Result<usize, String> {
    let Some(id) = id(start) else { return Ok(ID_LEN) };
    let command =
        CommandId::from_id(id).ok_or_else(|| format!("no command has the id {id:#010x}"))?;
    command.size(start).map_err(|error| error.to_string())
}

/// The size of the response that these bytes begin.
pub(super) fn response_size(start: &[u8]) -> Result<usize, String> {
    let Some(id) = id(start) else { return Ok(ID_LEN) };
    let response =
        ResponseId::from_id(id).ok_or_else(|| format!("no response has the id {id:#010x}"))?;
    response.size(start).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::wire::CmprHeader;

    use super::*;

    #[test]
    fn packets_come_out_whole_however_they_arrive() {
        let mut exchange = Vec::new();
        CmprHeader { extra_size: 2, ..CmprHeader::default() }.emit_command(&mut exchange);
        exchange.extend([0; 2]);
        let query = CommandId::QueryStatus.id().to_le_bytes();
        let sent = [&query[..], &exchange, &query].concat();
        for size in 1..=sent.len() {
            let (mut inbox, mut packets) = (Inbox::default(), Vec::new());
            for piece in sent.chunks(size) {
                inbox.add(piece);
                while let Some(packet) = inbox.next(command_size).unwrap() {
                    packets.push(packet);
                }
            }
            assert_eq!(packets, [&query[..], &exchange, &query]);
        }
    }

    /// In a time that grows with the square of their number, it would be half a minute.
    #[test]
    fn a_million_small_packets_at_once_take_a_moment() {
        let mut inbox = Inbox::default();
        inbox.add(&CommandId::QueryStatus.id().to_le_bytes().repeat(1 << 20));
        let packets = std::iter::from_fn(|| inbox.next(command_size).unwrap());
        assert_eq!(packets.count(), 1 << 20);
    }

    #[test]
    fn what_is_no_packet_is_an_error_that_says_what_came() {
        assert!(command_size(&[1, 0, 0, 0]).unwrap_err().contains("0x00000001"));
        assert!(response_size(&[1, 0, 0, 0]).is_err());
        let mut long = Vec::new();
        CmprHeader { extra_size: 4097, ..CmprHeader::default() }.emit_response(&mut long);
        assert!(response_size(&long).unwrap_err().contains("4097"));
    }
}
