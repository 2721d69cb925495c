//! What the program has sent to the main port, by area.

use ft_transfer_area::transfer_area::{Config, OutputValues, TxtOutputs, MAX_AREAS};
use ft_transfer_area::wire::{CmprHeader, CommandId, ExchangeData, Expander, UpdateConfig, ID_LEN};
use ft_transfer_area::FishX1Transfer;

use crate::seen::unknown_area;

/// Words per area in a compressed command.
const WORDS: usize = 27;
/// What the program sends, as of its last command.
#[derive(Default)]
pub(super) struct Outgoing {
    expander: Expander,
    pub(super) areas: Sent,
    pub(super) config_updates: u64,
    /// For which areas a configuration was ignored since the last exchange, one bit each, bit 0 the master.
    pub(super) ignored: u16,
}

/// Configurations and outputs of all areas.
pub(super) type Sent = [SentArea; MAX_AREAS];

#[derive(Clone, Copy)]
pub(super) struct SentArea {
    /// It was configured, or took part in an exchange.
    pub(super) is_used: bool,
    /// Of the configuration that the controller has taken.
    pub(super) config_id: u8,
    pub(super) config: Config,
    pub(super) output: OutputValues,
    pub(super) txt_outputs: TxtOutputs,
}

impl Default for SentArea {
    /// After StartOnline.
    fn default() -> Self {
        let FishX1Transfer { config, output, txt_outputs, .. } = unknown_area();
        Self { is_used: false, config_id: 0, config, output, txt_outputs }
    }
}

impl Outgoing {
    pub(super) fn configure(&mut self, bytes: &[u8]) -> Result<(), String> {
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

    pub(super) fn simple(&mut self, bytes: &[u8]) -> Result<(), String> {
        let data = ExchangeData::parse(bytes).map_err(|error| error.to_string())?;
        self.areas[0].take(&data);
        Ok(())
    }

    pub(super) fn compressed(&mut self, bytes: &[u8]) -> Result<(), String> {
        let (header, data) = bytes.split_at(CmprHeader::LEN);
        let header = CmprHeader::parse_command(header).map_err(|error| error.to_string())?;
        let count = WORDS * (1 + header.active_extensions.count_ones() as usize);
        let words = self.expander.expand(data, count, header.crc);
        let words = words.map_err(|error| error.to_string())?;
        let takes_part =
            |area: &usize| *area == 0 || header.active_extensions & 1 << (area - 1) != 0;
        // Nothing is sent to the others, what they were sent before does not count when they are back.
        for area in (1..MAX_AREAS).filter(|area| !takes_part(area)) {
            let output = &mut self.areas[area].output;
            (*output.duty, *output.distance) = Default::default();
        }
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
