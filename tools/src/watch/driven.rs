//! What the relay itself knows of a main connection: whether a program drives through it, and what stops that.
//!
//! Those who look may be too slow, so the relay can't ask them. It looks only at where packets begin, and at their
//! heads; what it does not know it takes for driving.

use std::collections::VecDeque;
use std::time::Instant;

use ft_transfer_area::wire::{
    crc_of_words, CmprHeader, CommandId, ExchangeData, QueryStatusResponse, ResponseId,
};

use super::packet::{command_size, id, response_size};
use crate::seen::SILENCE;

/// As much of a packet as shows its size and what matters here.
const HEAD: usize = QueryStatusResponse::LEN;
/// How many commands without a response are known.
const WAITING: usize = 64;
/// How many of them a command that follows may have before it: the controller takes 10 ms for each. A client that waits
/// for its responses has one.
const FEW: usize = 8;
/// Words per area in a compressed command.
const WORDS: usize = 27;
/// A word in a compressed command that says its value, 0: two bits for this, and 16 for the value.
const WORD_BITS: usize = 18;
const WORD_CODE_BITS: usize = 2;

/// What passes on a main connection.
pub(super) struct Driven {
    commands: Packets,
    responses: Responses,
    /// A program is online, or has exchanged without being so.
    drives: bool,
    /// It has sent StopOnline after that, and the controller has not answered yet.
    leaves: bool,
    /// The extensions of all compressed exchanges; `None` before the first.
    extensions: Option<u16>,
    /// The controller has said something. It serves one program, and says nothing to others.
    is_served: bool,
    /// When the controller has last answered an exchange.
    exchanged: Option<Instant>,
    /// When one side has last said something.
    heard: Instant,
}

/// Knows which commands have no response yet.
#[derive(Default)]
pub(super) struct Responses {
    packets: Packets,
    /// The last of them.
    missing: VecDeque<CommandId>,
    /// There were more, so that a response may be one to a command that is not known any more.
    has_lost_count: bool,
    /// The controller's name, if it was asked for.
    name: Option<String>,
}

/// Where the packets of one side end.
#[derive(Default)]
struct Packets {
    head: [u8; HEAD],
    /// How much of the present packet has come.
    come: usize,
}

impl Driven {
    pub(super) fn new() -> Self {
        Self {
            commands: Packets::default(),
            responses: Responses::default(),
            drives: false,
            leaves: false,
            extensions: None,
            is_served: false,
            exchanged: None,
            heard: Instant::now(),
        }
    }

    /// Takes in what the program has sent.
    pub(super) fn sent(&mut self, at: Instant, bytes: &[u8]) {
        self.heard = at;
        let Self { commands, responses, drives, leaves, extensions, .. } = self;
        commands.take(bytes, command_size, |head| {
            responses.expect(head);
            match id(head).and_then(CommandId::from_id) {
                Some(CommandId::StartOnline) => {
                    (*drives, *leaves, *extensions) = (true, false, None);
                }
                Some(CommandId::StopOnline) => {
                    *leaves |= std::mem::take(drives);
                }
                Some(CommandId::ExchangeData) => *drives = true,
                Some(CommandId::ExchangeDataCmpr) => {
                    *drives = true;
                    let header = &head[..head.len().min(CmprHeader::LEN)];
                    let mask =
                        CmprHeader::parse_command(header).map_or(0, |it| it.active_extensions);
                    *extensions = Some(extensions.unwrap_or(0) | mask);
                }
                _ => {}
            }
        });
    }

    /// Takes in what the controller has sent.
    pub(super) fn received(&mut self, at: Instant, bytes: &[u8]) {
        self.heard = at;
        self.is_served = true;
        if self.responses.take(bytes) {
            self.exchanged = Some(at);
        }
        self.leaves &= self.responses.awaits(CommandId::StopOnline);
    }

    /// Whether the controller has said anything to this program.
    pub(super) fn is_served(&self) -> bool {
        self.is_served
    }

