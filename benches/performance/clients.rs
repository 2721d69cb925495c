//! What is measured against the peer: each makes a number of cycles, and says how long they took.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use anyhow::{ensure, Result};
use clap::Args;
use ft_transfer_area::{
    Exchange, FirmwareVersion, FishX1Transfer, TimeLimits, TransferAreaComHandler, TransferMode,
    TxtClient,
};

/// The first bytes of a connection on which packets only go back and forth.
pub(crate) const RAW_HELLO: u32 = 0x0057_4152;

/// What is exchanged.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Load {
    /// The master and its extensions
    #[arg(long, default_value_t = 1)]
    pub(crate) areas: usize,
    /// Whether all words change in each packet
    #[arg(long)]
    pub(crate) changing: bool,
    /// Whether the exchange is not compressed
    #[arg(long)]
    pub(crate) simple: bool,
}

impl Load {
    /// The master alone, and nothing changes.
    pub(crate) const IDLE: Self = Self { areas: 1, changing: false, simple: false };

    /// The arguments for another process.
    pub(crate) fn arguments(self) -> Vec<String> {
        let mut arguments = vec!["--areas".to_owned(), self.areas.to_string()];
        arguments.extend(self.changing.then(|| "--changing".to_owned()));
        arguments.extend(self.simple.then(|| "--simple".to_owned()));
        arguments
    }

    pub(crate) fn mode(self) -> TransferMode {
        if self.simple {
            TransferMode::Simple
        } else {
            TransferMode::Compressed
        }
    }

    /// Changes all outputs, if they change.
    pub(crate) fn change(self, areas: &mut [FishX1Transfer], number: u32) {
        if !self.changing {
            return;
        }
        let value = if number % 2 == 0 { 100 } else { 200 };
        for area in areas {
            *area.output.duty = [value as i16; 8];
            *area.output.master = [(number % 2) as u8 + 1; 4];
            *area.output.distance = [value; 4];
            *area.output.motor_ex_cmd_id = [value; 4];
            *area.output.cnt_reset_cmd_id = [value; 4];
            area.txt_outputs.sound_cmd_id = value;
            area.txt_outputs.sound_index = value;
            area.txt_outputs.sound_repeat = value;
        }
    }

    /// The size of a request once the exchange has begun.
    fn request_size(self) -> Result<usize> {
        let mut exchange = Exchange::new(self.mode(), FirmwareVersion::new(4, 6, 6));
        let mut areas = vec![FishX1Transfer::default(); self.areas];
        let mut request = Vec::new();
        for number in 0..3 {
            self.change(&mut areas, number);
            request.clear();
            exchange.request(&areas, &mut request)?;
        }
        Ok(request.len())
    }
}

/// A way to make cycles.
pub(crate) trait Client {
    fn cycles(&mut self, count: u32) -> Result<()>;

    /// How long one of this number of cycles takes on average.
    fn time(&mut self, count: u32) -> Result<Duration> {
        let begin = Instant::now();
        self.cycles(count)?;
        Ok(begin.elapsed() / count)
    }
}

/// Sends bytes and reads bytes, and does nothing else.
pub(crate) struct Raw {
    stream: TcpStream,
    request: Vec<u8>,
    response: Vec<u8>,
}

impl Raw {
    pub(crate) fn connect(port: u16, load: Load) -> Result<Self> {
        let mut stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_nodelay(true)?;
        // As for the library's connection.
        let limits = TimeLimits::default();
        stream.set_read_timeout(Some(limits.read))?;
        stream.set_write_timeout(Some(limits.write))?;
        let request = vec![0; load.request_size()?];
        let size = u32::try_from(request.len())?;
        stream.write_all(&[RAW_HELLO.to_le_bytes(), size.to_le_bytes()].concat())?;
        let mut size = [0; 4];
        stream.read_exact(&mut size)?;
        let response = vec![0; u32::from_le_bytes(size) as usize];
        Ok(Self { stream, request, response })
    }
}

impl Client for Raw {
    fn cycles(&mut self, count: u32) -> Result<()> {
        for _ in 0..count {
            self.stream.write_all(&self.request)?;
            let mut read = 0;
            while read < self.response.len() {
                let count = self.stream.read(&mut self.response[read..])?;
                ensure!(count > 0, "the peer has left");
                read += count;
            }
        }
        Ok(())
    }
}

/// `TxtClient::do_transfer`.
pub(crate) struct Direct {
    client: TxtClient,
    exchange: Exchange,
    areas: Vec<FishX1Transfer>,
    load: Load,
}

impl Direct {
    pub(crate) fn connect(port: u16, load: Load) -> Result<Self> {
        let mut client = TxtClient::connect(format!("127.0.0.1:{port}"), TimeLimits::default())?;
        let version = client.query_status()?.version;
        client.start_online()?;
        let exchange = Exchange::new(load.mode(), version);
        let areas = vec![FishX1Transfer::default(); load.areas];
        Ok(Self { client, exchange, areas, load })
    }

    /// One exchange, and what the program does with its response.
    pub(crate) fn cycle(&mut self, answer: impl FnOnce(&mut [FishX1Transfer])) -> Result<()> {
        self.client.do_transfer(&mut self.exchange, &mut self.areas)?;
        answer(&mut self.areas);
        Ok(())
    }
}

impl Client for Direct {
    fn cycles(&mut self, count: u32) -> Result<()> {
        for number in 0..count {
            self.load.change(&mut self.areas, number);
            self.client.do_transfer(&mut self.exchange, &mut self.areas)?;
        }
        Ok(())
    }
}

/// A program that waits for each response of a handler.
pub(crate) struct Waiting {
    handler: TransferAreaComHandler,
    load: Load,
}

impl Waiting {
    pub(crate) fn connect(port: u16, load: Load) -> Result<Self> {
        let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{port}"));
        let handler = builder.areas(load.areas).mode(load.mode()).build()?;
        handler.begin_transfer()?;
        Ok(Self { handler, load })
    }
}

impl Client for Waiting {
    fn cycles(&mut self, count: u32) -> Result<()> {
        for number in 0..count {
            self.load.change(&mut self.handler.areas().wait_cycle()?, number);
        }
        Ok(())
    }
}
