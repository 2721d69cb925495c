//! The main connection: commands and responses in turn.
//!
//! What is no packet of the kit ends with the bytes that came at once, as for the firmware. A response belongs to the
//! first command that it can answer; those before got none.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{Config, OutputValues, TxtOutputs, MAX_AREAS};
use ft_transfer_area::wire::{
    CmprHeader, CommandId, ExchangeData, Expander, QueryStatusResponse, ResponseId, UpdateConfig,
    ID_LEN,
};
use ft_transfer_area::{Exchange, FirmwareVersion, FishX1Transfer, TransferMode};

use super::unanswered::{Answered, Unanswered, Waiting};
use super::Reader;
use crate::seen::{unknown_area, Cycle, Farewell, Happened, Side, UnansweredExchanges, Unknown};
use crate::watch::changes::name;
use crate::watch::packet::{command_size, id, response_size, Inbox};

/// Words per area in a compressed command.
const WORDS: usize = 27;
/// An exchange that has no answer for so long is shown without it: the controller may have its outputs.
const SHOWN_AFTER: Duration = Duration::from_millis(200);

#[derive(Default)]
pub(super) struct MainReader {
    commands: Inbox,
    responses: Inbox,
    unanswered: Unanswered,
    /// There is something to show of exchanges without an answer, when they are late, and at once.
    has_sent: bool,
    has_forgotten: bool,
    /// How many exchanges are not shown, because too many had no answer.
    forgotten: u64,
    outgoing: Outgoing,
    firmware: Option<FirmwareVersion>,
    online: Option<Online>,
    /// An exchange was not understood, so that those after it can't be, until StartOnline.
    is_unclear: bool,
    /// Whether the program has said farewell since it went online, or drove last.
    farewell: Farewell,
    /// The program has gone, and the relay sends what stops the controller.
    is_gone: bool,
    /// What the program had sent last then.
    left: Option<Box<Sent>>,
    last_response: Option<Instant>,
}

/// What the program sends, as of its last command.
#[derive(Default)]
struct Outgoing {
    expander: Expander,
    areas: Sent,
    config_updates: u64,
    /// For which areas a configuration was ignored since the last exchange, one bit each, bit 0 the master.
    ignored: u16,
}

/// Configurations and outputs of all areas.
pub(super) type Sent = [SentArea; MAX_AREAS];

#[derive(Clone, Copy)]
pub(super) struct SentArea {
    /// It was configured, or took part in an exchange.
    is_used: bool,
    /// Of the configuration that the controller has taken.
    config_id: u8,
    config: Config,
    output: OutputValues,
    txt_outputs: TxtOutputs,
}

impl Default for SentArea {
    /// After StartOnline.
    fn default() -> Self {
        let FishX1Transfer { config, output, txt_outputs, .. } = unknown_area();
        Self { is_used: false, config_id: 0, config, output, txt_outputs }
    }
}

/// What the controller sends, since StartOnline.
struct Online {
    simple: Exchange,
    compressed: Exchange,
    areas: [FishX1Transfer; MAX_AREAS],
    /// The extensions in the last response, bit 0 the first.
    alive: u16,
    cycles: u64,
    last: Option<Instant>,
}

impl Reader for MainReader {
    fn read(
        &mut self,
        side: Side,
        at: Instant,
        bytes: &[u8],
        report: &mut dyn FnMut(Happened),
    ) -> Result<(), String> {
        match side {
            Side::Program => {
                self.commands.add(bytes);
                while let Some(command) = next(&mut self.commands, side, command_size, report) {
                    self.command(at, &command, report);
                }
            }
            Side::Controller => {
                self.responses.add(bytes);
                while let Some(response) = next(&mut self.responses, side, response_size, report) {
                    self.response(at, &response, report);
                }
            }
        }
        Ok(())
    }

    fn look(&mut self, now: Instant, report: &mut dyn FnMut(Happened)) {
        let is_late = |since| now.saturating_duration_since(since) >= SHOWN_AFTER;
        let is_due = self.unanswered.exchanges().is_some_and(|(_, since)| is_late(since));
        if self.has_forgotten || (self.has_sent && is_due) {
            self.show_unanswered(report);
        }
        self.unanswered.look(now, report);
    }

