//! One exchange cycle without I/O: areas to request bytes, response bytes to inputs.

use crate::transfer_area::{FishX1Transfer, IrInput, IZ_COUNTER, IZ_MOTOR, MAX_AREAS};
use crate::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, Expander, IrRemote,
    UpdateConfig,
};
use crate::{Error, FirmwareVersion};

/// How outputs and inputs travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TransferMode {
    /// ExchangeDataCmpr: the master and up to 8 extensions, compressed. The kit's default.
    #[default]
    #[doc(alias = "DoTransferCompressed")]
    Compressed,
    /// ExchangeData: the master only, not compressed. Microphone values are not sent; extensions
    /// are configured, but neither driven nor read.
    #[doc(alias = "DoTransferSimple")]
    Simple,
}

/// Words per area in a compressed request.
const REQUEST_WORDS: usize = 27;
/// The most compressed bytes of a request: 18 bits for each word.
const MAX_REQUEST_DATA: usize = (MAX_AREAS * REQUEST_WORDS * 18).div_ceil(8);
/// Words per area in a compressed response of firmware before 4.2.4.
const RESPONSE_WORDS: usize = 50;
/// Words per area in a compressed response from firmware 4.2.4 on, with the microphone.
const RESPONSE_WORDS_WITH_MICROPHONE: usize = 52;

/// The exchange of one transfer, from StartOnline on, without any I/O.
///
/// It makes the requests from transfer areas and takes in the responses; the bytes between are
/// the caller's business. [`TxtClient::do_transfer`](crate::TxtClient::do_transfer) and
/// [`TransferAreaComHandler`](crate::TransferAreaComHandler) are built on it. Begin with a new
/// one after each StartOnline, because that resets the compression on the controller.
///
/// ```
/// use ft_transfer_area::transfer_area::LOCAL_IO;
/// use ft_transfer_area::{Exchange, FirmwareVersion, FishX1Transfer, TransferMode};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let mut areas = [FishX1Transfer::default()];
/// let mut exchange = Exchange::new(TransferMode::Compressed, FirmwareVersion::new(4, 6, 6));
/// areas[LOCAL_IO].output.duty[0] = 512;
///
/// let mut request = Vec::new();
/// exchange.request(&areas, &mut request)?;
/// assert_eq!(request.len(), 21); // 16 bytes, then a word and 26 unchanged ones
///
/// // A response that is none changes nothing.
/// assert!(exchange.receive(b"nonsense").is_err());
/// exchange.inputs().apply(&mut areas);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Exchange {
    mode: TransferMode,
    /// How many words per area a response has, which it does not say itself: by the firmware's
    /// version at first, then by the checksum of the first response.
    word_count: usize,
    /// The number to try when the first response has not got that many.
    other_word_count: Option<usize>,
    compressor: Compressor,
    expander: Expander,
    /// The configuration id last sent for each area.
    sent_config_ids: [Option<u8>; MAX_AREAS],
    inputs: Inputs,
    /// Buffers that are kept so that a cycle allocates nothing.
    words: Vec<u16>,
    data: Vec<u8>,
}

impl Exchange {
    /// An exchange in the state after StartOnline.
    pub fn new(mode: TransferMode, firmware: FirmwareVersion) -> Self {
        let (word_count, other) = if firmware < FirmwareVersion::WITH_MICROPHONE {
            (RESPONSE_WORDS, RESPONSE_WORDS_WITH_MICROPHONE)
        } else {
            (RESPONSE_WORDS_WITH_MICROPHONE, RESPONSE_WORDS)
        };
        Self {
            mode,
            word_count,
            other_word_count: Some(other),
            compressor: Compressor::new(),
            expander: Expander::new(),
            sent_config_ids: [None; MAX_AREAS],
            inputs: Inputs::default(),
            words: Vec::with_capacity(MAX_AREAS * RESPONSE_WORDS_WITH_MICROPHONE),
            data: Vec::with_capacity(MAX_REQUEST_DATA),
        }
    }

    /// The next UpdateConfig command that is due, and counts it as sent.
    ///
    /// One is due for every area before the first exchange, and later for each area whose
    /// [`config_id`](crate::transfer_area::State::config_id) differs from the last one sent. Call
    /// it before each exchange until it returns `None`.
    #[doc(alias = "UpdateConfig")]
    pub fn next_update_config(&mut self, areas: &[FishX1Transfer]) -> Option<UpdateConfig> {
        let mut areas = areas.iter().zip(&mut self.sent_config_ids).enumerate();
        let (index, (area, sent)) =
            areas.find(|(_, (area, sent))| **sent != Some(area.state.config_id))?;
        *sent = Some(area.state.config_id);
        Some(UpdateConfig {
            config_id: i16::from(area.state.config_id),
            // At most MAX_AREAS, because that many ids are kept.
            extension_id: index as i16,
            config: area.config,
        })
    }

