//! Online mode, from StartOnline to StopOnline.

use std::mem;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, Expander, StartOnline, UpdateConfig, ID_LEN,
};
use ft_transfer_area::FirmwareVersion;

use super::i2c::I2c;
use super::line::Line;
use super::outcome::Trouble;

/// Why checks of I2C are not tried.
pub(super) const NO_I2C: &str = "the I2C port refuses";

/// The words that the controller sends for each area.
#[derive(Clone, Debug, Default)]
pub(super) struct Inputs {
    pub(super) words: Vec<u16>,
    /// Which extensions the controller has found.
    pub(super) extensions: u16,
}

impl Inputs {
    /// I1 to I8.
    pub(super) fn universal(&self) -> &[u16] {
        &self.words[..8]
    }

    /// The counter C1.
    pub(super) fn c1(&self) -> i16 {
        self.words[12] as i16
    }

    /// The id of the last reset of C1 that is done.
    pub(super) fn c1_reset_id(&self) -> u16 {
        self.words[16]
    }

    /// The id of the last command for M1 that is done.
    pub(super) fn m1_id(&self) -> u16 {
        self.words[20]
    }

    /// The id of the last sound that is done.
    pub(super) fn sound_id(&self) -> u16 {
        self.words[24]
    }
}

pub(super) struct Session {
    pub(super) main: Line,
    /// Held open, so that the next session can begin at once.
    pub(super) i2c: Option<I2c>,
    /// How long StartOnline took.
    pub(super) began_in: Duration,
    pub(super) began: Instant,
    /// What the next exchange sends for the master. Extensions are sent zeros.
    pub(super) outputs: ExchangeData,
    /// The inputs of the newest exchange.
    pub(super) inputs: Inputs,
    /// The last exchange had an output on.
    pub(super) is_moving: bool,
    /// A sound may be playing.
    pub(super) is_playing: bool,
    /// The motor checks drive, so a press of the button at I1 ends them.
    pub(super) obeys_button: bool,
    compressor: Compressor,
    expander: Expander,
    words_per_area: usize,
}

impl Session {
    /// Sends StartOnline.
    pub(super) fn begin(mut main: Line, firmware: FirmwareVersion) -> Result<Self, Trouble> {
        let mut request = Vec::new();
        StartOnline::new().emit(&mut request);
        let begin = Instant::now();
        command(&mut main, CommandId::StartOnline, &request)?;
        let has_microphone = firmware >= FirmwareVersion::WITH_MICROPHONE;
        Ok(Self {
            main,
            i2c: None,
            began_in: begin.elapsed(),
            began: Instant::now(),
            outputs: ExchangeData::default(),
            inputs: Inputs::default(),
            is_moving: false,
            is_playing: false,
            obeys_button: false,
            compressor: Compressor::new(),
            expander: Expander::new(),
            words_per_area: if has_microphone { 52 } else { 50 },
        })
    }

    /// The I2C connection, for a check that needs it.
    pub(super) fn i2c(&mut self) -> Result<&mut I2c, Trouble> {
        self.i2c.as_mut().ok_or(Trouble::NotTried(NO_I2C))
    }

    /// Sends UpdateConfig for the master.
    pub(super) fn configure(&mut self, id: i16, config: Config) -> Result<(), Trouble> {
        command(&mut self.main, CommandId::UpdateConfig, &config_packet(id, config))?;
        Ok(())
    }

    /// One compressed exchange.
    pub(super) fn exchange(&mut self) -> Result<(), Trouble> {
        self.main.check()?;
        let request = self.request(self.inputs.extensions);
        let moves = self.outputs.duty != [0; 8];
        // Without an answer nobody knows.
        self.is_moving |= moves;
        self.main.send(&request)?;
        self.take_answer()?;
        self.is_moving = moves;
        if let Some(i2c) = &mut self.i2c {
            i2c.keep()?;
        }
        if self.obeys_button && self.inputs.universal()[0] != 0 {
            return Err(Trouble::Button);
        }
        Ok(())
    }

    /// This number of exchanges.
    pub(super) fn exchanges(&mut self, count: usize) -> Result<(), Trouble> {
        (0..count).try_for_each(|_| self.exchange())
    }