    /// When the controller has last answered an exchange: its outputs are those of this program since then.
    pub(super) fn exchanged(&self) -> Option<Instant> {
        self.exchanged
    }

    /// Whether outputs may be on for which only the program knows.
    pub(super) fn drives(&self) -> bool {
        self.drives
    }

    /// Whether that is so when the connection ends: a StopOnline without a response may not have reached the controller.
    pub(super) fn has_left_on(&self) -> bool {
        self.drives || self.leaves
    }

    /// When both sides will have been silent for too long. A program that waits until the controller has served another one
    /// is not, while a response can come.
    pub(super) fn silent_at(&self, can_come: bool) -> Option<Instant> {
        let waits = can_come && !self.is_served && !self.responses.are_all_here();
        (self.drives && !waits).then(|| self.heard + SILENCE)
    }

    /// Whether a whole command was the last: one that follows is understood.
    pub(super) fn is_between_commands(&self) -> bool {
        self.commands.come == 0
    }

    /// Whether a command that follows has its turn soon, and its response is known from those before.
    pub(super) fn has_few_waiting(&self) -> bool {
        !self.responses.has_lost_count && self.responses.missing.len() <= FEW
    }

    /// The command that switches all outputs off, in the words that need no knowledge of those before.
    pub(super) fn zeros(&self) -> Vec<u8> {
        let mut packet = Vec::new();
        let Some(active_extensions) = self.extensions else {
            ExchangeData::default().emit(&mut packet);
            return packet;
        };
        let count = WORDS * (1 + active_extensions.count_ones() as usize);
        let mut data = vec![0; (WORD_BITS * count).div_ceil(8)];
        for bit in (0..WORD_BITS * count).filter(|bit| bit % WORD_BITS < WORD_CODE_BITS) {
            data[bit / 8] |= 1 << (bit % 8);
        }
        let crc = crc_of_words(&vec![0; count]);
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions }.emit_command(&mut packet);
        packet.append(&mut data);
        packet
    }

    /// The name of the controller, if the program has asked for it.
    pub(super) fn name(&self) -> Option<&str> {
        self.responses.name()
    }

    /// What the controller still has to say.
    pub(super) fn into_responses(self) -> Responses {
        self.responses
    }
}

impl Responses {
    /// The command was sent that begins like this.
    pub(super) fn expect(&mut self, head: &[u8]) {
        let Some(command) = id(head).and_then(CommandId::from_id) else { return };
        if self.missing.len() == WAITING {
            self.missing.pop_front();
            self.has_lost_count = true;
        }
        self.missing.push_back(command);
    }

    /// A response is that to the first command which it can answer. Those before it get none. Returns whether an
    /// exchange was answered.
    pub(super) fn take(&mut self, bytes: &[u8]) -> bool {
        let Self { missing, name, .. } = self;
        let mut has_exchanged = false;
        self.packets.take(bytes, response_size, |head| {
            let response = id(head).and_then(ResponseId::from_id);
            let place = missing.iter().position(|one| Some(one.response()) == response);
            let answered = place.and_then(|place| missing.drain(..=place).next_back());
            if answered == Some(CommandId::QueryStatus) {
                *name = QueryStatusResponse::parse(head).ok().map(|status| status.name());
            }
            has_exchanged |=
                matches!(answered, Some(CommandId::ExchangeData | CommandId::ExchangeDataCmpr));
        });
        has_exchanged
    }

    /// Whether such a command has no response yet.
    fn awaits(&self, command: CommandId) -> bool {
        self.missing.contains(&command)
    }

    /// The name of the controller, if it has said that.
    pub(super) fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Whether each command has its response.
    pub(super) fn are_all_here(&self) -> bool {
        self.missing.is_empty()
    }
}