    /// Replaces what is in `out` by the request for the areas' outputs.
    ///
    /// In the compressed mode the extensions that took part in the last response are included,
    /// as far as there are areas for them.
    ///
    /// # Errors
    ///
    /// [`Error::AreaCount`] when there are no areas or more than 9.
    pub fn request(&mut self, areas: &[FishX1Transfer], out: &mut Vec<u8>) -> Result<(), Error> {
        check_area_count(areas.len())?;
        out.clear();
        match self.mode {
            TransferMode::Simple => outputs(&areas[0]).emit(out),
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

    fn compressed_request(&mut self, areas: &[FishX1Transfer], out: &mut Vec<u8>) {
        let extensions = areas.len() - 1;
        let active_extensions = self.inputs.alive & ((1 << extensions) - 1);
        self.words.clear();
        push_outputs(&mut self.words, &areas[0]);
        for (index, area) in areas[1..].iter().enumerate() {
            if active_extensions & 1 << index != 0 {
                push_outputs(&mut self.words, area);
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
    /// were, and the transfer must be begun anew.
    pub fn receive(&mut self, response: &[u8]) -> Result<&Inputs, Error> {
        match self.mode {
            TransferMode::Simple => {
                let data = ExchangeDataResponse::parse(response)?;
                self.inputs.take_in(0, AreaInputs { data, microphone: None });
            }
            TransferMode::Compressed => self.compressed_response(response)?,
        }
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
        let areas = 1 + header.active_extensions.count_ones() as usize;
        self.expand(data, areas, header.crc)?;
        self.inputs.alive = header.active_extensions;
        let extensions = (1..=u16::BITS as usize)
            .filter(|extension| header.active_extensions & 1 << (extension - 1) != 0);
        let indices = std::iter::once(0).chain(extensions);
        for (index, words) in indices.zip(self.words.chunks_exact(self.word_count)) {
            self.inputs.take_in(index, AreaInputs::from_words(words));
        }
        Ok(())
    }

    /// Expands a response into `self.words`, with either number of words per area as long as
    /// none has been right.
    fn expand(&mut self, data: &[u8], areas: usize, crc: u32) -> Result<(), Error> {
        let other = self.other_word_count;
        self.expand_with(self.word_count, data, areas, crc).or_else(|error| match other {
            // What the version promised makes the better message.
            Some(count) => self.expand_with(count, data, areas, crc).map_err(|_| error),
            None => Err(error),
        })
    }

    fn expand_with(
        &mut self,
        word_count: usize,
        data: &[u8],
        areas: usize,
        crc: u32,
    ) -> Result<(), Error> {
        let words = self.expander.expand(data, word_count * areas, crc)?;
        self.words.clear();
        self.words.extend_from_slice(words);
        self.word_count = word_count;
        self.other_word_count = None;
        Ok(())
    }

    /// The inputs of the responses so far.
    pub fn inputs(&self) -> &Inputs {
        &self.inputs
    }
}

/// Errs unless there are 1 to 9 areas.
pub(crate) fn check_area_count(given: usize) -> Result<(), Error> {
    if (1..=MAX_AREAS).contains(&given) {
        Ok(())
    } else {
        Err(Error::AreaCount { given })
    }
}

/// What the responses of one transfer have told so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// By area; `None` for an extension that has never taken part.
    areas: [Option<AreaInputs>; MAX_AREAS],
    /// Which extensions took part in the last response, bit 0 the first.
    alive: u16,
}

/// What a response tells of one area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct AreaInputs {
    data: ExchangeDataResponse,
    /// Linear and logarithmic loudness, where the firmware sends them.
    microphone: Option<[u16; 2]>,
}

impl Inputs {
    /// Which extensions took part in the last response: bit 0 the first, bit 7 the eighth.
    pub fn alive(&self) -> u16 {
        self.alive
    }

    /// Writes the inputs into the areas that took part, and which extensions are alive into the
    /// first one's `io_slave_alive`.
    ///
    /// A counter reset or motor command whose id has just come back as done sets the area's
    /// [`cnt_resetted`](crate::transfer_area::Input::cnt_resetted) or
    /// [`motor_ex_reached`](crate::transfer_area::Input::motor_ex_reached) when it is the newest
    /// one that the area's output part asks for. Applying the same inputs again changes nothing
    /// but flags that the program has cleared since, which stay cleared.
    pub fn apply(&self, areas: &mut [FishX1Transfer]) {
        for (area, inputs) in areas.iter_mut().zip(&self.areas) {
            if let Some(inputs) = inputs {
                inputs.apply(area);
            }
        }
        if let Some(master) = areas.first_mut() {
            for (extension, alive) in master.state.io_slave_alive.iter_mut().enumerate() {
                *alive = u8::from(self.alive & 1 << extension != 0);
            }
        }
    }

    fn take_in(&mut self, index: usize, inputs: AreaInputs) {
        // There are bits for more extensions than there can be areas.
        if let Some(area) = self.areas.get_mut(index) {
            *area = Some(inputs);
        }
    }
}

impl AreaInputs {
    /// Reads one area's part of a compressed response, 50 or 52 words.
    fn from_words(words: &[u16]) -> Self {
        let mut words = words.iter().copied();
        let mut next = || words.next().unwrap_or_default();
        let mut data = ExchangeDataResponse::default();
        data.uni.fill_with(|| next() as i16);
        data.counter_input.fill_with(|| next() as i16);
        data.counter.fill_with(|| next() as i16);
        data.counter_reset_id.fill_with(&mut next);
        data.motor_command_id.fill_with(&mut next);
        data.sound_command_id = next();
        data.ir.fill_with(|| IrRemote {
            left_x: next() as i8,
            left_y: next() as i8,
            right_x: next() as i8,
            right_y: next() as i8,
            bits: next() as u8,
        });
        let microphone =
            (words.len() == 2).then(|| std::array::from_fn(|_| words.next().unwrap_or_default()));
        Self { data, microphone }
    }

    fn apply(&self, area: &mut FishX1Transfer) {
        let input = &mut area.input;
        input.uni = self.data.uni;
        input.cnt_in = self.data.counter_input;
        input.counter = self.data.counter;
        for i in 0..IZ_COUNTER {
            if note_done(&mut input.cnt_reset_cmd_id[i], self.data.counter_reset_id[i])
                && input.cnt_reset_cmd_id[i] == area.output.cnt_reset_cmd_id[i]
            {
                input.cnt_resetted[i] = 1;
            }
        }
        for i in 0..IZ_MOTOR {
            if note_done(&mut input.motor_ex_cmd_id[i], self.data.motor_command_id[i])
                && input.motor_ex_cmd_id[i] == area.output.motor_ex_cmd_id[i]
            {
                input.motor_ex_reached[i] = 1;
            }
        }
        area.txt_inputs.sound_cmd_id = self.data.sound_command_id;
        area.txt_inputs.ir_input = self.data.ir.map(ir_input);
        if let Some([lin, log]) = self.microphone {
            area.txt_inputs2.mic_lin = lin;
            area.txt_inputs2.mic_log = log;
        }
    }
}

/// Remembers the id of the last command that is done, and says whether it is news.
fn note_done(remembered: &mut u16, done: u16) -> bool {
    std::mem::replace(remembered, done) != done
}

/// The transfer area's form of a remote: both halves of each axis beside its value.
fn ir_input(remote: IrRemote) -> IrInput {
    let axis = |value: i8| {
        let magnitude = u16::from(value.unsigned_abs());
        let (negative, positive) = if value < 0 { (magnitude, 0) } else { (0, magnitude) };
        (i16::from(value), negative, positive)
    };
    let bit = |index: u8| u16::from(remote.bits >> index & 1);
    let (joy_left_x, joy_left_x_to_left, joy_left_x_to_right) = axis(remote.left_x);
    let (joy_left_y, joy_left_y_to_backwards, joy_left_y_to_forward) = axis(remote.left_y);
    let (joy_right_x, joy_right_x_to_left, joy_right_x_to_right) = axis(remote.right_x);
    let (joy_right_y, joy_right_y_to_backwards, joy_right_y_to_forward) = axis(remote.right_y);
    IrInput {
        joy_left_x,
        joy_left_x_to_left,
        joy_left_x_to_right,
        joy_left_y,
        joy_left_y_to_forward,
        joy_left_y_to_backwards,
        joy_right_x,
        joy_right_x_to_left,
        joy_right_x_to_right,
        joy_right_y,
        joy_right_y_to_forward,
        joy_right_y_to_backwards,
        button_on: bit(0),
        button_off: bit(1),
        dip_switch_1: bit(2),
        dip_switch_2: bit(3),
    }
}

/// What an area's output part says.
fn outputs(area: &FishX1Transfer) -> ExchangeData {
    ExchangeData {
        duty: area.output.duty,
        master: area.output.master.map(i16::from),
        distance: area.output.distance,
        motor_command_id: area.output.motor_ex_cmd_id,
        counter_reset_id: area.output.cnt_reset_cmd_id,
        sound_command_id: area.txt_outputs.sound_cmd_id,
        sound_index: area.txt_outputs.sound_index,
        sound_repeat: area.txt_outputs.sound_repeat,
    }
}

/// Appends one area's part of a compressed request, 27 words.
fn push_outputs(words: &mut Vec<u16>, area: &FishX1Transfer) {
    let outputs = outputs(area);
    words.extend(outputs.duty.map(|duty| duty as u16));
    words.extend(outputs.master.map(|master| master as u16));
    words.extend(outputs.distance);
    words.extend(outputs.motor_command_id);
    words.extend(outputs.counter_reset_id);
    words.extend([outputs.sound_command_id, outputs.sound_index, outputs.sound_repeat]);
}
