//! A controller at the usual pace whose inputs I1 and I2 change with each response, and that notes how each
//! request answers: O1 has the value of I1. I2 is 0 or 1, for programs that wait for events.

use std::io::Write;
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, Expander,
};

use crate::peer::{listen, status_response, Incoming};
use crate::place::stay_on;

/// The words of the master in a compressed request and in its response.
const REQUEST_WORDS: usize = 27;
const RESPONSE_WORDS: usize = 52;

/// The values of I1 come again after this many responses.
const VALUES: u64 = 500;

/// Serves one client. Prints its port, and at the client's end a line for each request: how many requests it took
/// until this one had the answer to a response, and how long after the last response it came, in ns.
#[derive(Args, Clone)]
pub(crate) struct Examiner {
    /// The time between two responses in µs
    #[arg(long, default_value_t = 10_000)]
    pace: u64,
    #[arg(long)]
    core: Option<usize>,
}

impl Examiner {
    pub(crate) fn serve(&self) -> Result<()> {
        stay_on(self.core)?;
        let (listener, _i2c) = listen()?;
        // A client may look whether somebody is there, and leave again.
        let requests = loop {
            let mut session = Session::new(listener.accept()?.0, Duration::from_micros(self.pace))?;
            // It ends when the client leaves.
            let _ = session.serve();
            if !session.requests.is_empty() {
                break session.requests;
            }
        };
        let mut out = std::io::stdout().lock();
        for Request { age, latency, due } in requests {
            writeln!(out, "{age} {} {}", latency.as_nanos(), due.as_nanos())?;
        }
        Ok(())
    }
}

/// What a request was.
struct Request {
    /// 1 if it answers the last response, 2 for the one before, and so on; 0 without any answer.
    age: u64,
    /// How long after the last response it came.
    latency: Duration,
    /// How long after its proper time the response to it was sent.
    due: Duration,
}

struct Session {
    stream: TcpStream,
    incoming: Incoming,
    pace: Duration,
    expander: Expander,
    compressor: Compressor,
    /// The number of responses.
    responses: u64,
    /// When the next response is due, and when the last one was sent.
    due: Instant,
    sent: Instant,
    requests: Vec<Request>,
}

impl Session {
    fn new(stream: TcpStream, pace: Duration) -> Result<Self> {
        stream.set_nodelay(true)?;
        let now = Instant::now();
        Ok(Self {
            stream,
            incoming: Incoming::default(),
            pace,
            expander: Expander::new(),
            compressor: Compressor::new(),
            responses: 0,
            due: now,
            sent: now,
            requests: Vec::new(),
        })
    }

    fn serve(&mut self) -> Result<()> {
        let mut answer = Vec::new();
        loop {
            let (id, size) = self.incoming.read_command(&mut self.stream)?;
            let came = Instant::now();
            answer.clear();
            match CommandId::from_id(id) {
                Some(CommandId::QueryStatus) => answer = status_response(),
                Some(CommandId::ExchangeData | CommandId::ExchangeDataCmpr) => {
                    let duty = self.duty(size)?;
                    self.note(duty, came);
                    self.respond(id, &mut answer)?;
                }
                Some(other) => {
                    self.expander = Expander::new();
                    self.compressor = Compressor::new();
                    other.response().emit(&mut answer);
                }
                None => anyhow::bail!("{id:#x} is not a command"),
            }
            self.stream.write_all(&answer)?;
            self.sent = Instant::now();
        }
    }

    /// The duty of O1 in a request.
    fn duty(&mut self, size: usize) -> Result<u64> {
        let request = &self.incoming.bytes()[..size];
        let duty = if size == ExchangeData::LEN && ExchangeData::parse(request).is_ok() {
            ExchangeData::parse(request)?.duty[0] as u16
        } else {
            let header = CmprHeader::parse_command(&request[..CmprHeader::LEN])?;
            self.expander.expand(&request[CmprHeader::LEN..], REQUEST_WORDS, header.crc)?[0]
        };
        Ok(duty.into())
    }

    fn note(&mut self, duty: u64, came: Instant) {
        let next = self.due + self.pace;
        let late = came.saturating_duration_since(next);
        self.due = next.max(came);
        if self.responses == 0 {
            return;
        }
        let newest = 1 + (self.responses - 1) % VALUES;
        let age = if duty == 0 { 0 } else { (newest + VALUES - duty) % VALUES + 1 };
        self.requests.push(Request { age, latency: came - self.sent, due: late });
    }

    /// Makes the next response when it is due.
    fn respond(&mut self, id: u32, out: &mut Vec<u8>) -> Result<()> {
        let value = 1 + self.responses % VALUES;
        self.responses += 1;
        if id == CommandId::ExchangeData.id() {
            let mut response = ExchangeDataResponse::default();
            response.uni[..2].copy_from_slice(&[value as i16, (value % 2) as i16]);
            response.emit(out);
        } else {
            let mut words = [0; RESPONSE_WORDS];
            words[..2].copy_from_slice(&[value as u16, (value % 2) as u16]);
            let mut data = Vec::new();
            let crc = self.compressor.compress(&words, &mut data);
            let extra_size = u32::try_from(data.len())?;
            CmprHeader { extra_size, crc, active_extensions: 0 }.emit_response(out);
            out.extend(data);
        }
        thread::sleep(self.due.saturating_duration_since(Instant::now()));
        Ok(())
    }
}
