//! The answers of the ports, without a connection.

use ft_transfer_area::FirmwareVersion;

use crate::i2c::server;
use crate::machine::Machine;
use crate::server::command;
use crate::server::protocol::{Protocol, Script, Settings};

/// The main port, with one client after another.
pub struct MainPort {
    settings: Settings,
    protocol: Protocol,
    script: Script,
}

impl MainPort {
    /// A port to which a client has just connected.
    pub fn new(firmware: FirmwareVersion) -> Self {
        let settings = Settings {
            device_name: *b"ROBOTICS TXT 001",
            firmware,
            words: firmware.response_words(),
        };
        let protocol = Protocol::new(settings.clone());
        Self { settings, protocol, script: Box::new(|_| {}) }
    }

    /// The client leaves, and the next one connects.
    pub fn next_client(&mut self, machine: &mut Machine) {
        machine.client_left();
        self.protocol = Protocol::new(self.settings.clone());
        machine.client_came();
    }

    /// Carries out a whole command. Returns the response, or why the connection would be closed.
    pub fn answer(&mut self, command: &[u8], machine: &mut Machine) -> Result<Vec<u8>, String> {
        let mut response = Vec::new();
        self.protocol
            .answer(command, machine, &mut self.script, &mut response)
            .map_err(|misbehaviour| misbehaviour.to_string())?;
        Ok(response)
    }
}

/// The size of the command that starts with these bytes, as far as they show it.
pub fn command_size(start: &[u8]) -> Result<usize, String> {
    command::command_size(start).map_err(|misbehaviour| misbehaviour.to_string())
}

/// Checks the bytes that have arrived before a response is sent.
pub fn look_ahead(bytes: &[u8]) {
    command::ahead(bytes);
}

/// Carries out an I2C request, which ends with the bytes to write. Returns the response, or why the
/// connection would be closed. Missing bytes are 0.
pub fn i2c_response(request: &[u8], machine: &mut Machine) -> Result<Vec<u8>, String> {
    server::answer(request, machine.i2c())
}
