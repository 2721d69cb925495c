//! One connection's protocol: bytes of commands to bytes of responses, without I/O or a clock.

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, Expander,
    QueryStatusResponse, ResponseId, StartCameraOnline, StartOnline, UpdateConfig,
};
use ft_transfer_area::{Error, FirmwareVersion};

use crate::machine::journal::notice;
use crate::machine::oddity::Oddity;
use crate::machine::words::{self, COMMAND_WORDS};
use crate::machine::Machine;
use crate::server::command::{command_id, is_exchange, Misbehaviour};

/// The function that is called for each exchange.
pub(crate) type Script = Box<dyn FnMut(&mut Machine) + Send>;

/// What all connections of a simulated TXT share.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Name of the controller, padded with NUL.
    pub(crate) device_name: [u8; 16],
    /// Version of its firmware.
    pub(crate) firmware: FirmwareVersion,
    /// How many words of each controller a compressed response has.
    pub(crate) words: usize,
}

/// The first firmware with the compressed exchange.
const FIRST_COMPRESSED: FirmwareVersion = FirmwareVersion::new(4, 1, 6);

/// An exchange whose outputs are taken over, and which is not answered yet.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Exchange {
    Simple,
    Compressed,
}

/// One connection's state.
#[derive(Debug)]
pub(crate) struct Protocol {
    settings: Settings,
    expander: Expander,
    compressor: Compressor,
    /// Kept for the next use.
    words: Vec<u16>,
    /// Kept for the next use.
    data: Vec<u8>,
}

impl Protocol {
    /// A connection that has just been made.
    pub(crate) fn new(settings: Settings) -> Self {
        Self {
            settings,
            expander: Expander::new(),
            compressor: Compressor::new(),
            words: Vec::new(),
            data: Vec::new(),
        }
    }

    /// Carries out one whole command and appends the response to `out`.
    pub(crate) fn answer(
        &mut self,
        command: &[u8],
        machine: &mut Machine,
        script: &mut Script,
        out: &mut Vec<u8>,
    ) -> Result<(), Misbehaviour> {
        if let Some(exchange) = self.begin(command, machine, out)? {
            self.finish(exchange, machine, script, out);
        }
        Ok(())
    }

    /// The same, but of an exchange it only takes over the outputs. [`finish`](Self::finish) does the rest.
    pub(crate) fn begin(
        &mut self,
        command: &[u8],
        machine: &mut Machine,
        out: &mut Vec<u8>,
    ) -> Result<Option<Exchange>, Misbehaviour> {
        let id = command_id(command)?;
        machine.note_command(id);
        if !is_exchange(id) {
            notice!(Info, "the client sends {id}");
        }
        let needs_online =
            !matches!(id, CommandId::QueryStatus | CommandId::StartOnline | CommandId::StopOnline);
        if needs_online && !machine.online() {
            machine.note_oddity(&Oddity::NotOnline(id));
        }
        match id {
            CommandId::QueryStatus => self.query_status(out),
            CommandId::StartOnline => self.start_online(command, machine, out)?,
            CommandId::UpdateConfig => update_config(command, machine, out)?,
            CommandId::ExchangeData => {
                let outputs = ExchangeData::parse(command)?;
                machine.note_mask(0, || outputs.duty != [0; 8]);
                machine.take_over(0, outputs);
                return Ok(Some(Exchange::Simple));
            }
            // As measured on 4.1.5; the kit's client uses it with 4.1.6.
            CommandId::ExchangeDataCmpr if self.settings.firmware < FIRST_COMPRESSED => {
                return Err(Misbehaviour::UnknownId(id.id()));
            }
            CommandId::ExchangeDataCmpr => {
                self.take_over(command, machine)?;
                return Ok(Some(Exchange::Compressed));
            }
            CommandId::StopOnline => stop_online(machine, out),
            CommandId::StartCameraOnline => start_camera(command, machine, out)?,
            CommandId::StopCameraOnline => stop_camera(machine, out),
        }
        Ok(None)
    }

