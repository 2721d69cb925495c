//! One exchange without I/O: from areas to request bytes, and from response bytes to inputs.

mod commands;
mod inputs;
mod outgoing;
mod outputs;

use commands::Commands;
use inputs::RESPONSES;
use outputs::Outputs;

pub use inputs::Inputs;
pub(crate) use outgoing::{Outgoing, Sends};

use crate::error::Error;
use crate::firmware::FirmwareVersion;
use crate::transfer_area::{FishX1Transfer, MAX_AREAS};
use crate::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, Expander, UpdateConfig,
};

/// How outputs and inputs are sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum TransferMode {
    /// ExchangeDataCmpr: the master and up to 8 extensions, compressed. The kit's default.
    #[default]
    #[doc(alias = "DoTransferCompressed")]
    Compressed,
    /// ExchangeData: the master only, not compressed. Microphone values are not sent. Extensions
    /// are configured, but their outputs and inputs are not sent.
    #[doc(alias = "DoTransferSimple")]
    Simple,
}

/// The most compressed bytes of a request: 18 bits for each word.
const MAX_REQUEST_DATA: usize = (MAX_AREAS * ExchangeData::WORDS * 18).div_ceil(8);
/// The configuration last sent for each area, if there was one.
pub(crate) type SentConfigs = [Option<UpdateConfig>; MAX_AREAS];

/// The exchange of one transfer, from StartOnline on, without any I/O.
///
/// It makes the requests from transfer areas and takes in the responses; the caller sends and receives
/// the bytes. [`TxtClient::do_transfer`](crate::TxtClient::do_transfer) and
/// [`TransferAreaComHandler`](crate::TransferAreaComHandler) are built on it. Begin with a new
/// `Exchange` after each StartOnline, because StartOnline resets the compression on the controller.
///
/// ```
/// use ft_transfer_area::prelude::*;
/// use ft_transfer_area::{Exchange, FirmwareVersion, TransferMode};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let mut areas = [FishX1Transfer::default()];
/// let mut exchange = Exchange::new(TransferMode::Compressed, FirmwareVersion::new(4, 6, 6));
/// areas[LOCAL_IO].output.duty[O1] = 512;
///
/// let mut request = Vec::new();
/// exchange.request(&areas, &mut request)?;
/// assert_eq!(request.len(), 21); // 16 bytes, then a word and 26 unchanged ones
///
/// // A wrong response changes nothing.
/// assert!(exchange.receive(b"nonsense").is_err());
/// exchange.inputs().apply(&mut areas);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Exchange {
    mode: TransferMode,
    /// How many words per area a response has; the response does not say it. At first by the
    /// firmware's version, then by the checksum of the first response.
    word_count: usize,
    /// Whether a response has shown it.
    word_count_is_known: bool,
    compressor: Compressor,
    expander: Expander,
    /// The configuration last sent for each area.
    sent_configs: SentConfigs,
    outputs: Outputs,
    commands: Commands,
    inputs: Inputs,
    /// Buffers that are kept, so that a cycle allocates nothing.
    words: Vec<u16>,
    data: Vec<u8>,
}

impl Exchange {
    /// An exchange in the state after StartOnline.
    #[doc(alias = "SetTransferMode")]
    pub fn new(mode: TransferMode, firmware: FirmwareVersion) -> Self {
        Self {
            mode,
            word_count: firmware.response_words(),
            word_count_is_known: false,
            compressor: Compressor::new(),
            expander: Expander::new(),
            sent_configs: [None; MAX_AREAS],
            outputs: Outputs::default(),
            commands: Commands::default(),
            inputs: Inputs::default(),
            words: Vec::with_capacity(MAX_AREAS * ExchangeData::WORDS),
            data: Vec::with_capacity(MAX_REQUEST_DATA),
        }
    }

    /// The next UpdateConfig command to send; it then counts as sent.
    ///
    /// One is due for each area before the first exchange, and later for each area whose
    /// [`config_id`](crate::transfer_area::State::config_id) differs from the last id sent. Call this
    /// before each exchange until it returns `None`.
    #[doc(alias = "UpdateConfig")]
    pub fn next_update_config(&mut self, areas: &[FishX1Transfer]) -> Option<UpdateConfig> {
        self.next_config(areas, || true)
    }

