//! The client's side of the exchange.

use arbitrary::{Result, Unstructured};
use ft_transfer_area::transfer_area::{DUTY_MAX, MAX_AREAS};
use ft_transfer_area::wire::{
    CmprHeader, Compressor, ExchangeData, ExchangeDataResponse, Expander, ResponseId, UpdateConfig,
};
use ft_transfer_area::{Error, Exchange, FirmwareVersion, FishX1Transfer, TransferMode};

use super::take;

/// Words of each area in a request.
const REQUEST_WORDS: usize = 27;

/// A client, and the controller's side of the exchange.
struct Pair {
    mode: TransferMode,
    areas: Vec<FishX1Transfer>,
    exchange: Exchange,
    /// Understands the requests.
    requests: Expander,
    /// Makes right responses, as long as the client has accepted no other responses.
    responses: Compressor,
    words_per_area: usize,
    in_step: bool,
}

/// Exchanges with 1 or 9 areas, both modes and both layouts: right responses, wrong ones and
/// arbitrary ones in a row.
pub fn exchange(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = exchanges(&mut Unstructured::new(data));
}

fn exchanges(input: &mut Unstructured) -> Result<()> {
    let kind: u8 = input.arbitrary()?;
    let mode = if kind & 1 == 0 { TransferMode::Compressed } else { TransferMode::Simple };
    let areas = if kind & 2 == 0 { 1 } else { MAX_AREAS };
    let (patch, words_per_area) = if kind & 4 == 0 { (6, 52) } else { (1, 50) };
    let mut pair = Pair {
        mode,
        areas: vec![FishX1Transfer::default(); areas],
        exchange: Exchange::new(mode, FirmwareVersion::new(4, patch, 6)),
        requests: Expander::new(),
        responses: Compressor::new(),
        words_per_area,
        in_step: true,
    };
    while !input.is_empty() {
        pair.request();
        pair.respond(input)?;
        pair.change_outputs(input)?;
    }
    Ok(())
}

impl Pair {
    /// Makes the client's next commands. A controller must understand them.
    fn request(&mut self) {
        let mut configs = 0;
        while let Some(update) = self.exchange.next_update_config(&self.areas) {
            let mut bytes = Vec::new();
            update.emit(&mut bytes);
            assert_eq!(UpdateConfig::parse(&bytes), Ok(update));
            configs += 1;
        }
        assert!(configs <= self.areas.len());

        let mut request = Vec::new();
        self.exchange.request(&self.areas, &mut request).expect("there are 1 or 9 areas");
        match self.mode {
            TransferMode::Simple => {
                self.check_duty(ExchangeData::parse(&request).expect("a request").duty);
            }
            _ => {
                let (header, data) = request.split_at(CmprHeader::LEN);
                let header = CmprHeader::parse_command(header).expect("a request");
                let mask = header.active_extensions;
                assert_eq!(header.extra_size as usize, data.len());
                let extensions = self.areas.len() - 1;
                assert_eq!(mask, self.exchange.inputs().alive() & ((1 << extensions) - 1));
                let count = REQUEST_WORDS * (1 + mask.count_ones() as usize);
                let words = self.requests.expand(data, count, header.crc).expect("a request");
                let duty = std::array::from_fn(|output| words[output] as i16);
                self.check_duty(duty);
            }
        }
    }

    /// Checks the master's duties in a request. A duty out of range may be sent as the nearest one in it.
    fn check_duty(&self, told: [i16; 8]) {
        let possible = |duty: i16| duty.clamp(0, DUTY_MAX);
        assert_eq!(told.map(possible), self.areas[0].output.duty.map(possible));
    }

