//! A peer that answers with packets that were made before: correct, and at next to no cost.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{bail, ensure, Context, Result};
use clap::Args;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, QueryStatusResponse,
    StartCameraOnline, StartOnline, UpdateConfig, ID_LEN,
};
use ft_transfer_area::FirmwareVersion;

use crate::clients::{Load, RAW_HELLO};
use crate::place::stay_on;

/// Serves each client in a thread of its own. Prints its port.
#[derive(Args, Clone)]
pub(crate) struct Peer {
    #[command(flatten)]
    pub(crate) load: Load,
    /// The time between two exchange responses in µs
    #[arg(long, default_value_t = 0)]
    pace: u64,
    #[arg(long)]
    core: Option<usize>,
}

impl Peer {
    pub(crate) fn serve(&self) -> Result<()> {
        stay_on(self.core)?;
        let (listener, _i2c) = listen()?;
        let canned = Canned::new(&self.load)?;
        let pace = Duration::from_micros(self.pace);
        thread::scope(|scope| loop {
            let (stream, _) = listener.accept()?;
            let canned = &canned;
            // A client may leave at any time.
            scope.spawn(move || Connection::new(stream, canned, pace).and_then(Connection::serve));
        })
    }
}

/// Listens, and prints the port. ftrobopy also wants the port for I2C.
pub(crate) fn listen() -> Result<(TcpListener, TcpListener)> {
    loop {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let port = listener.local_addr()?.port();
        // Another program may have that one.
        if let Ok(i2c) = TcpListener::bind(("127.0.0.1", port.saturating_add(2))) {
            println!("{port}");
            return Ok((listener, i2c));
        }
    }
}

/// The responses of exchanges.
pub(crate) struct Canned {
    /// The first after StartOnline, and then two in turn.
    pub(crate) exchanges: [Vec<u8>; 3],
    status: Vec<u8>,
}

impl Canned {
    pub(crate) fn new(load: &Load) -> Result<Self> {
        let mut exchanges = [const { Vec::new() }; 3];
        let mut compressor = Compressor::new();
        for (index, response) in exchanges.iter_mut().enumerate() {
            let changed = load.changing && index == 1;
            if load.simple {
                simple_response(changed, response);
            } else {
                compressed_response(&mut compressor, load.areas, changed, response)?;
            }
        }
        Ok(Self { exchanges, status: status_response() })
    }
}

/// The answer to QueryStatus.
pub(crate) fn status_response() -> Vec<u8> {
    let mut status = Vec::new();
    let version = FirmwareVersion::new(4, 6, 6);
    QueryStatusResponse { device_name: *b"Canned\0\0\0\0\0\0\0\0\0\0", version }.emit(&mut status);
    status
}

/// The value of all words of a response.
fn value(changed: bool) -> u16 {
    if changed {
        20
    } else {
        10
    }
}

fn simple_response(changed: bool, out: &mut Vec<u8>) {
    let mut response = ExchangeDataResponse::default();
    let value = value(changed) as i16;
    response.uni = [value; 8];
    response.counter_input = response.counter_input.map(|_| changed.into());
    response.counter = [value; 4];
    response.counter_reset_id = [value as u16; 4];
    response.motor_command_id = [value as u16; 4];
    response.emit(out);
}

fn compressed_response(
    compressor: &mut Compressor,
    areas: usize,
    changed: bool,
    out: &mut Vec<u8>,
) -> Result<()> {
    /// Of each area, with the microphone.
    const WORDS: usize = 52;
    let mut data = Vec::new();
    let crc = compressor.compress(&vec![value(changed); WORDS * areas], &mut data);
    let active_extensions = (1 << (areas - 1)) - 1;
    CmprHeader { extra_size: u32::try_from(data.len())?, crc, active_extensions }
        .emit_response(out);
    out.extend(data);
    Ok(())
}

/// One client.
struct Connection<'a> {
    stream: TcpStream,
    canned: &'a Canned,
    pace: Duration,
    incoming: Incoming,
    exchanges: usize,
    /// When the next exchange response is due.
    due: Instant,
}

