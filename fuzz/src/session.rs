//! The main port of the simulated TXT.

use arbitrary::{Result, Unstructured};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, ExchangeData, ExchangeDataResponse, Expander, QueryStatusResponse,
    ResponseId, StartCameraOnline, StartOnline, UpdateConfig, ID_LEN,
};
use ft_transfer_area::{Error, FirmwareVersion};
use ft_transfer_area_simulator::fuzzing::{command_size, look_ahead, MainPort};
use ft_transfer_area_simulator::Machine;

use super::{everything, take};

/// Words of each controller in a request.
const REQUEST_WORDS: usize = 27;

/// A client that sends arbitrary commands, and the simulated TXT.
struct Conversation {
    machine: Machine,
    port: MainPort,
    firmware: FirmwareVersion,
    /// Reads the compressed requests, as the controller does.
    requests: Expander,
    /// Reads the compressed responses, as a client does.
    responses: Expander,
}

/// Sends commands to the simulated TXT: right ones, wrong ones and arbitrary bytes. A refused command
/// must change nothing, and each response must be a whole packet.
pub fn session(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = converse(&mut Unstructured::new(data));
}

fn converse(input: &mut Unstructured) -> Result<()> {
    let extensions = input.int_in_range(0..=MAX_EXTENSIONS)?;
    let machine = if input.arbitrary()? {
        Machine::with_world(extensions, everything()).expect("it is shipped")
    } else {
        Machine::new(extensions)
    };
    let firmware = match input.arbitrary()? {
        false => FirmwareVersion::OLDEST_SUPPORTED,
        true => FirmwareVersion::WITH_MICROPHONE,
    };
    let mut conversation = Conversation {
        machine,
        port: MainPort::new(firmware),
        firmware,
        requests: Expander::new(),
        responses: Expander::new(),
    };
    if input.arbitrary()? {
        conversation.start_online();
    }
    while !input.is_empty() {
        conversation.step(input)?;
    }
    Ok(())
}

impl Conversation {
    fn step(&mut self, input: &mut Unstructured) -> Result<()> {
        match input.int_in_range(0..=9)? {
            0 => self.start_online(),
            1 => self.send_whole(CommandId::UpdateConfig, UpdateConfig::LEN, input)?,
            2 => self.send_whole(CommandId::ExchangeData, ExchangeData::LEN, input)?,
            3 => self.send_whole(CommandId::StartCameraOnline, StartCameraOnline::LEN, input)?,
            4 => {
                let command = input.choose(&[
                    CommandId::QueryStatus,
                    CommandId::StopOnline,
                    CommandId::StopCameraOnline,
                ])?;
                self.send(&command.id().to_le_bytes());
            }
            5 => self.send_stream(take(input, 2000)?),
            6 => {
                let extension = input.choose_index(MAX_EXTENSIONS)?;
                self.machine.alive[extension] = input.arbitrary()?;
            }
            7 => {
                let index = input.choose_index(self.machine.controllers.len())?;
                let controller = &mut self.machine.controllers[index];
                controller.uni[input.choose_index(8)?] = input.arbitrary()?;
                controller.counter[input.choose_index(4)?] = input.arbitrary()?;
                controller.mic_lin = input.arbitrary()?;
            }
            _ => {
                let mask = input.arbitrary()?;
                let is_right = input.ratio(7, 8)?;
                self.exchange(mask, take(input, 600)?, is_right);
            }
        }
        Ok(())
    }

    fn start_online(&mut self) {
        let mut command = Vec::new();
        StartOnline::new().emit(&mut command);
        self.send(&command);
    }

    /// Sends a command of a fixed size with arbitrary content.
    fn send_whole(
        &mut self,
        command: CommandId,
        size: usize,
        input: &mut Unstructured,
    ) -> Result<()> {
        let mut bytes = command.id().to_le_bytes().to_vec();
        bytes.extend_from_slice(take(input, size - ID_LEN)?);
        bytes.resize(size, 0);
        self.send(&bytes);
        Ok(())
    }

    /// Sends a compressed exchange with these data, and with their checksum if it should be right.
    fn exchange(&mut self, mask: u16, data: &[u8], is_right: bool) {
        let count = REQUEST_WORDS * (1 + mask.count_ones() as usize);
        let (crc, is_right) = match self.requests.clone().expand(data, count, 0) {
            Err(Error::WrongCrc { computed, .. }) if is_right => (computed, true),
            _ => (0, false),
        };
        let must_answer = is_right && mask >> MAX_EXTENSIONS == 0;
        let extra_size = data.len() as u32;
        let mut command = Vec::new();
        CmprHeader { extra_size, crc, active_extensions: mask }.emit_command(&mut command);
        command.extend_from_slice(data);
        let is_answered = self.send(&command);
        assert!(is_answered || !must_answer, "a right exchange was refused");
    }