    fn program_gone(&mut self) {
        self.is_gone = true;
        self.left = Some(Box::new(self.outgoing.areas));
    }

    /// A program that sends StopOnline after this has not ended the transfer.
    fn controller_ended(&mut self, report: &mut dyn FnMut(Happened)) {
        self.end(report);
    }

    fn end(&mut self, report: &mut dyn FnMut(Happened)) {
        if self.has_forgotten || self.unanswered.exchanges().is_some() {
            self.show_unanswered(report);
        }
        if self.online.take().is_some() {
            report(Happened::Offline(self.farewell));
        }
    }
}

/// The next whole packet. What is none is reported and left out.
fn next(
    inbox: &mut Inbox,
    side: Side,
    size: fn(&[u8]) -> Result<usize, String>,
    report: &mut dyn FnMut(Happened),
) -> Option<Vec<u8>> {
    match inbox.next(size) {
        Ok(packet) => packet,
        Err(_) => {
            report_unknown(side, &inbox.take(), report);
            None
        }
    }
}

fn report_unknown(side: Side, bytes: &[u8], report: &mut dyn FnMut(Happened)) {
    let unknown = Unknown { side, id: id(bytes).unwrap_or_default(), bytes: bytes.len() };
    report(Happened::Unknown(unknown));
}

impl MainReader {
    fn command(&mut self, at: Instant, bytes: &[u8], report: &mut dyn FnMut(Happened)) {
        // The size is known, so it is one.
        let Some(command) = id(bytes).and_then(CommandId::from_id) else { return };
        self.unanswered.go_on(at);
        let outgoing = &mut self.outgoing;
        let read = match command {
            CommandId::ExchangeData => outgoing.simple(bytes).map(|()| true),
            CommandId::ExchangeDataCmpr => outgoing.compressed(bytes).map(|()| true),
            CommandId::UpdateConfig => outgoing.configure(bytes).map(|()| false),
            CommandId::StartOnline => {
                *outgoing = Outgoing::default();
                Ok(false)
            }
            CommandId::QueryStatus
            | CommandId::StopOnline
            | CommandId::StartCameraOnline
            | CommandId::StopCameraOnline => Ok(false),
        };
        let sent = match read {
            Ok(is_exchange) => is_exchange.then_some(self.outgoing.areas),
            Err(why) => {
                self.not_understood(Side::Program, why, report);
                None
            }
        };
        match command {
            CommandId::ExchangeData | CommandId::ExchangeDataCmpr | CommandId::StartOnline => {
                self.farewell = Farewell::Missing;
            }
            // That of the relay is none.
            CommandId::StopOnline if !self.is_gone => self.farewell = Farewell::Unanswered,
            CommandId::StopOnline
            | CommandId::QueryStatus
            | CommandId::UpdateConfig
            | CommandId::StartCameraOnline
            | CommandId::StopCameraOnline => {}
        }
        if !matches!(command, CommandId::ExchangeData | CommandId::ExchangeDataCmpr) {
            report(Happened::Command(command));
        }
        let answer = self.last_response.map(|before| at.saturating_duration_since(before));
        self.has_sent |= sent.is_some() && !self.is_gone;
        let mut waiting = Waiting::new(command, at);
        (waiting.answer, waiting.sent, waiting.is_relays) = (answer, sent, self.is_gone);
        if self.unanswered.add(waiting) {
            self.forgotten += 1;
            self.has_forgotten = true;
        }
    }

    /// Shows what the program has sent last, with the inputs of the last response.
    fn show_unanswered(&mut self, report: &mut dyn FnMut(Happened)) {
        let Some(online) = self.online.as_mut().filter(|_| !self.is_unclear) else { return };
        (self.has_sent, self.has_forgotten) = (false, false);
        let sent = self.left.as_deref().unwrap_or(&self.outgoing.areas);
        let areas = online.areas_with(sent);
        let exchanges = self.unanswered.exchanges().map_or(0, |(count, _)| count);
        let forgotten = self.forgotten;
        let what = UnansweredExchanges { exchanges, forgotten, areas };
        report(Happened::Unanswered(Box::new(what)));
    }