    /// Exchanges until `done`: how long that took, and how many exchanges. `None` at the limit.
    pub(super) fn until(
        &mut self,
        limit: Duration,
        done: impl Fn(&Inputs) -> bool,
    ) -> Result<Option<(Duration, usize)>, Trouble> {
        let begin = Instant::now();
        let mut count = 0;
        while begin.elapsed() < limit {
            self.exchange()?;
            count += 1;
            if done(&self.inputs) {
                return Ok(Some((begin.elapsed(), count)));
            }
        }
        Ok(None)
    }

    /// The packet of the next compressed exchange.
    pub(super) fn request(&mut self, extensions: u16) -> Vec<u8> {
        let mut simple = Vec::new();
        self.outputs.emit(&mut simple);
        // The words of the compressed exchange are those between the id and the last two bytes.
        let words =
            simple[ID_LEN..].chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]]));
        let mut words: Vec<_> = words.collect();
        words.pop();
        words.resize(words.len() * (1 + extensions.count_ones() as usize), 0);
        let mut data = Vec::new();
        let crc = self.compressor.compress(&words, &mut data);
        let header =
            CmprHeader { extra_size: data.len() as u32, crc, active_extensions: extensions };
        let mut packet = Vec::new();
        header.emit_command(&mut packet);
        packet.extend(data);
        packet
    }

    /// Reads an answer of the compressed exchange.
    pub(super) fn take_answer(&mut self) -> Result<(), Trouble> {
        let lost = |error: ft_transfer_area::Error| Trouble::Lost(format!("{error:#}"));
        let header = self.main.receive(CmprHeader::LEN)?;
        let header = CmprHeader::parse_response(&header).map_err(lost)?;
        let data = self.main.receive(header.extra_size as usize)?;
        let count = self.words_per_area * (1 + header.active_extensions.count_ones() as usize);
        let words = self.expander.expand(&data, count, header.crc).map_err(lost)?;
        self.inputs = Inputs { words: words.to_vec(), extensions: header.active_extensions };
        Ok(())
    }

    /// The exchange after which nothing moves or sounds any more.
    pub(super) fn last_exchange(&mut self) -> Result<(), Trouble> {
        let before = mem::take(&mut self.outputs);
        // The next id of each motor ends its distance.
        let ids = before.motor_command_id;
        self.outputs.motor_command_id = ids.map(|id| if id == 0 { 0 } else { id.wrapping_add(1) });
        self.outputs.counter_reset_id = before.counter_reset_id;
        self.outputs.sound_command_id =
            before.sound_command_id.wrapping_add(u16::from(self.is_playing));
        self.obeys_button = false;
        self.exchange()?;
        self.is_playing = false;
        Ok(())
    }

    /// Stops everything and ends online mode, also after Ctrl-C: how long StopOnline took, and the connection, which goes on.
    pub(super) fn end(mut self) -> Result<(Duration, Line), Trouble> {
        self.main.go_on();
        self.last_exchange()?;
        // The server behind it ends with it, and then StopOnline waits for nothing.
        drop(self.i2c.take());
        let begin = Instant::now();
        command(&mut self.main, CommandId::StopOnline, &packet(CommandId::StopOnline))?;
        Ok((begin.elapsed(), self.main))
    }
}

/// Sends a command that is answered by a packet of a fixed size, and returns it.
pub(super) fn command(
    line: &mut Line,
    command: CommandId,
    request: &[u8],
) -> Result<Vec<u8>, Trouble> {
    let lost = |error: ft_transfer_area::Error| Trouble::Lost(format!("{error:#}"));
    let response = command.response();
    let answer = line.ask(request, response.size(&[]).map_err(lost)?);
    let answer = answer.map_err(|trouble| trouble.during(command.name()))?;
    response.check(&answer).map_err(lost)?;
    Ok(answer)
}

/// A command without arguments.
pub(super) fn packet(command: CommandId) -> Vec<u8> {
    let mut out = Vec::new();
    command.emit(&mut out);
    out
}

/// An UpdateConfig for the master.
pub(super) fn config_packet(config_id: i16, config: Config) -> Vec<u8> {
    let mut out = Vec::new();
    UpdateConfig { config_id, extension_id: 0, config }.emit(&mut out);
    out
}