    /// Sends bytes, split into commands in the same way as the server does.
    fn send_stream(&mut self, mut bytes: &[u8]) {
        while let Some((command, rest)) = split_command(bytes) {
            look_ahead(rest);
            self.send(command);
            bytes = rest;
        }
    }

    /// Sends a whole command. Returns whether it is answered.
    fn send(&mut self, command: &[u8]) -> bool {
        let before = self.machine.clone();
        match self.port.answer(command, &mut self.machine) {
            Ok(response) => {
                self.check_response(command, &response);
                true
            }
            Err(reason) => {
                assert!(!reason.is_empty());
                assert_eq!(state(&self.machine), state(&before), "after {reason}");
                self.port.next_client(&mut self.machine);
                assert!(!self.machine.online());
                self.requests = Expander::new();
                self.responses = Expander::new();
                false
            }
        }
    }

    fn check_response(&mut self, command: &[u8], response: &[u8]) {
        let id = u32::from_le_bytes(*command.first_chunk().expect("it was understood"));
        let id = CommandId::from_id(id).expect("it was understood");
        id.response().check(response).expect("the response to this command");
        match id.response() {
            ResponseId::QueryStatus => {
                QueryStatusResponse::parse(response).expect("a whole response");
            }
            ResponseId::ExchangeData => {
                let report = ExchangeDataResponse::parse(response).expect("a whole response");
                // This exchange reports resets at once, as the firmware does.
                let counter_reset_id = self.machine.controllers[0].outputs.counter_reset_id;
                let expected = self.machine.report(0).expect("the master");
                assert_eq!(report, ExchangeDataResponse { counter_reset_id, ..expected });
            }
            ResponseId::ExchangeDataCmpr => self.check_exchange(command, response),
            _ => assert_eq!(response.len(), ID_LEN),
        }
        if id == CommandId::StartOnline {
            assert!(self.machine.online());
            self.requests = Expander::new();
            self.responses = Expander::new();
        }
    }

    fn check_exchange(&mut self, command: &[u8], response: &[u8]) {
        let (header, data) = command.split_at(CmprHeader::LEN);
        let header = CmprHeader::parse_command(header).expect("it was understood");
        let mask = header.active_extensions;
        let count = REQUEST_WORDS * (1 + mask.count_ones() as usize);
        let words = self.requests.expand(data, count, header.crc).expect("it was understood");
        let duty = self.machine.controllers[0].outputs.duty.map(|duty| duty as u16);
        assert_eq!(words[..8], duty);

        let (header, data) = response.split_at(CmprHeader::LEN);
        let header = CmprHeader::parse_response(header).expect("a whole response");
        assert_eq!(header.extra_size as usize, data.len());
        let alive = header.active_extensions;
        let words_per_area = self.firmware.response_words();
        let count = words_per_area * (1 + alive.count_ones() as usize);
        let words = self.responses.expand(data, count, header.crc).expect("a whole response");
        let extensions = (0..MAX_EXTENSIONS).filter(|extension| alive >> extension & 1 != 0);
        let controllers = std::iter::once(0).chain(extensions.map(|extension| extension + 1));
        for (controller, words) in controllers.zip(words.chunks_exact(words_per_area)) {
            let report = self.machine.report(controller).expect("it takes part");
            assert_eq!(words[..8], report.uni.map(|value| value as u16));
            assert_eq!(words[12..16], report.counter.map(|value| value as u16));
        }
    }
}

/// The first command of a stream if it is whole, or bytes that are not a command; and the rest.
fn split_command(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let mut there = 0;
    loop {
        match command_size(&bytes[..there]) {
            Ok(size) if size == there => return Some(bytes.split_at(there)),
            Ok(size) => {
                assert!(size > there);
                bytes.get(..size)?;
                there = size;
            }
            Err(reason) => {
                assert!(!reason.is_empty());
                return None;
            }
        }
    }
}

/// What a refused command must not change: everything except the list of commands.
fn state(machine: &Machine) -> String {
    let Machine { controllers, alive, .. } = machine;
    let counts = (machine.exchanges(), machine.online(), machine.connected(), machine.camera());
    // Without the oddities: a command that ends the program of a real TXT is one, and is refused.
    format!("{controllers:?} {alive:?} {counts:?} {:?}", machine.world())
}
