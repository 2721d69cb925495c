//! Where the packets of the main connection end.

use ft_transfer_area::wire::{CommandId, ResponseId, ID_LEN};

/// The bytes of one side that make no whole packet yet.
#[derive(Default)]
pub(super) struct Inbox(Vec<u8>);

impl Inbox {
    pub(super) fn add(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Takes out the first packet when it is whole. `size` tells how long it is, as far as its start shows it: with
    /// that many bytes the result may be larger.
    pub(super) fn next(
        &mut self,
        size: impl Fn(&[u8]) -> Result<usize, String>,
    ) -> Result<Option<Vec<u8>>, String> {
        let needed = size(&self.0)?;
        if self.0.len() < needed || needed == 0 {
            return Ok(None);
        }
        let rest = self.0.split_off(needed);
        Ok(Some(std::mem::replace(&mut self.0, rest)))
    }

    /// Takes out all.
    pub(super) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.0)
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

    #[test]
    fn what_is_no_packet_is_an_error_that_says_what_came() {
        assert!(command_size(&[1, 0, 0, 0]).unwrap_err().contains("0x00000001"));
        assert!(response_size(&[1, 0, 0, 0]).is_err());
        let mut long = Vec::new();
        CmprHeader { extra_size: 4097, ..CmprHeader::default() }.emit_response(&mut long);
        assert!(response_size(&long).unwrap_err().contains("4097"));
    }
}
