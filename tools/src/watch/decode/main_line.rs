//! The main connection: commands and responses in turn.
//!
//! What is no packet of the kit ends with the bytes that came at once, as for the firmware. A response belongs to the
//! first command that it can answer; those before got none.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::wire::{CommandId, QueryStatusResponse, ResponseId};
use ft_transfer_area::FirmwareVersion;

use super::online::Online;
use super::outgoing::{Outgoing, Sent};
use super::unanswered::{Answered, Unanswered, Waiting};
use super::Reader;
use crate::seen::{Farewell, Happened, Side, UnansweredExchanges, Unknown};
use crate::watch::changes::name;
use crate::watch::packet::{command_size, id, response_size, Inbox};

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