impl Packets {
    /// Hands on the head of each packet that is whole now. After something unknown, a packet begins with the next
    /// bytes: a controller wants each in one piece.
    fn take(
        &mut self,
        mut bytes: &[u8],
        size: impl Fn(&[u8]) -> Result<usize, String>,
        mut whole: impl FnMut(&[u8]),
    ) {
        loop {
            let Ok(needed) = size(&self.head[..self.come.min(HEAD)]) else {
                self.come = 0;
                return;
            };
            if self.come == needed {
                whole(&self.head[..needed.min(HEAD)]);
                self.come = 0;
                continue;
            }
            if bytes.is_empty() {
                return;
            }
            // The size is known only with the head.
            let wanted = if self.come < HEAD { needed.min(HEAD) } else { needed };
            let (now, later) = bytes.split_at(bytes.len().min(wanted - self.come));
            if let Some(place) = self.head.get_mut(self.come..self.come + now.len()) {
                place.copy_from_slice(now);
            }
            self.come += now.len();
            bytes = later;
        }
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::transfer_area::Config;
    use ft_transfer_area::wire::{Compressor, Expander, StartOnline, UpdateConfig};

    use super::*;

    fn packet(command: CommandId) -> Vec<u8> {
        let mut out = Vec::new();
        match command {
            CommandId::StartOnline => StartOnline::new().emit(&mut out),
            CommandId::ExchangeData => ExchangeData::default().emit(&mut out),
            CommandId::UpdateConfig => {
                UpdateConfig { config_id: 1, extension_id: 0, config: Config::default() }
                    .emit(&mut out);
            }
            _ => command.emit(&mut out),
        }
        out
    }

    fn compressed(active_extensions: u16) -> Vec<u8> {
        let (mut data, mut out) = (Vec::new(), Vec::new());
        let words = vec![3; WORDS * (1 + active_extensions.count_ones() as usize)];
        let crc = Compressor::new().compress(&words, &mut data);
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions }.emit_command(&mut out);
        [out, data].concat()
    }

    /// After these bytes, in pieces of every size.
    fn after(bytes: &[u8], check: impl Fn(&Driven)) {
        for size in 1..=bytes.len() {
            let mut driven = Driven::new();
            bytes.chunks(size).for_each(|piece| driven.sent(Instant::now(), piece));
            check(&driven);
        }
    }

    #[test]
    fn a_program_drives_from_start_online_or_an_exchange_until_stop_online() {
        let start = packet(CommandId::StartOnline);
        let query = packet(CommandId::QueryStatus);
        let config = packet(CommandId::UpdateConfig);
        let stop = packet(CommandId::StopOnline);
        for (sent, drives) in [
            (vec![&query, &config], false),
            (vec![&query, &start], true),
            (vec![&start, &config], true),
            (vec![&start, &compressed(0), &compressed(0)], true),
            (vec![&start, &compressed(1), &stop], false),
            (vec![&start, &stop, &query], false),
            (vec![&packet(CommandId::ExchangeData)], true),
            (vec![&start, &stop, &compressed(0)], true),
        ] {
            let bytes = sent.into_iter().flatten().copied().collect::<Vec<_>>();
            after(&bytes, |driven| {
                assert_eq!((driven.drives(), driven.is_between_commands()), (drives, true));
            });
        }
    }

    #[test]
    fn a_farewell_counts_with_its_answer() {
        let (at, stop) = (Instant::now(), packet(CommandId::StopOnline));
        let mut driven = Driven::new();
        driven.sent(at, &stop);
        assert!(!driven.has_left_on(), "it has driven nothing");
        driven.received(at, &ResponseId::StopOnline.id().to_le_bytes());
        driven.sent(at, &packet(CommandId::StartOnline));
        driven.sent(at, &stop);
        driven.received(at, &ResponseId::StartOnline.id().to_le_bytes());
        assert_eq!((driven.drives(), driven.has_left_on()), (false, true));
        driven.received(at, &ResponseId::StopOnline.id().to_le_bytes());
        assert!(!driven.has_left_on());
    }

    #[test]
    fn a_command_that_is_not_whole_is_noticed() {
        let sent = [packet(CommandId::StartOnline), compressed(0)].concat();
        after(&sent[..sent.len() - 1], |driven| assert!(!driven.is_between_commands()));
    }

