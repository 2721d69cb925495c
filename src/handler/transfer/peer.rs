//! A controller for the tests of the transfer thread: answers every command, and has no machine.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::{self, JoinHandle};

use crate::firmware::FirmwareVersion;
use crate::wire::{
    CmprHeader, CommandId, Compressor, QueryStatusResponse, ResponseId, StartOnline, UpdateConfig,
};

/// Words per area in a response of [`FirmwareVersion::OLDEST_SUPPORTED`].
const WORDS: usize = 50;

pub(crate) struct Peer {
    pub(crate) port: u16,
    thread: JoinHandle<Vec<CommandId>>,
}

impl Peer {
    /// Serves one client. Each response differs from the one before in all words; in every fourth the extension is
    /// missing.
    pub(crate) fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let thread = thread::spawn(move || serve(listener.accept().unwrap().0));
        Self { port, thread }
    }

    /// The commands that have come in, when the client has left.
    pub(crate) fn commands(self) -> Vec<CommandId> {
        self.thread.join().unwrap()
    }
}

fn serve(mut stream: TcpStream) -> Vec<CommandId> {
    stream.set_nodelay(true).unwrap();
    let mut commands = Vec::new();
    let mut compressor = Compressor::new();
    while let Some(command) = next_command(&mut stream) {
        commands.push(command);
        let mut response = Vec::new();
        match command {
            CommandId::QueryStatus => {
                let version = FirmwareVersion::OLDEST_SUPPORTED;
                QueryStatusResponse { device_name: *b"ROBOTICS TXT 001", version }
                    .emit(&mut response);
            }
            CommandId::StartOnline => ResponseId::StartOnline.emit(&mut response),
            CommandId::UpdateConfig => ResponseId::UpdateConfig.emit(&mut response),
            CommandId::StopOnline => ResponseId::StopOnline.emit(&mut response),
            CommandId::ExchangeDataCmpr => {
                exchange(commands.len() as u16, &mut compressor, &mut response);
            }
            CommandId::ExchangeData
            | CommandId::StartCameraOnline
            | CommandId::StopCameraOnline => unreachable!("no test sends {command}"),
        }
        stream.write_all(&response).unwrap();
    }
    commands
}

/// Reads a whole command; `None` when the client has left.
fn next_command(stream: &mut TcpStream) -> Option<CommandId> {
    let mut bytes = [0; UpdateConfig::LEN];
    stream.read_exact(&mut bytes[..4]).ok()?;
    let id = u32::from_le_bytes(bytes[..4].try_into().unwrap());
    let command = CommandId::from_id(id).unwrap();
    let size = match command {
        CommandId::StartOnline => StartOnline::LEN,
        CommandId::UpdateConfig => UpdateConfig::LEN,
        CommandId::ExchangeDataCmpr => CmprHeader::LEN,
        CommandId::QueryStatus
        | CommandId::StopOnline
        | CommandId::ExchangeData
        | CommandId::StartCameraOnline
        | CommandId::StopCameraOnline => 4,
    };
    stream.read_exact(&mut bytes[4..size]).unwrap();
    if command == CommandId::ExchangeDataCmpr {
        let header = CmprHeader::parse_command(&bytes[..size]).unwrap();
        stream.read_exact(&mut vec![0; header.extra_size as usize]).unwrap();
    }
    Some(command)
}

fn exchange(number: u16, compressor: &mut Compressor, response: &mut Vec<u8>) {
    let active_extensions = u16::from(number % 4 != 0);
    let mut data = Vec::new();
    let words = vec![number; WORDS * (1 + usize::from(active_extensions))];
    let crc = compressor.compress(&words, &mut data);
    let extra_size = data.len() as u32;
    CmprHeader { extra_size, crc, active_extensions }.emit_response(response);
    response.extend(data);
}
