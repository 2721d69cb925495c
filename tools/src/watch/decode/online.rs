//! What the controller has sent from the main port, by area.

use std::time::Instant;

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::wire::ResponseId;
use ft_transfer_area::{Exchange, FirmwareVersion, FishX1Transfer, TransferMode};

use super::outgoing::Sent;
use crate::seen::Cycle;

/// What the controller sends, since StartOnline.
pub(super) struct Online {
    simple: Exchange,
    compressed: Exchange,
    areas: [FishX1Transfer; MAX_AREAS],
    /// The extensions in the last response, bit 0 the first.
    pub(super) alive: u16,
    cycles: u64,
    last: Option<Instant>,
}

impl Online {
    pub(super) fn new(firmware: FirmwareVersion) -> Self {
        Self {
            simple: Exchange::new(TransferMode::Simple, firmware),
            compressed: Exchange::new(TransferMode::Compressed, firmware),
            areas: [FishX1Transfer::default(); MAX_AREAS],
            alive: 0,
            cycles: 0,
            last: None,
        }
    }

    pub(super) fn exchange(
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
    pub(super) fn areas_with(&mut self, sent: &Sent) -> Vec<FishX1Transfer> {
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
