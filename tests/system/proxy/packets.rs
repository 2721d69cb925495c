//! The packets of a connection, and their places in it.

use std::io::{ErrorKind, Read};
use std::net::TcpStream;

use byteorder::{ByteOrder, LittleEndian};
use ft_transfer_area::wire::{
    CmprHeader, CommandId, ExchangeData, ExchangeDataResponse, Expander, QueryStatusResponse,
    StartCameraOnline, StartOnline, UpdateConfig, ID_LEN,
};

/// How many words an area has in a request.
const WORDS: usize = 27;

/// A packet of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    QueryStatus,
    StartOnline,
    UpdateConfig,
    FirstExchange,
    /// A later one.
    Exchange,
    /// A later one that is not compressed.
    SimpleExchange,
    /// UpdateConfig between exchanges.
    NewConfig,
    StartCamera,
    /// The one that stops the motors.
    LastExchange,
    /// StopCameraOnline after the last exchange.
    StopCamera,
    StopOnline,
}

impl Place {
    pub(crate) const HANDSHAKE: &'static [Self] =
        &[Self::QueryStatus, Self::StartOnline, Self::UpdateConfig];
    pub(crate) const RUNNING: &'static [Self] =
        &[Self::FirstExchange, Self::Exchange, Self::NewConfig, Self::StartCamera];
    /// The same, and a simple exchange.
    pub(crate) const RUNNING_EITHER_WAY: &'static [Self] = &[
        Self::FirstExchange,
        Self::Exchange,
        Self::SimpleExchange,
        Self::NewConfig,
        Self::StartCamera,
    ];
    pub(crate) const END: &'static [Self] =
        &[Self::LastExchange, Self::StopCamera, Self::StopOnline];
    pub(crate) const EXCHANGES: &'static [Self] = &[Self::FirstExchange, Self::Exchange];

    pub(crate) fn command(self) -> CommandId {
        match self {
            Self::QueryStatus => CommandId::QueryStatus,
            Self::StartOnline => CommandId::StartOnline,
            Self::UpdateConfig | Self::NewConfig => CommandId::UpdateConfig,
            Self::FirstExchange | Self::Exchange | Self::LastExchange => {
                CommandId::ExchangeDataCmpr
            }
            Self::SimpleExchange => CommandId::ExchangeData,
            Self::StartCamera => CommandId::StartCameraOnline,
            Self::StopCamera => CommandId::StopCameraOnline,
            Self::StopOnline => CommandId::StopOnline,
        }
    }
}

/// Follows the requests of a connection.
pub(crate) struct Tracker {
    exchanges: u64,
    expander: Expander,
    was_on: bool,
    /// Whether the camera was started.
    has_camera: bool,
}

impl Tracker {
    pub(crate) fn new() -> Self {
        Self { exchanges: 0, expander: Expander::new(), was_on: false, has_camera: false }
    }

    /// The place of this request.
    pub(crate) fn place(&mut self, request: &[u8]) -> Option<Place> {
        Some(match command(request)? {
            CommandId::QueryStatus => Place::QueryStatus,
            CommandId::StartOnline => Place::StartOnline,
            CommandId::UpdateConfig if self.exchanges == 0 => Place::UpdateConfig,
            CommandId::UpdateConfig => Place::NewConfig,
            CommandId::StartCameraOnline => {
                self.has_camera = true;
                Place::StartCamera
            }
            CommandId::StopCameraOnline if self.has_camera => Place::StopCamera,
            // For a camera that another program may have left on.
            CommandId::StopCameraOnline => return None,
            CommandId::StopOnline => Place::StopOnline,
            CommandId::ExchangeDataCmpr => {
                self.exchanges += 1;
                let is_on = self.has_duty(request);
                let is_last = self.was_on && !is_on;
                self.was_on = is_on;
                match self.exchanges {
                    _ if is_last => Place::LastExchange,
                    1 => Place::FirstExchange,
                    5.. => Place::Exchange,
                    _ => return None,
                }
            }
            CommandId::ExchangeData => {
                self.exchanges += 1;
                return (self.exchanges >= 5).then_some(Place::SimpleExchange);
            }
        })
    }

    fn has_duty(&mut self, request: &[u8]) -> bool {
        let (header, data) = request.split_at(CmprHeader::LEN);
        let Ok(header) = CmprHeader::parse_command(header) else { return false };
        let areas = 1 + header.active_extensions.count_ones() as usize;
        let words = self.expander.expand(data, areas * WORDS, header.crc);
        words.is_ok_and(|words| words[..8] != [0; 8])
    }
}

fn command(request: &[u8]) -> Option<CommandId> {
    request.get(..ID_LEN).and_then(|id| CommandId::from_id(LittleEndian::read_u32(id)))
}

/// The size of a request that begins with these bytes. With more bytes it may be larger.
fn request_size(start: &[u8]) -> usize {
    match command(start) {
        Some(CommandId::StartOnline) => StartOnline::LEN,
        Some(CommandId::UpdateConfig) => UpdateConfig::LEN,
        Some(CommandId::StartCameraOnline) => StartCameraOnline::LEN,
        Some(CommandId::ExchangeData) => ExchangeData::LEN,
        Some(CommandId::ExchangeDataCmpr) => compressed_size(start),
        _ => ID_LEN,
    }
}

fn compressed_size(start: &[u8]) -> usize {
    let extra = start.get(4..8).filter(|_| start.len() >= CmprHeader::LEN);
    CmprHeader::LEN + extra.map_or(0, |size| LittleEndian::read_u32(size) as usize)
}

/// Reads a request, or `None` at the end.
pub(crate) fn read_request(stream: &mut TcpStream, stops: impl Fn() -> bool) -> Option<Vec<u8>> {
    read(stream, request_size, stops)
}

/// Reads the response to a command.
pub(crate) fn read_response(
    stream: &mut TcpStream,
    request: &[u8],
    stops: impl Fn() -> bool,
) -> Option<Vec<u8>> {
    let size = |start: &[u8]| match command(request) {
        Some(CommandId::QueryStatus) => QueryStatusResponse::LEN,
        Some(CommandId::ExchangeData) => ExchangeDataResponse::LEN,
        Some(CommandId::ExchangeDataCmpr) => compressed_size(start),
        _ => ID_LEN,
    };
    read(stream, size, stops)
}

fn read(
    stream: &mut TcpStream,
    size: impl Fn(&[u8]) -> usize,
    stops: impl Fn() -> bool,
) -> Option<Vec<u8>> {
    let mut packet = Vec::new();
    while packet.len() < size(&packet) {
        let mut rest = vec![0; size(&packet) - packet.len()];
        match stream.read(&mut rest) {
            Ok(0) => return None,
            Ok(count) => packet.extend_from_slice(&rest[..count]),
            Err(error) if is_waiting(&error) && !stops() => {}
            Err(_) => return None,
        }
    }
    Some(packet)
}

/// Whether nothing has arrived yet.
pub(crate) fn is_waiting(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
