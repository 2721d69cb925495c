//! A client for tests of the simulated TXT, made by hand.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, Expander, ResponseId,
    StartOnline, UpdateConfig,
};
use ft_transfer_area_simulator::SimulatedTxt;

/// Far longer than anything here takes.
pub(crate) const LIMIT: Duration = Duration::from_secs(10);

/// The compressed inputs of a master and its live extensions.
#[derive(Debug)]
pub(crate) struct Inputs {
    pub(crate) mask: u16,
    /// 52 words per controller.
    pub(crate) words: Vec<u16>,
}

pub(crate) struct Client {
    pub(crate) stream: TcpStream,
    compressor: Compressor,
    expander: Expander,
}

impl Client {
    pub(crate) fn connect(txt: &SimulatedTxt) -> Self {
        let stream = TcpStream::connect(txt.address()).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        stream.set_nodelay(true).unwrap();
        Self { stream, compressor: Compressor::new(), expander: Expander::new() }
    }

    /// Connects and begins online mode.
    pub(crate) fn online(txt: &SimulatedTxt) -> Self {
        let mut client = Self::connect(txt);
        client.start_online();
        client
    }

    pub(crate) fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).unwrap();
    }

    pub(crate) fn receive(&mut self, size: usize) -> Vec<u8> {
        let mut bytes = vec![0; size];
        self.stream.read_exact(&mut bytes).unwrap();
        bytes
    }

    /// Sends a command that is only an id.
    pub(crate) fn command(&mut self, command: CommandId) {
        self.send(&command.id().to_le_bytes());
    }

    pub(crate) fn start_online(&mut self) {
        let mut out = Vec::new();
        StartOnline::new().emit(&mut out);
        self.send(&out);
        ResponseId::StartOnline.check(&self.receive(4)).unwrap();
        self.compressor = Compressor::new();
        self.expander = Expander::new();
    }

    pub(crate) fn update_config(&mut self, config_id: i16, extension_id: i16, config: Config) {
        let mut out = Vec::new();
        UpdateConfig { config_id, extension_id, config }.emit(&mut out);
        self.send(&out);
        ResponseId::UpdateConfig.check(&self.receive(4)).unwrap();
    }

    pub(crate) fn send_exchange(&mut self, outputs: &ExchangeData) {
        let mut out = Vec::new();
        outputs.emit(&mut out);
        self.send(&out);
    }

    pub(crate) fn exchange(&mut self, outputs: &ExchangeData) -> ExchangeDataResponse {
        self.send_exchange(outputs);
        ExchangeDataResponse::parse(&self.receive(ExchangeDataResponse::LEN)).unwrap()
    }

    pub(crate) fn send_compressed(&mut self, areas: &[[u16; 27]], mask: u16) {
        let (mut data, mut out) = (Vec::new(), Vec::new());
        let crc = self.compressor.compress(areas.as_flattened(), &mut data);
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions: mask }.emit_command(&mut out);
        out.extend(data);
        self.send(&out);
    }

    pub(crate) fn receive_compressed(&mut self) -> Inputs {
        let header = CmprHeader::parse_response(&self.receive(CmprHeader::LEN)).unwrap();
        let data = self.receive(header.extra_size as usize);
        let mask = header.active_extensions;
        let count = 52 * (1 + mask.count_ones() as usize);
        let words = self.expander.expand(&data, count, header.crc).unwrap().to_vec();
        Inputs { mask, words }
    }

    pub(crate) fn exchange_compressed(&mut self, areas: &[[u16; 27]], mask: u16) -> Inputs {
        self.send_compressed(areas, mask);
        self.receive_compressed()
    }

    /// Whether nothing has come and the connection is open.
    pub(crate) fn is_silent(&mut self) -> bool {
        self.stream.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        let silent = self.stream.read(&mut [0]).is_err_and(|error| {
            matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
        });
        self.stream.set_read_timeout(Some(LIMIT)).unwrap();
        silent
    }

    /// Reads until the other side closes the connection. Returns what came before.
    pub(crate) fn until_closed(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        match self.stream.read_to_end(&mut bytes) {
            Ok(_) => {}
            // This error comes when it closes with our bytes unread.
            Err(error) if error.kind() == io::ErrorKind::ConnectionReset => {}
            Err(error) => panic!("the connection was not closed: {error}"),
        }
        bytes
    }
}