    #[test]
    fn what_is_unknown_ends_with_its_piece() {
        let mut driven = Driven::new();
        let at = Instant::now();
        driven.sent(at, &[1, 2, 3, 4, 5]);
        driven.received(at, &[9; 20]);
        driven.sent(at, &packet(CommandId::StartOnline));
        assert!(driven.drives() && driven.is_between_commands());
        driven.received(at, &ResponseId::StartOnline.id().to_le_bytes());
        assert!(driven.silent_at(true).is_some());
    }

    #[test]
    fn a_program_that_waits_for_its_first_response_is_not_silent() {
        let mut driven = Driven::new();
        let at = Instant::now();
        assert_eq!(driven.silent_at(true), None);
        driven.sent(at, &packet(CommandId::StartOnline));
        assert_eq!(driven.silent_at(true), None);
        assert_eq!(driven.silent_at(false), Some(at + SILENCE));
        driven.received(at, &ResponseId::StartOnline.id().to_le_bytes());
        assert_eq!(driven.silent_at(true), Some(at + SILENCE));
        // The controller closes the connection a moment later, whether its response is lost or not.
        driven.sent(at, &packet(CommandId::ExchangeData));
        assert_eq!(driven.silent_at(true), Some(at + SILENCE));
        driven.sent(at, &packet(CommandId::StopOnline));
        driven.received(at, &ResponseId::StopOnline.id().to_le_bytes());
        assert_eq!(driven.silent_at(true), None);
    }

    #[test]
    fn a_response_that_never_came_is_not_waited_for_when_the_next_one_has_come() {
        let mut driven = Driven::new();
        let at = Instant::now();
        for command in [CommandId::StartOnline, CommandId::ExchangeData, CommandId::QueryStatus] {
            driven.sent(at, &packet(command));
        }
        assert!(!driven.is_served());
        driven.received(at, &ResponseId::StartOnline.id().to_le_bytes());
        assert!(!driven.responses.are_all_here());
        driven.received(at, &[&ResponseId::QueryStatus.id().to_le_bytes()[..], &[0; 20]].concat());
        assert!(driven.responses.are_all_here());
        assert!(driven.is_served());
    }

    #[test]
    fn commands_that_wait_are_noticed_also_when_there_are_too_many() {
        let (exchange, at) = (packet(CommandId::ExchangeData), Instant::now());
        let response = &ResponseId::ExchangeData.id().to_le_bytes()[..];
        let response = [response, &[0; 76]].concat();
        for (sent, answered, has_few) in
            [(FEW, 0, true), (FEW + 1, 0, false), (WAITING, WAITING, true), (99, 99, false)]
        {
            let mut driven = Driven::new();
            (0..sent).for_each(|_| driven.sent(at, &exchange));
            (0..answered).for_each(|_| driven.received(at, &response));
            assert_eq!(driven.has_few_waiting(), has_few, "{sent} {answered}");
        }
    }

    #[test]
    fn zeros_are_understood_after_any_words() {
        let mut driven = Driven::new();
        assert_eq!(driven.zeros(), packet(CommandId::ExchangeData));
        for mask in [0, 1, 0b100] {
            driven.sent(Instant::now(), &compressed(mask));
        }
        let packet = driven.zeros();
        let (header, data) = packet.split_at(CmprHeader::LEN);
        let header = CmprHeader::parse_command(header).unwrap();
        assert_eq!((header.active_extensions, header.extra_size as usize), (0b101, data.len()));
        let (mut expander, mut before) = (Expander::new(), Vec::new());
        let words: Vec<u16> = (0..81).map(|word| word % 3).collect();
        let crc = Compressor::new().compress(&words, &mut before);
        assert_eq!(expander.expand(&before, 81, crc), Ok(&words[..]));
        assert_eq!(expander.expand(data, 81, header.crc), Ok(&[0; 81][..]));
    }
}
