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
        self.take_answer_or_stop()?;
        self.is_moving = moves;
        if let Some(i2c) = &mut self.i2c {
            i2c.keep()?;
        }
        if self.obeys_button && self.inputs.universal()[0] != 0 {
            return Err(Trouble::Button);
        }
        Ok(())
    }

    /// The answer may come late, or never. When Ctrl-C is pressed meanwhile, the last exchange does not wait for it.
    fn take_answer_or_stop(&mut self) -> Result<(), Trouble> {
        if !self.is_moving {
            return self.take_answer();
        }
        let (request, compressor) = self.last_request();
        self.main.at_interrupt = Some(request);
        let answered = self.take_answer();
        if self.main.at_interrupt.take().is_some() {
            return answered;
        }
        self.compressor = compressor;
        answered?;
        self.take_answer()?;
        self.is_moving = false;
        Err(Trouble::Interrupted)
    }

    /// The request after which nothing moves or sounds any more, and how the next one is compressed then.
    fn last_request(&mut self) -> (Vec<u8>, Compressor) {
        let stopped = self.stopped();
        let outputs = mem::replace(&mut self.outputs, stopped);
        let compressor = self.compressor.clone();
        let request = self.request(self.inputs.extensions);
        self.outputs = outputs;
        (request, mem::replace(&mut self.compressor, compressor))
    }

    /// Stops motors over a connection that may not work any more.
    pub(super) fn abandon(mut self) {
        if self.is_moving {
            let (request, _) = self.last_request();
            self.main.send_last(&request);
        }
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
        self.outputs = self.stopped();
        self.obeys_button = false;
        self.exchange()?;
        self.is_playing = false;
        Ok(())
    }

    /// What it sends.
    fn stopped(&self) -> ExchangeData {
        let before = &self.outputs;
        let sound = before.sound_command_id.wrapping_add(u16::from(self.is_playing));
        ExchangeData {
            // The next id of each motor ends its distance.
            motor_command_id: before.motor_command_id.map(|id| {
                if id == 0 {
                    0
                } else {
                    id.wrapping_add(1)
                }
            }),
            counter_reset_id: before.counter_reset_id,
            sound_command_id: sound,
            ..ExchangeData::default()
        }
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

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{SocketAddr, TcpListener, TcpStream};
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::Arc;
    use std::thread;

    use crossbeam_channel::{bounded, Receiver};
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;

    /// Longer than anything takes on a busy computer.
    const LIMIT: Duration = Duration::from_secs(60);

    /// Passes one connection on to the controller. While `is_hole` no answer comes back.
    fn passage(to: SocketAddr, is_hole: &Arc<AtomicBool>) -> SocketAddr {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (address, is_hole) = (listener.local_addr().unwrap(), Arc::clone(is_hole));
        thread::spawn(move || {
            let (client, _) = listener.accept().unwrap();
            let txt = TcpStream::connect(to).unwrap();
            let never = Arc::new(AtomicBool::new(false));
            let (from, into) = (client.try_clone().unwrap(), txt.try_clone().unwrap());
            thread::spawn(move || pass(from, into, &never));
            pass(txt, client, &is_hole);
        });
        address
    }

    fn pass(mut from: TcpStream, mut to: TcpStream, is_hole: &AtomicBool) {
        let mut bytes = [0; 4096];
        while let Ok(count @ 1..) = from.read(&mut bytes) {
            if !is_hole.load(Ordering::SeqCst) && to.write_all(&bytes[..count]).is_err() {
                return;
            }
        }
    }

    /// A session with M1 on, whose next answers do not come.
    fn moving(txt: &SimulatedTxt, interrupted: &Receiver<()>) -> Session {
        let is_hole = Arc::new(AtomicBool::new(false));
        let line = Line::connect(passage(txt.address(), &is_hole), interrupted).unwrap().unwrap();
        let mut session = Session::begin(line, FirmwareVersion::new(4, 7, 0)).unwrap();
        session.outputs.duty[0] = 512;
        session.exchange().unwrap();
        is_hole.store(true, Ordering::SeqCst);
        session
    }

    fn turns(txt: &SimulatedTxt, is_on: bool) -> bool {
        txt.wait_until(|machine| (machine.area(0).output.duty[0] != 0) == is_on, LIMIT)
    }

    #[test]
    fn while_an_answer_stays_away_ctrl_c_stops_the_motors() {
        let txt = SimulatedTxt::builder().start().unwrap();
        let (interrupt, interrupted) = bounded(1);
        let mut session = moving(&txt, &interrupted);
        assert!(turns(&txt, true));
        let exchanges = txt.with_machine(|machine| machine.exchanges());
        thread::scope(|scope| {
            scope.spawn(|| session.exchange());
            assert!(txt.wait_until(|machine| machine.exchanges() > exchanges, LIMIT));
            interrupt.send(()).unwrap();
            assert!(turns(&txt, false));
        });
    }

    #[test]
    fn a_session_that_is_given_up_stops_the_motors() {
        let txt = SimulatedTxt::builder().start().unwrap();
        let (_interrupt, interrupted) = bounded(1);
        let mut session = moving(&txt, &interrupted);
        assert!(turns(&txt, true));
        assert!(matches!(session.exchange(), Err(Trouble::Lost(_))));
        session.abandon();
        assert!(turns(&txt, false));
    }
}