    /// [`next_update_config`](Self::next_update_config) of what is sent for areas; `None` also when it must not be sent
    /// any more, which is asked only if there is one.
    pub(crate) fn next_config(
        &mut self,
        areas: &[impl Sends],
        may_be_sent: impl Fn() -> bool,
    ) -> Option<UpdateConfig> {
        let config_id = |area: &_| i16::from(Sends::config_id(area));
        let mut areas = areas.iter().zip(&mut self.sent_configs).enumerate();
        let (index, (area, sent)) = areas
            .find(|(_, (area, sent))| sent.map(|sent| sent.config_id) != Some(config_id(*area)))
            .filter(|_| may_be_sent())?;
        *sent = Some(UpdateConfig {
            config_id: config_id(area),
            // Less than MAX_AREAS, the length of `sent_configs`.
            extension_id: index as i16,
            config: *area.config(),
        });
        *sent
    }

    /// The configuration last sent for each area.
    pub(crate) fn sent_configs(&self) -> &SentConfigs {
        &self.sent_configs
    }

    /// Replaces the content of `out` by the request with the areas' outputs.
    ///
    /// In the compressed mode it includes the extensions that took part in the last response, if there
    /// are areas for them. The firmware can distinguish only seven commands of a motor or
    /// counter that are not done, so an eighth goes out with another id first, and with its own in the next request.
    /// A duty outside 0..=512 goes out as 0 or 512, with a warning in the log if it was in range before.
    ///
    /// # Errors
    ///
    /// [`Error::AreaCount`] when there are no areas or more than 9.
    pub fn request(&mut self, areas: &[FishX1Transfer], out: &mut Vec<u8>) -> Result<(), Error> {
        self.request_of(areas, out)
    }

    /// [`request`](Self::request) of what is sent for areas.
    pub(crate) fn request_of(
        &mut self,
        areas: &[impl Sends],
        out: &mut Vec<u8>,
    ) -> Result<(), Error> {
        check_area_count(areas.len())?;
        out.clear();
        match self.mode {
            TransferMode::Simple => self.sent(0, &areas[0]).emit(out),
            TransferMode::Compressed => self.compressed_request(areas, out),
        }
        Ok(())
    }

    /// The command that [`request`](Self::request) makes.
    pub(crate) fn command(&self) -> CommandId {
        match self.mode {
            TransferMode::Compressed => CommandId::ExchangeDataCmpr,
            TransferMode::Simple => CommandId::ExchangeData,
        }
    }

    /// From now on, requests end the sounds that may play: to be called before the last request, because the maker's
    /// firmware 4.7.0 (measured under emulation) plays them on after StopOnline.
    pub fn end_sounds(&mut self) {
        self.commands.end_sounds();
    }

    /// Which controller warnings name.
    pub(crate) fn name_peer(&mut self, peer: String) {
        self.outputs.peer = Some(peer);
    }

    /// Whether the inputs tell which commands are silence, so that [`Inputs::finish_silence`] can report them as done.
    pub(crate) fn tell_silence(&mut self, tells: bool) {
        self.commands.tell_silence(tells);
    }

    /// What is sent for the area with this index (0 the master).
    fn sent(&mut self, index: usize, area: &impl Sends) -> ExchangeData {
        let mut outputs = self.outputs.of(index, area);
        self.commands.send(index, &mut outputs);
        outputs
    }

    fn compressed_request(&mut self, areas: &[impl Sends], out: &mut Vec<u8>) {
        let extensions = areas.len() - 1;
        let active_extensions = self.inputs.alive() & ((1 << extensions) - 1);
        self.words.clear();
        // The master takes part in every exchange; extension i has bit i - 1.
        let active = 1 | u32::from(active_extensions) << 1;
        for (index, area) in areas.iter().enumerate() {
            if active & 1 << index != 0 {
                let sent = self.sent(index, area);
                self.words.extend_from_slice(&sent.words());
            }
        }
        self.data.clear();
        let crc = self.compressor.compress(&self.words, &mut self.data);
        // At most MAX_REQUEST_DATA.
        let extra_size = self.data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions }.emit_command(out);
        out.extend_from_slice(&self.data);
    }

    /// Takes in a response: one whole packet.
    ///
    /// # Errors
    ///
    /// Wrong id or size, data that ends early or a wrong checksum. The inputs then stay as they
    /// were, and the transfer must begin again.
    pub fn receive(&mut self, response: &[u8]) -> Result<&Inputs, Error> {
        match self.mode {
            TransferMode::Simple => {
                self.inputs.take_simple(ExchangeDataResponse::parse(response)?);
            }
            TransferMode::Compressed => self.compressed_response(response)?,
        }
        self.commands.receive(self.inputs.reports_mut());
        Ok(&self.inputs)
    }

    fn compressed_response(&mut self, response: &[u8]) -> Result<(), Error> {
        let (start, data) = response.split_at(response.len().min(CmprHeader::LEN));
        let header = CmprHeader::parse_response(start)?;
        if data.len() != header.extra_size as usize {
            return Err(Error::WrongSize {
                packet: "ExchangeDataCmpr response",
                expected: CmprHeader::LEN + header.extra_size as usize,
                found: response.len(),
            });
        }
        let expected = self.word_count;
        self.take_in(expected, data, &header).or_else(|error| {
            if self.word_count_is_known {
                return Err(error);
            }
            let counts = RESPONSES.into_iter().map(|(_, count)| count);
            let mut others = counts.filter(|count| *count != expected);
            // The error for the number by the firmware's version is the better message.
            others.find_map(|count| self.take_in(count, data, &header).ok()).ok_or(error)
        })
    }

    /// Takes in a response if it has this number of words per area; then all later ones must have it.
    fn take_in(
        &mut self,
        word_count: usize,
        data: &[u8],
        header: &CmprHeader,
    ) -> Result<(), Error> {
        let areas = 1 + header.active_extensions.count_ones() as usize;
        let words = self.expander.expand(data, word_count * areas, header.crc)?;
        self.inputs.take_compressed(header.active_extensions, words, word_count);
        self.word_count = word_count;
        self.word_count_is_known = true;
        Ok(())
    }

    /// The inputs of the responses so far.
    pub fn inputs(&self) -> &Inputs {
        &self.inputs
    }
}