impl<'a> Connection<'a> {
    fn new(stream: TcpStream, canned: &'a Canned, pace: Duration) -> Result<Self> {
        stream.set_nodelay(true)?;
        let (incoming, due) = (Incoming::default(), Instant::now());
        Ok(Self { stream, canned, pace, incoming, exchanges: 0, due })
    }

    fn serve(mut self) -> Result<()> {
        let Canned { exchanges, status } = self.canned;
        loop {
            let (id, _) = self.incoming.read_command(&mut self.stream)?;
            match CommandId::from_id(id) {
                None => return self.serve_raw(),
                Some(CommandId::QueryStatus) => self.stream.write_all(status)?,
                Some(CommandId::ExchangeData | CommandId::ExchangeDataCmpr) => {
                    self.keep_pace();
                    let turn = self.exchanges;
                    self.stream.write_all(&exchanges[turn])?;
                    self.exchanges = if turn == 2 { 1 } else { turn + 1 };
                }
                Some(other) => {
                    self.exchanges = 0;
                    let mut answer = Vec::new();
                    other.response().emit(&mut answer);
                    self.stream.write_all(&answer)?;
                }
            }
        }
    }

    fn keep_pace(&mut self) {
        if self.pace.is_zero() {
            return;
        }
        let rest = self.due.saturating_duration_since(Instant::now());
        thread::sleep(rest);
        let now = Instant::now();
        // As in the simulated TXT.
        let on_time = !rest.is_zero() && now < self.due + self.pace / 2;
        self.due = if on_time { self.due } else { now } + self.pace;
    }

    /// Sends packets of the same sizes back and forth, without a look at them.
    fn serve_raw(mut self) -> Result<()> {
        let response = &self.canned.exchanges[1];
        let request = u32_at(&self.incoming.bytes()[ID_LEN..])? as usize;
        self.stream.write_all(&u32::try_from(response.len())?.to_le_bytes())?;
        loop {
            self.incoming
                .fill(&mut self.stream, |read| Ok((read.len() >= request).then_some(())))?;
            self.stream.write_all(response)?;
        }
    }
}

/// The bytes of a command.
pub(crate) struct Incoming(Box<[u8; 8192]>);

impl Default for Incoming {
    fn default() -> Self {
        Self(Box::new([0; 8192]))
    }
}

impl Incoming {
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0[..]
    }

    /// Reads one whole command; returns its id and its size.
    pub(crate) fn read_command(&mut self, stream: &mut TcpStream) -> Result<(u32, usize)> {
        self.fill(stream, |read| Ok(command_size(read)?.filter(|(_, size)| read.len() >= *size)))
    }

    /// Reads until what has been read is enough for a result.
    fn fill<T>(
        &mut self,
        stream: &mut TcpStream,
        enough: impl Fn(&[u8]) -> Result<Option<T>>,
    ) -> Result<T> {
        let mut read = 0;
        loop {
            let count = stream.read(&mut self.0[read..])?;
            ensure!(count > 0, "the client has left");
            read += count;
            if let Some(result) = enough(&self.0[..read])? {
                return Ok(result);
            }
        }
    }
}

fn u32_at(bytes: &[u8]) -> Result<u32> {
    let word = bytes.first_chunk().context("too short")?;
    Ok(u32::from_le_bytes(*word))
}

/// The id and the size of a command, when enough of it has come in.
fn command_size(bytes: &[u8]) -> Result<Option<(u32, usize)>> {
    if bytes.len() < ID_LEN {
        return Ok(None);
    }
    let id = u32_at(bytes)?;
    let size = match CommandId::from_id(id) {
        Some(CommandId::ExchangeDataCmpr) if bytes.len() < CmprHeader::LEN => return Ok(None),
        Some(CommandId::ExchangeDataCmpr) => CmprHeader::LEN + u32_at(&bytes[ID_LEN..])? as usize,
        Some(CommandId::ExchangeData) => ExchangeData::LEN,
        Some(CommandId::StartOnline) => StartOnline::LEN,
        Some(CommandId::UpdateConfig) => UpdateConfig::LEN,
        Some(CommandId::StartCameraOnline) => StartCameraOnline::LEN,
        Some(_) => ID_LEN,
        None if id == RAW_HELLO => 2 * ID_LEN,
        None => bail!("{id:#x} is not a command"),
    };
    Ok(Some((id, size)))
}