    /// Lets the time of an exchange pass and appends its response to `out`.
    pub(crate) fn finish(
        &mut self,
        exchange: Exchange,
        machine: &mut Machine,
        script: &mut Script,
        out: &mut Vec<u8>,
    ) {
        machine.pass_exchange();
        script(machine);
        let number = machine.exchanges();
        notice!(Trace, "exchange {number} takes place");
        match exchange {
            Exchange::Simple => {
                if let Some(master) = machine.reachable().next() {
                    // The firmware reports the resets of this exchange as done, whatever its board says.
                    let counter_reset_id = master.outputs.counter_reset_id;
                    ExchangeDataResponse { counter_reset_id, ..master.report() }.emit(out);
                }
            }
            Exchange::Compressed => {
                self.report(machine, out);
                machine.note_offer();
            }
        }
        machine.note_exchange();
    }

    fn query_status(&self, out: &mut Vec<u8>) {
        let Settings { device_name, firmware: version, .. } = self.settings;
        QueryStatusResponse { device_name, version }.emit(out);
    }

    fn start_online(
        &mut self,
        command: &[u8],
        machine: &mut Machine,
        out: &mut Vec<u8>,
    ) -> Result<(), Misbehaviour> {
        StartOnline::parse(command)?;
        machine.check_start()?;
        self.expander = Expander::new();
        self.compressor = Compressor::new();
        machine.start_online();
        ResponseId::StartOnline.emit(out);
        Ok(())
    }

    /// Gives the outputs of a compressed exchange to their controllers.
    fn take_over(&mut self, command: &[u8], machine: &mut Machine) -> Result<(), Misbehaviour> {
        let (header, data) = command.split_at(CmprHeader::LEN.min(command.len()));
        let CmprHeader { crc, active_extensions: mask, .. } = CmprHeader::parse_command(header)?;
        if mask >> MAX_EXTENSIONS != 0 {
            return Err(Misbehaviour::Extensions(mask));
        }
        let areas = 1 + mask.count_ones() as usize;
        let count = areas * COMMAND_WORDS;
        // Without the last byte first: if that is enough, this byte has no part in the words. Otherwise the
        // expander stays as it was.
        self.words.clear();
        let needed = data.split_last().map_or(data, |(_, needed)| needed);
        if let Ok(words) = self.expander.expand(needed, count, crc) {
            self.words.extend_from_slice(words);
            machine.note_oddity(&Oddity::SurplusData);
        } else {
            match self.expander.expand(data, count, crc) {
                Ok(words) => self.words.extend_from_slice(words),
                Err(error @ Error::DataEndsEarly { .. }) => {
                    machine.end_program(&Oddity::TooFewWords)?;
                    return Err(error.into());
                }
                Err(error) => return Err(error.into()),
            }
        }
        let mut areas = self.words.chunks_exact(COMMAND_WORDS).map(words::outputs);
        machine.note_mask(mask, || areas.any(|outputs| outputs.duty != [0; 8]));
        let extensions = (0..MAX_EXTENSIONS).filter(|extension| mask >> extension & 1 != 0);
        let controllers = std::iter::once(0).chain(extensions.map(|extension| extension + 1));
        for (controller, area) in controllers.zip(self.words.chunks_exact(COMMAND_WORDS)) {
            machine.take_over(controller, words::outputs(area));
        }
        Ok(())
    }

    /// Appends the response of a compressed exchange.
    fn report(&mut self, machine: &Machine, out: &mut Vec<u8>) {
        self.words.clear();
        for controller in machine.reachable() {
            words::push_report(controller, self.settings.words, &mut self.words);
        }
        self.data.clear();
        let crc = self.compressor.compress(&self.words, &mut self.data);
        // At most 1053 bytes.
        let extra_size = self.data.len() as u32;
        let header = CmprHeader { extra_size, crc, active_extensions: machine.alive_mask() };
        header.emit_response(out);
        out.extend_from_slice(&self.data);
    }
}

fn update_config(
    command: &[u8],
    machine: &mut Machine,
    out: &mut Vec<u8>,
) -> Result<(), Misbehaviour> {
    let UpdateConfig { config_id, extension_id, config } = UpdateConfig::parse(command)?;
    machine.configure(extension_id, config_id, config);
    ResponseId::UpdateConfig.emit(out);
    Ok(())
}

fn stop_online(machine: &mut Machine, out: &mut Vec<u8>) {
    machine.stop_online();
    ResponseId::StopOnline.emit(out);
}