    fn response(&mut self, at: Instant, bytes: &[u8], report: &mut dyn FnMut(Happened)) {
        let Some(response) = id(bytes).and_then(ResponseId::from_id) else { return };
        let Some(answered) = self.unanswered.take(at, response, report) else {
            return report_unknown(Side::Controller, bytes, report);
        };
        let read = match response {
            ResponseId::QueryStatus => self.status(bytes, report),
            ResponseId::StartOnline => {
                // The checksum decides how many words a response has: this is only tried first.
                let firmware = self.firmware.unwrap_or(FirmwareVersion::WITH_MICROPHONE);
                self.online = Some(Online::new(firmware));
                (self.is_unclear, self.has_forgotten, self.forgotten) = (false, false, 0);
                report(Happened::Online);
                Ok(())
            }
            ResponseId::StopOnline => {
                if !self.is_gone {
                    self.farewell = Farewell::Answered;
                }
                self.end(report);
                Ok(())
            }
            ResponseId::ExchangeData | ResponseId::ExchangeDataCmpr => {
                self.exchange(at, response, bytes, &answered, report)
            }
            ResponseId::UpdateConfig
            | ResponseId::StartCameraOnline
            | ResponseId::StopCameraOnline => Ok(()),
        };
        if let Err(why) = read {
            self.not_understood(Side::Controller, why, report);
        }
        self.last_response = Some(at);
    }

    fn status(&mut self, bytes: &[u8], report: &mut dyn FnMut(Happened)) -> Result<(), String> {
        let status = QueryStatusResponse::parse(bytes).map_err(|error| error.to_string())?;
        self.firmware = Some(status.version);
        report(Happened::Controller { name: status.name(), firmware: status.version });
        Ok(())
    }

    fn exchange(
        &mut self,
        at: Instant,
        response: ResponseId,
        bytes: &[u8],
        answered: &Answered,
        report: &mut dyn FnMut(Happened),
    ) -> Result<(), String> {
        if self.is_unclear {
            return Ok(());
        }
        let waiting = match answered {
            Answered::Known(waiting) => Some(waiting),
            Answered::Forgotten => None,
        };
        // The words of the next response depend on those of this one in any case.
        let sent = waiting.map_or(Some(self.outgoing.areas), |waiting| waiting.sent);
        let Some(sent) = sent else { return Ok(()) };
        let online = self.online.as_mut().ok_or("an exchange came before StartOnline")?;
        let mut cycle = online.exchange(at, response, bytes, &sent)?;
        // The kit's client configures nine areas, however many there are.
        let ignored = std::mem::take(&mut self.outgoing.ignored) & (1 | online.alive << 1);
        for area in (0..MAX_AREAS).filter(|area| ignored >> area & 1 != 0) {
            report(Happened::Ignored { controller: name(area) });
        }
        // Those after it may still be late.
        self.has_sent = true;
        let Some(waiting) = waiting else { return Ok(()) };
        cycle.answer = waiting.answer.filter(|_| cycle.number > 1);
        cycle.config_updates = self.outgoing.config_updates;
        report(Happened::Cycle(Box::new(cycle)));
        Ok(())
    }

    /// From here on, exchanges can't be understood.
    fn not_understood(&mut self, side: Side, why: String, report: &mut dyn FnMut(Happened)) {
        if !std::mem::replace(&mut self.is_unclear, true) {
            report(Happened::NotUnderstood { side, why });
            self.end(report);
        }
    }
}

impl Outgoing {
    fn configure(&mut self, bytes: &[u8]) -> Result<(), String> {
        let update = UpdateConfig::parse(bytes).map_err(|error| error.to_string())?;
        self.config_updates += 1;
        let index = usize::try_from(update.extension_id).ok();
        if let Some(area) = index.and_then(|index| self.areas.get_mut(index)) {
            area.is_used = true;
            // Only these bits count, for the controller as in a transfer area.
            let config_id = update.config_id as u8;
            if config_id != area.config_id {
                (area.config_id, area.config) = (config_id, update.config);
            } else if update.config != area.config {
                self.ignored |= 1 << update.extension_id;
            }
        }
        Ok(())
    }

    fn simple(&mut self, bytes: &[u8]) -> Result<(), String> {
        let data = ExchangeData::parse(bytes).map_err(|error| error.to_string())?;
        self.areas[0].take(&data);
        Ok(())
    }