    fn respond(&mut self, input: &mut Unstructured) -> Result<()> {
        match input.int_in_range(0..=3)? {
            0 => {
                self.in_step &= !self.receive(take(input, 2000)?);
            }
            1 => {
                let mask = input.arbitrary()?;
                let response = self.with_right_crc(mask, take(input, 1200)?);
                self.in_step &= !self.receive(&response);
            }
            2 => {
                let (response, responses) = self.right_response(input)?;
                let is_taken = self.receive(&response);
                assert!(is_taken || !self.in_step, "a right response was refused");
                self.responses = responses;
            }
            _ => {
                let (mut response, responses) = self.right_response(input)?;
                let place = input.choose_index(response.len())?;
                match input.arbitrary::<u8>()? {
                    0 => response.truncate(place),
                    change => response[place] ^= change,
                }
                // A byte that the client does not read may have any value.
                if self.receive(&response) {
                    self.responses = responses;
                    self.in_step = false;
                }
            }
        }
        Ok(())
    }

    /// A response with these compressed data and the checksum that the client computes.
    fn with_right_crc(&self, mask: u16, data: &[u8]) -> Vec<u8> {
        let response = |crc| {
            let extra_size = data.len() as u32;
            let mut bytes = Vec::new();
            CmprHeader { extra_size, crc, active_extensions: mask }.emit_response(&mut bytes);
            bytes.extend_from_slice(data);
            bytes
        };
        match self.exchange.clone().receive(&response(0)) {
            Err(Error::WrongCrc { computed, .. }) => response(computed),
            _ => response(0),
        }
    }

    /// A response as a controller makes it, and the controller's compressor after it.
    fn right_response(&self, input: &mut Unstructured) -> Result<(Vec<u8>, Compressor)> {
        let mut responses = self.responses.clone();
        let mut bytes = Vec::new();
        match self.mode {
            TransferMode::Simple => {
                ResponseId::ExchangeData.emit(&mut bytes);
                bytes.extend_from_slice(take(input, ExchangeDataResponse::LEN)?);
                bytes.resize(ExchangeDataResponse::LEN, 0);
            }
            _ => {
                let mask = u16::from(input.arbitrary::<u8>()?);
                let count = self.words_per_area * (1 + mask.count_ones() as usize);
                let told = take(input, 2 * count)?;
                let mut words: Vec<u16> = told
                    .chunks_exact(2)
                    .map(|word| u16::from_le_bytes([word[0], word[1]]))
                    .collect();
                words.resize(count, 0);
                let mut data = Vec::new();
                let crc = responses.compress(&words, &mut data);
                let extra_size = data.len() as u32;
                CmprHeader { extra_size, crc, active_extensions: mask }.emit_response(&mut bytes);
                bytes.extend(data);
            }
        }
        Ok((bytes, responses))
    }

    /// Gives a response to the client. Returns whether the client accepts it.
    fn receive(&mut self, response: &[u8]) -> bool {
        let before = self.exchange.inputs().clone();
        match self.exchange.receive(response) {
            Ok(inputs) => {
                inputs.apply(&mut self.areas);
                let once = self.areas.clone();
                inputs.apply(&mut self.areas);
                assert_eq!(self.areas, once, "the same inputs changed something again");
                true
            }
            Err(error) => {
                assert_eq!(*self.exchange.inputs(), before, "after {error}");
                false
            }
        }
    }

    /// Changes the outputs, as a program does between two exchanges.
    fn change_outputs(&mut self, input: &mut Unstructured) -> Result<()> {
        let area = input.choose_index(self.areas.len())?;
        let output = &mut self.areas[area].output;
        match input.int_in_range(0..=5)? {
            0 => output.duty[input.choose_index(8)?] = input.arbitrary()?,
            1 => output.distance[input.choose_index(4)?] = input.arbitrary()?,
            2 => output.motor_ex_cmd_id[input.choose_index(4)?] = input.arbitrary()?,
            3 => output.cnt_reset_cmd_id[input.choose_index(4)?] = input.arbitrary()?,
            4 => self.areas[area].state.config_id = input.arbitrary()?,
            _ => {}
        }
        Ok(())
    }
}
