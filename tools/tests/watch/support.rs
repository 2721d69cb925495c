//! The program as a user starts it, a controller that says what a test wants, and a client made by hand.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, StartOnline, UpdateConfig,
};
use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder};
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};
use serde_json::Value;

use super::LIMIT;
use crate::panel::page::Page;
use crate::running::Running;

/// A running `txt watch`.
pub(super) struct Watch {
    pub(super) running: Running,
    /// The main port.
    pub(super) port: u16,
    page: Option<String>,
}

/// Keeps the duties of all outputs of each exchange.
pub(crate) fn logged(builder: SimulatedTxtBuilder) -> (SimulatedTxt, Duties) {
    let log = Duties::default();
    let kept = Duties::clone(&log);
    let keep = move |machine: &mut Machine| {
        let duties = machine.controllers.iter().map(|one| one.outputs.duty);
        kept.lock().unwrap().push(duties.collect());
    };
    (builder.on_exchange(keep).start().unwrap(), log)
}

pub(crate) type Duties = Arc<Mutex<Vec<Vec<[i16; 8]>>>>;

/// The command for this controller, on free ports.
pub(crate) fn command(controller: SocketAddr, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["watch", &controller.to_string(), "--port", "0", "--no-browser"]);
    command.args(arguments).stdin(Stdio::null());
    command
}

impl Watch {
    pub(super) fn start(controller: SocketAddr, arguments: &[&str]) -> Self {
        Self::by(&mut command(controller, arguments), controller)
    }

    /// The same by this command, which is for that controller.
    pub(super) fn by(command: &mut Command, controller: SocketAddr) -> Self {
        let with_page = command.get_args().all(|argument| argument != "--no-page");
        let running = Running::start(command);
        let main = running.line();
        let port = main.strip_prefix("main 127.0.0.1:").and_then(|port| port.parse().ok());
        let port = port.unwrap_or_else(|| panic!("{main:?} is not a port"));
        assert_eq!(running.line(), format!("controller {controller}"));
        let page = with_page.then(|| running.line());
        Self { running, port, page }
    }

    /// With lines of JSON, which are all that it prints.
    pub(super) fn with_lines(controller: SocketAddr) -> Self {
        Self::with_lines_and(controller, &[])
    }

    /// The same with more arguments.
    pub(super) fn with_lines_and(controller: SocketAddr, arguments: &[&str]) -> Self {
        let arguments = [&["--json", "--no-page"], arguments].concat();
        let running = Running::start(&mut command(controller, &arguments));
        let port = listening(&running.line());
        Self { running, port, page: None }
    }

    /// The next line of JSON for which this is true.
    pub(super) fn line_where(&self, mut wanted: impl FnMut(&Value) -> bool) -> Value {
        loop {
            let line: Value = serde_json::from_str(&self.running.line()).unwrap();
            if wanted(&line) {
                return line;
            }
        }
    }

    pub(super) fn page(&self) -> Page {
        let url = self.page.as_deref().and_then(|line| line.strip_prefix("page http://"));
        let (address, token) = url.and_then(|url| url.split_once("/?token=")).unwrap();
        Page::open(address, token)
    }

    pub(super) fn connect(&self) -> TcpStream {
        connect(([127, 0, 0, 1], self.port).into())
    }

    /// Settings for a handler that goes through it.
    pub(super) fn handler(&self) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandler::builder(format!("127.0.0.1:{}", self.port))
    }
}

/// The main port in its first line of JSON.
pub(crate) fn listening(line: &str) -> u16 {
    let line: Value = serde_json::from_str(line).unwrap();
    assert_eq!(line["what"], "listening");
    line["main"].as_str().unwrap().rsplit_once(':').unwrap().1.parse().unwrap()
}

pub(super) fn connect(to: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(to).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream.set_write_timeout(Some(LIMIT)).unwrap();
    stream.set_nodelay(true).unwrap();
    stream
}

/// Listens where a controller would.
pub(crate) fn listener() -> (TcpListener, SocketAddr) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    (listener, address)
}

pub(super) fn accept(listener: &TcpListener) -> TcpStream {
    let (stream, _) = listener.accept().unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream.set_write_timeout(Some(LIMIT)).unwrap();
    stream
}