/// An error unless there are 1 to 9 areas.
pub(crate) fn check_area_count(given: usize) -> Result<(), Error> {
    if (1..=MAX_AREAS).contains(&given) {
        Ok(())
    } else {
        Err(Error::AreaCount { given })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OLD: FirmwareVersion = FirmwareVersion::OLDEST_SUPPORTED;
    const NEW: FirmwareVersion = FirmwareVersion::WITH_MICROPHONE;

    /// A response with these words, by a controller in this state.
    fn response(compressor: &mut Compressor, words: &[u16]) -> Vec<u8> {
        let mut data = Vec::new();
        let crc = compressor.compress(words, &mut data);
        let mut response = Vec::new();
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions: 0 }.emit_response(&mut response);
        response.extend(data);
        response
    }

    #[test]
    fn the_first_response_settles_the_number_of_words() {
        for (firmware, count, other) in [(OLD, 52, 50), (NEW, 50, 52), (OLD, 50, 52), (NEW, 52, 50)]
        {
            let mut exchange = Exchange::new(TransferMode::Compressed, firmware);
            let mut controller = Compressor::new();
            let mut area = [FishX1Transfer::default()];
            area[0].txt_inputs2.mic_log = 77; // of a controller before
            for value in 1..4 {
                let response = response(&mut controller, &vec![value; count]);
                exchange.receive(&response).unwrap().apply(&mut area);
                assert_eq!(area[0].input.uni[7], value as i16);
                let microphone = if count == 52 { value } else { 0 };
                assert_eq!(area[0].txt_inputs2.mic_log, microphone);
            }
            let response = response(&mut controller, &vec![9; other]);
            let result = exchange.receive(&response).cloned();
            assert!(matches!(result, Err(Error::WrongCrc { .. } | Error::DataEndsEarly { .. })));
            exchange.inputs().apply(&mut area);
            assert_eq!(area[0].input.uni[7], 3, "a wrong response changes nothing");
        }
    }

    #[test]
    fn a_size_that_the_packet_does_not_have_is_an_error() {
        let whole = response(&mut Compressor::new(), &[1; 52]);
        for found in [whole.len() - 1, whole.len() + 1, 15, 3, 0] {
            let mut bytes = whole.clone();
            bytes.resize(found, 0);
            let mut exchange = Exchange::new(TransferMode::Compressed, NEW);
            let result = exchange.receive(&bytes).cloned();
            assert!(matches!(result, Err(Error::WrongSize { found: size, .. }) if size == found));
        }
    }

    #[test]
    fn a_configuration_is_due_at_first_and_when_its_id_changes() {
        let mut exchange = Exchange::new(TransferMode::Compressed, NEW);
        let mut areas = [FishX1Transfer::default(); 2];
        let mut due = |areas: &[FishX1Transfer]| {
            exchange.next_update_config(areas).map(|update| (update.extension_id, update.config_id))
        };
        assert_eq!((due(&areas), due(&areas), due(&areas)), (Some((0, 1)), Some((1, 1)), None));
        areas[1].state.config_id = 0;
        assert_eq!((due(&areas), due(&areas)), (Some((1, 0)), None));
    }

    #[test]
    fn no_areas_or_more_than_9_are_an_error() {
        for given in [0, 10] {
            let areas = vec![FishX1Transfer::default(); given];
            let mut exchange = Exchange::new(TransferMode::Simple, NEW);
            let result = exchange.request(&areas, &mut Vec::new());
            assert_eq!(result, Err(Error::AreaCount { given }));
        }
    }
}