fn start_camera(
    command: &[u8],
    machine: &mut Machine,
    out: &mut Vec<u8>,
) -> Result<(), Misbehaviour> {
    let asked_for = StartCameraOnline::parse(command)?;
    machine.start_camera(asked_for);
    ResponseId::StartCameraOnline.emit(out);
    Ok(())
}

fn stop_camera(machine: &mut Machine, out: &mut Vec<u8>) {
    machine.stop_camera();
    notice!(Info, "the camera stops");
    ResponseId::StopCameraOnline.emit(out);
}

#[cfg(test)]
mod tests {
    use super::*;
    use ft_transfer_area::transfer_area::Config;

    fn protocol() -> Protocol {
        let firmware = FirmwareVersion::new(4, 6, 6);
        let device_name = *b"ROBOTICS TXT 001";
        Protocol::new(Settings { device_name, firmware, words: firmware.response_words() })
    }

    fn oddities(machine: &Machine) -> Vec<&str> {
        machine.oddities().collect()
    }

    fn answer(
        protocol: &mut Protocol,
        machine: &mut Machine,
        command: &[u8],
    ) -> Result<Vec<u8>, Misbehaviour> {
        let mut out = Vec::new();
        let mut script: Script = Box::new(|_| {});
        protocol.answer(command, machine, &mut script, &mut out)?;
        Ok(out)
    }