/// A client as the kit's: nine configurations, then exchanges. It keeps all that it has received.
pub(crate) struct KitClient {
    pub(super) stream: TcpStream,
    compressor: Compressor,
    pub(super) received: Vec<u8>,
}

impl KitClient {
    /// Goes online.
    pub(crate) fn online(to: SocketAddr) -> Self {
        Self::over(connect(to))
    }

    /// Goes online on this connection.
    pub(super) fn over(mut stream: TcpStream) -> Self {
        stream.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
        let mut status = vec![0; 24];
        stream.read_exact(&mut status).unwrap();
        let client = Self::without_question(stream);
        Self { received: [status, client.received].concat(), ..client }
    }

    /// The same without a question for name and version.
    pub(super) fn without_question(stream: TcpStream) -> Self {
        let mut client = Self::started(stream);
        (0..9).for_each(|extension| client.configure(1, extension, Config::default()));
        client
    }

    /// Sends a configuration with this id, also one that the controller ignores.
    pub(super) fn configure(&mut self, config_id: i16, extension_id: i16, config: Config) {
        let mut packet = Vec::new();
        UpdateConfig { config_id, extension_id, config }.emit(&mut packet);
        self.ask(&packet, 4);
    }

    /// Goes online and configures nothing.
    pub(crate) fn without_configuration(to: SocketAddr) -> Self {
        Self::started(connect(to))
    }

    fn started(stream: TcpStream) -> Self {
        let mut client = Self { stream, compressor: Compressor::new(), received: Vec::new() };
        let mut packet = Vec::new();
        StartOnline::new().emit(&mut packet);
        client.ask(&packet, 4);
        client
    }

    /// Sends a packet and receives so many bytes.
    fn ask(&mut self, packet: &[u8], size: usize) -> &[u8] {
        self.stream.write_all(packet).unwrap();
        self.receive(size)
    }

    fn receive(&mut self, size: usize) -> &[u8] {
        let begin = self.received.len();
        self.received.resize(begin + size, 0);
        self.stream.read_exact(&mut self.received[begin..]).unwrap();
        &self.received[begin..]
    }

    /// A compressed exchange of the master, with these duties.
    pub(crate) fn exchange(&mut self, duty: [i16; 8]) {
        self.exchange_all(&[duty]);
    }

    /// The same with extensions.
    pub(crate) fn exchange_all(&mut self, duties: &[[i16; 8]]) {
        self.send_all(duties);
        let header = self.receive(CmprHeader::LEN);
        let size = CmprHeader::parse_response(header).unwrap().extra_size as usize;
        self.receive(size);
    }

    /// The request of an exchange alone.
    pub(super) fn send_all(&mut self, duties: &[[i16; 8]]) {
        let mut words = vec![0; 27 * duties.len()];
        for (words, duty) in words.chunks_mut(27).zip(duties) {
            words[..8].copy_from_slice(&duty.map(|duty| duty as u16));
        }
        let active_extensions = (1 << (duties.len() - 1)) - 1;
        let mut data = Vec::new();
        let crc = self.compressor.compress(&words, &mut data);
        let mut packet = Vec::new();
        let extra_size = data.len() as u32;
        CmprHeader { extra_size, crc, active_extensions }.emit_command(&mut packet);
        packet.extend(data);
        self.stream.write_all(&packet).unwrap();
    }

    /// The other kind of exchange.
    pub(crate) fn simple_exchange(&mut self, duty: [i16; 8]) {
        let mut packet = Vec::new();
        ExchangeData { duty, ..ExchangeData::default() }.emit(&mut packet);
        self.ask(&packet, 80);
    }

    /// Sends StopOnline, and reads until the controller has closed the connection.
    pub(crate) fn end(mut self) -> Vec<u8> {
        self.ask(&CommandId::StopOnline.id().to_le_bytes(), 4);
        self.stream.shutdown(std::net::Shutdown::Write).unwrap();
        let read = self.stream.read_to_end(&mut self.received);
        assert!(matches!(read, Ok(0)), "{read:?}");
        self.received
    }
}

/// Whether the other side has reset the connection, or only closed it.
pub(super) fn is_reset(read: io::Result<usize>) -> bool {
    match read {
        Ok(0) => false,
        Err(error) if error.kind() == io::ErrorKind::ConnectionReset => true,
        other => panic!("{other:?}"),
    }
}