    fn compressed(&mut self, bytes: &[u8]) -> Result<(), String> {
        let (header, data) = bytes.split_at(CmprHeader::LEN);
        let header = CmprHeader::parse_command(header).map_err(|error| error.to_string())?;
        let count = WORDS * (1 + header.active_extensions.count_ones() as usize);
        let words = self.expander.expand(data, count, header.crc);
        let words = words.map_err(|error| error.to_string())?;
        let takes_part =
            |area: &usize| *area == 0 || header.active_extensions & 1 << (area - 1) != 0;
        let indices = (0..=u16::BITS as usize).filter(takes_part);
        for (words, index) in words.chunks_exact(WORDS).zip(indices) {
            // The mask has bits for more extensions than there can be areas.
            if let Some(area) = self.areas.get_mut(index) {
                area.take(&outputs(words)?);
            }
        }
        Ok(())
    }
}

/// The outputs of one area in its words of a compressed command, which are those of the simple one.
fn outputs(words: &[u16]) -> Result<ExchangeData, String> {
    let mut packet = Vec::with_capacity(ExchangeData::LEN);
    CommandId::ExchangeData.emit(&mut packet);
    words.iter().for_each(|word| packet.extend_from_slice(&word.to_le_bytes()));
    packet.resize(ExchangeData::LEN, 0);
    ExchangeData::parse(&packet).map_err(|error| error.to_string())
}

const _: () = assert!(ID_LEN + 2 * WORDS <= ExchangeData::LEN);

impl SentArea {
    fn take(&mut self, data: &ExchangeData) {
        self.is_used = true;
        *self.output.duty = data.duty;
        // Other numbers mean nothing to a controller.
        *self.output.master = data.master.map(|master| u8::try_from(master).unwrap_or_default());
        *self.output.distance = data.distance;
        *self.output.motor_ex_cmd_id = data.motor_command_id;
        *self.output.cnt_reset_cmd_id = data.counter_reset_id;
        self.txt_outputs.sound_cmd_id = data.sound_command_id;
        self.txt_outputs.sound_index = data.sound_index;
        self.txt_outputs.sound_repeat = data.sound_repeat;
    }
}

impl Online {
    fn new(firmware: FirmwareVersion) -> Self {
        Self {
            simple: Exchange::new(TransferMode::Simple, firmware),
            compressed: Exchange::new(TransferMode::Compressed, firmware),
            areas: [FishX1Transfer::default(); MAX_AREAS],
            alive: 0,
            cycles: 0,
            last: None,
        }
    }

    fn exchange(
        &mut self,
        at: Instant,
        response: ResponseId,
        bytes: &[u8],
        sent: &Sent,
    ) -> Result<Cycle, String> {
        // No other response than these two is an exchange's.
        let is_simple = response == ResponseId::ExchangeData;
        let exchange = if is_simple { &mut self.simple } else { &mut self.compressed };
        let inputs = exchange.receive(bytes).map_err(|error| error.to_string())?;
        inputs.apply(&mut self.areas);
        for area in &mut self.areas {
            // These belong to a program.
            area.input.cnt_resetted = Default::default();
            area.input.motor_ex_reached = Default::default();
        }
        self.cycles += 1;
        let last = self.last.replace(at);
        self.alive = inputs.alive();
        Ok(Cycle {
            number: self.cycles,
            since_last: last.map(|last| at.saturating_duration_since(last)),
            answer: None,
            config_updates: 0,
            areas: self.areas_with(sent),
        })
    }

    /// What was sent, with the inputs of the last response.
    fn areas_with(&mut self, sent: &Sent) -> Vec<FishX1Transfer> {
        for (area, sent) in self.areas.iter_mut().zip(sent) {
            area.state.config_id = sent.config_id;
            area.config = sent.config;
            area.output = sent.output;
            area.txt_outputs = sent.txt_outputs;
        }
        let takes_part = |area: &usize| {
            let is_alive = |bit| self.alive >> bit & 1 != 0;
            sent[*area].is_used || area.checked_sub(1).is_some_and(is_alive)
        };
        let count = (1..MAX_AREAS).rev().find(takes_part).map_or(1, |last| last + 1);
        self.areas[..count].to_vec()
    }
}