    /// A compressed exchange of these words, with a new compression.
    fn compressed(words: &[u16], mask: u16) -> Vec<u8> {
        let (mut data, mut command) = (Vec::new(), Vec::new());
        let crc = Compressor::new().compress(words, &mut data);
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions: mask }.emit_command(&mut command);
        command.extend(data);
        command
    }

    #[test]
    fn outputs_go_to_the_extensions_in_the_mask() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(3));
        machine.start_online();
        // Extension 8 does not exist, which does not change the words of the others.
        let words: Vec<u16> = (1..=4).flat_map(|area| [area; COMMAND_WORDS]).collect();
        answer(&mut protocol, &mut machine, &compressed(&words, 0b1000_0110)).unwrap();
        let sound_of = |index: usize| machine.controllers[index].outputs.sound_index;
        assert_eq!([0, 1, 2, 3].map(sound_of), [1, 0, 2, 3]);
    }

    #[test]
    fn the_microphone_is_reported_by_every_controller_or_none() {
        for (words, with_microphone) in [(50, false), (52, true)] {
            let mut protocol = protocol();
            protocol.settings.words = words;
            let mut machine = Machine::new(1);
            machine.start_online();
            machine.controllers[0].mic_lin = 7;
            machine.controllers[1].mic_log = 9;
            let response = answer(&mut protocol, &mut machine, &compressed(&[0; 54], 1)).unwrap();
            let header = CmprHeader::parse_response(&response[..16]).unwrap();
            assert_eq!(header.active_extensions, 1);
            let mut expander = Expander::new();
            let words = expander.expand(&response[16..], 2 * words, header.crc).unwrap();
            if with_microphone {
                assert_eq!((&words[50..52], &words[102..]), (&[7, 0][..], &[0, 9][..]));
            }
        }
    }

    #[test]
    fn an_exchange_allocates_nothing() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(1));
        machine.start_online();
        let (mut script, mut out): (Script, _) = (Box::new(|_| {}), Vec::new());
        let mut compressor = Compressor::new();
        let commands = [(); 6].map(|()| {
            [100, 200, 300].map(|duty| {
                let (mut data, mut command) = (Vec::new(), Vec::new());
                let crc = compressor.compress(&[duty; 2 * COMMAND_WORDS], &mut data);
                let extra_size = data.len() as u32;
                let header = CmprHeader { extra_size, crc, active_extensions: 1 };
                header.emit_command(&mut command);
                command.extend(data);
                command
            })
        });
        let mut answer_all = |commands: &[Vec<u8>]| {
            for command in commands {
                out.clear();
                protocol.answer(command, &mut machine, &mut script, &mut out).unwrap();
            }
        };
        // The longest response comes when commands are reported as done because there were eight.
        commands[..4].iter().for_each(|commands| answer_all(commands));
        let allocations = allocation_counter::measure(|| {
            commands[4..].iter().for_each(|commands| answer_all(commands));
        });
        assert_eq!(allocations.count_total, 0);
    }

    #[test]
    fn commands_outside_online_mode_are_answered_and_odd() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(0));
        answer(&mut protocol, &mut machine, &compressed(&[0; 27], 0)).unwrap();
        assert_eq!(machine.exchanges(), 1);
        let odd = Oddity::NotOnline(CommandId::ExchangeDataCmpr).to_string();
        assert!(oddities(&machine).contains(&odd.as_str()));
    }

    #[test]
    fn what_ends_the_program_is_odd_or_ends_it() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(0));
        let missing = compressed(&[0; 27], 1);
        let error = answer(&mut protocol, &mut machine, &missing).unwrap_err();
        assert!(matches!(error, Misbehaviour::Packet(Error::DataEndsEarly { .. })));
        let why = Oddity::TooFewWords.to_string();
        assert!(oddities(&machine).contains(&why.as_str()));
        machine.be_strict();
        let error = answer(&mut protocol, &mut machine, &missing).unwrap_err();
        assert_eq!(error, Misbehaviour::EndsProgram(why));
    }

    #[test]
    fn the_compressed_exchange_came_with_4_1_6() {
        let (mut old, mut machine) = (protocol(), Machine::new(0));
        old.settings.firmware = FirmwareVersion::new(4, 1, 5);
        let id = CommandId::ExchangeDataCmpr.id();
        let error = answer(&mut old, &mut machine, &compressed(&[0; 27], 0)).unwrap_err();
        assert_eq!(error, Misbehaviour::UnknownId(id));
    }

    #[test]
    fn a_mask_has_8_bits() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(0));
        machine.start_online();
        let ninth = answer(&mut protocol, &mut machine, &compressed(&[0; 54], 1 << 8));
        assert_eq!(ninth, Err(Misbehaviour::Extensions(1 << 8)));
        assert_eq!(machine.exchanges(), 0);
    }

    #[test]
    fn an_exchange_with_a_wrong_checksum_changes_nothing() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(0));
        machine.start_online();
        let mut command = compressed(&[1; 27], 0);
        command[8] ^= 1;
        assert!(matches!(
            answer(&mut protocol, &mut machine, &command),
            Err(Misbehaviour::Packet(Error::WrongCrc { .. }))
        ));
        assert_eq!(machine.controllers[0].outputs, ExchangeData::default());
    }

    #[test]
    fn whole_bytes_after_the_last_word_are_odd_but_not_spare_bits() {
        for surplus in 0..3 {
            let (mut protocol, mut machine) = (protocol(), Machine::new(0));
            machine.start_online();
            machine.configure(0, 1, Config::default());
            // One word and 26 unchanged ones are 34 bits, so 6 bits are spare.
            let mut words = [0; COMMAND_WORDS];
            words[0] = 512;
            let mut command = compressed(&words, 0);
            command[4] += surplus;
            command.extend(vec![0; usize::from(surplus)]);
            answer(&mut protocol, &mut machine, &command).unwrap();
            assert_eq!(machine.controllers[0].outputs.duty[0], 512);
            let odd = if surplus == 0 { vec![] } else { vec![Oddity::SurplusData.to_string()] };
            assert_eq!(oddities(&machine), odd);
        }
    }

    #[test]
    fn an_exchange_that_is_not_answered_is_not_looked_at() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(0));
        machine.start_online();
        let mut command = compressed(&[u16::MAX; 54], 1);
        command[8] ^= 1;
        answer(&mut protocol, &mut machine, &command).unwrap_err();
        assert!(oddities(&machine).is_empty());
    }

    #[test]
    fn starting_online_resets_the_compression_in_both_directions() {
        let (mut protocol, mut machine) = (protocol(), Machine::new(0));
        let mut start = Vec::new();
        StartOnline::new().emit(&mut start);
        // Without a sound, which would play on.
        let mut words = [3; COMMAND_WORDS];
        words[24] = 0;
        let [first, second] = [(); 2].map(|()| {
            answer(&mut protocol, &mut machine, &start).unwrap();
            machine.controllers[0].uni[0] = 5;
            answer(&mut protocol, &mut machine, &compressed(&words, 0)).unwrap()
        });
        assert_eq!(first, second);
        assert_eq!(machine.controllers[0].outputs.sound_index, 3);
    }
}
