//! One blocking call per command, no transfer area and no thread.

mod connect;

use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Shutdown, TcpStream};
use std::time::{Duration, Instant};

pub use connect::TimeLimits;
pub(crate) use connect::{connect_to, io_error, SHORTEST_LIMIT};

use crate::error::Error;
use crate::exchange::{check_area_count, Exchange, Inputs};
use crate::transfer_area::FishX1Transfer;
use crate::wire::{
    CmprHeader, CommandId, ExchangeData, ExchangeDataResponse, QueryStatusResponse, ResponseId,
    StartCameraOnline, StartOnline, UpdateConfig, ID_LEN, MAX_EXTRA_SIZE,
};

/// Port of the controller's main connection.
pub const PORT: u16 = 65000;

/// How long a failing connection may take to say its last words.
const FAREWELL_LIMIT: Duration = Duration::from_millis(500);

/// The longest response, and a byte more by which a longer one shows.
const BUFFER_SIZE: usize = CmprHeader::LEN + MAX_EXTRA_SIZE + 1;

/// A connection to the controller: one blocking call per command.
///
/// For programs that want no transfer area and no thread. Each call sends one command, waits for
/// its response, and returns within the [`TimeLimits`]. Dropping the client closes the
/// connection, upon which the controller stops its motors.
///
/// After an error that came while talking to the controller, every later call returns the same
/// error; connect anew. [`Error::NotOnline`] and [`Error::AreaCount`] leave the connection as it
/// was.
///
/// ```no_run
/// use ft_transfer_area::wire::ExchangeData;
/// use ft_transfer_area::{TimeLimits, TxtClient, PORT};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let mut client = TxtClient::connect("192.168.7.2", PORT, TimeLimits::default())?;
/// println!("firmware {}", client.query_status()?.version);
/// client.start_online()?;
/// let mut outputs = ExchangeData::default();
/// outputs.duty[0] = 512; // M1 forward
/// let inputs = client.exchange_data(&outputs)?;
/// println!("I1 is {}", inputs.uni[0]);
/// client.stop_online()?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct TxtClient {
    stream: TcpStream,
    limits: TimeLimits,
    online: bool,
    /// The error after which the connection is of no further use.
    broken: Option<Error>,
    request: Vec<u8>,
    response: Box<[u8; BUFFER_SIZE]>,
}

impl TxtClient {
    /// Connects to the controller. Blocks up to `limits.connect` for each address of the host.
    ///
    /// `host` is a name or a numeric address; `port` is [`PORT`] for a real controller.
    ///
    /// # Errors
    ///
    /// [`Error::HostNotFound`], [`Error::ConnectionRefused`], [`Error::ConnectTimedOut`] or
    /// [`Error::ConnectFailed`].
    pub fn connect(host: &str, port: u16, limits: TimeLimits) -> Result<Self, Error> {
        let limits = TimeLimits {
            connect: limits.connect.max(SHORTEST_LIMIT),
            read: limits.read.max(SHORTEST_LIMIT),
            write: limits.write.max(SHORTEST_LIMIT),
        };
        let stream = connect::connect(host, port, limits.connect)?;
        stream
            .set_nodelay(true)
            .and_then(|()| stream.set_read_timeout(Some(limits.read)))
            .and_then(|()| stream.set_write_timeout(Some(limits.write)))
            .map_err(|error| Error::ConnectFailed {
                address: format!("{host}:{port}"),
                reason: error.to_string(),
            })?;
        Ok(Self {
            stream,
            limits,
            online: false,
            broken: None,
            request: Vec::with_capacity(BUFFER_SIZE),
            response: Box::new([0; BUFFER_SIZE]),
        })
    }

    /// Asks for the controller's name and firmware version. Blocks until the response.
    ///
    /// # Errors
    ///
    /// Any error of talking to the controller.
    #[doc(alias = "ftIF2013CommandId_QueryStatus")]
    #[doc(alias = "GetVersion")]
    pub fn query_status(&mut self) -> Result<QueryStatusResponse, Error> {
        let command = CommandId::QueryStatus;
        self.command(command, |out| command.emit(out), QueryStatusResponse::parse)
    }

    /// Begins online mode: a program running on the controller is stopped, its screen locked,
    /// and the compression reset. Blocks until the response.
    ///
    /// # Errors
    ///
    /// Any error of talking to the controller.
    #[doc(alias = "ftIF2013CommandId_StartOnline")]
    pub fn start_online(&mut self) -> Result<(), Error> {
        self.command(CommandId::StartOnline, |out| StartOnline::new().emit(out), no_values)?;
        self.online = true;
        Ok(())
    }

    /// Hands over the configuration of one controller. Blocks until the response.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "ftIF2013CommandId_UpdateConfig")]
    pub fn update_config(&mut self, update: &UpdateConfig) -> Result<(), Error> {
        self.online(CommandId::UpdateConfig)?;
        self.command(CommandId::UpdateConfig, |out| update.emit(out), no_values)
    }

    /// Exchanges the master's outputs for its inputs, not compressed. Blocks until the response,
    /// which the controller sends 10 ms after its previous one.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "ftIF2013CommandId_ExchangeData")]
    pub fn exchange_data(&mut self, outputs: &ExchangeData) -> Result<ExchangeDataResponse, Error> {
        let command = CommandId::ExchangeData;
        self.online(command)?;
        self.command(command, |out| outputs.emit(out), ExchangeDataResponse::parse)
    }

    /// One cycle between the areas and the controller: sends the configurations that have
    /// changed, then the outputs, and writes the inputs into the areas. Blocks until the
    /// response, which the controller sends 10 ms after its previous one.
    ///
    /// This is the C samples' `DoTransfer`, for programs with a loop of their own. Set the
    /// master's timers with [`Timer::set_elapsed`](crate::transfer_area::Timer::set_elapsed), if
    /// the program uses them.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), [`Error::AreaCount`], and
    /// any error of talking to the controller; the areas' inputs then stay as they were.
    #[doc(alias = "DoTransfer")]
    #[doc(alias = "DoTransferCompressed")]
    #[doc(alias = "DoTransferSimple")]
    pub fn do_transfer(
        &mut self,
        exchange: &mut Exchange,
        areas: &mut [FishX1Transfer],
    ) -> Result<(), Error> {
        // Before a configuration counts as sent.
        self.online(exchange.command())?;
        check_area_count(areas.len())?;
        self.update_configs(exchange, areas)?;
        self.exchange(exchange, areas)?.apply(areas);
        Ok(())
    }

    /// Hands over the configurations that have changed; returns how many there were.
    pub(crate) fn update_configs(
        &mut self,
        exchange: &mut Exchange,
        areas: &[FishX1Transfer],
    ) -> Result<u64, Error> {
        let mut count = 0;
        while let Some(update) = exchange.next_update_config(areas) {
            self.update_config(&update)?;
            count += 1;
        }
        Ok(count)
    }

    /// Exchanges the areas' outputs for inputs.
    pub(crate) fn exchange<'a>(
        &mut self,
        exchange: &'a mut Exchange,
        areas: &[FishX1Transfer],
    ) -> Result<&'a Inputs, Error> {
        let command = exchange.command();
        self.online(command)?;
        exchange.request(areas, &mut self.request)?;
        let size = self.transact(command)?;
        exchange.receive(&self.response[..size]).map_err(|error| self.broken(error))
    }

    /// Starts the camera server on the controller, which takes 1 to 2 s after the response. Its
    /// frames come over a connection of their own, each behind a
    /// [`CameraFrameHeader`](crate::wire::CameraFrameHeader).
    /// Blocks until the response.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "ftIF2013CommandId_StartCameraOnline")]
    pub fn start_camera_online(&mut self, start: &StartCameraOnline) -> Result<(), Error> {
        let command = CommandId::StartCameraOnline;
        self.online(command)?;
        self.command(command, |out| start.emit(out), no_values)
    }

    /// Stops the camera server. Blocks until the response.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "ftIF2013CommandId_StopCameraOnline")]
    pub fn stop_camera_online(&mut self) -> Result<(), Error> {
        let command = CommandId::StopCameraOnline;
        self.online(command)?;
        self.command(command, |out| command.emit(out), no_values)
    }

    /// Ends online mode; the controller stops its motors. Blocks until the response.
    ///
    /// # Errors
    ///
    /// Any error of talking to the controller.
    #[doc(alias = "ftIF2013CommandId_StopOnline")]
    pub fn stop_online(&mut self) -> Result<(), Error> {
        let command = CommandId::StopOnline;
        self.command(command, |out| command.emit(out), no_values)?;
        self.online = false;
        Ok(())
    }

    /// Leaves a connection on which something went wrong: sends this request and StopOnline
    /// whatever came before, so that the controller hears it if it can hear anything. Errors are
    /// of no interest any more. Blocks for half a second at most for each direction.
    pub(crate) fn abandon(&mut self, last_request: &[u8]) {
        let deadline = Instant::now() + FAREWELL_LIMIT;
        let mut farewell = last_request.to_vec();
        CommandId::StopOnline.emit(&mut farewell);
        let _ = self.stream.set_write_timeout(Some(FAREWELL_LIMIT));
        if self.stream.write_all(&farewell).is_err() {
            return;
        }
        let _ = self.stream.shutdown(Shutdown::Write);
        // Closing with unread bytes would reset the connection, and the controller might never
        // read what was just sent. So read until it has closed its side.
        while let Some(rest) = deadline.checked_duration_since(Instant::now()) {
            let _ = self.stream.set_read_timeout(Some(rest.max(SHORTEST_LIMIT)));
            if !matches!(self.stream.read(&mut self.response[..]), Ok(1..)) {
                return;
            }
        }
    }

    /// The controller's address, unless the connection is lost already.
    pub(crate) fn address(&self) -> Option<IpAddr> {
        self.stream.peer_addr().ok().map(|address| address.ip())
    }

    /// Errs with what broke the connection.
    fn usable(&self) -> Result<(), Error> {
        self.broken.clone().map_or(Ok(()), Err)
    }

    /// Errs when the connection is broken or not in online mode.
    fn online(&self, command: CommandId) -> Result<(), Error> {
        self.usable()?;
        if self.online {
            Ok(())
        } else {
            Err(Error::NotOnline { command: command.name() })
        }
    }

    /// Notes the error after which the connection is of no further use.
    fn broken(&mut self, error: Error) -> Error {
        self.broken = Some(error.clone());
        error
    }

    /// Sends one command and reads its response.
    fn command<T>(
        &mut self,
        command: CommandId,
        emit: impl FnOnce(&mut Vec<u8>),
        parse: impl FnOnce(&[u8]) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.usable()?;
        self.request.clear();
        emit(&mut self.request);
        let size = self.transact(command)?;
        parse(&self.response[..size]).map_err(|error| self.broken(error))
    }

    /// Sends what is in `request` and reads the response; returns its size.
    fn transact(&mut self, command: CommandId) -> Result<usize, Error> {
        let result = self
            .stream
            .write_all(&self.request)
            .map_err(|error| io_error(command.name(), &error, 0))
            .and_then(|()| self.read_response(command));
        result.map_err(|error| self.broken(error))
    }

    /// Reads one whole response into `response` and returns its size.
    fn read_response(&mut self, command: CommandId) -> Result<usize, Error> {
        let deadline = Instant::now().checked_add(self.limits.read);
        let mut received = 0;
        let mut shortened = false;
        let size = loop {
            if let Some(size) = response_size(command, &self.response[..received])? {
                if received >= size {
                    break size;
                }
            }
            if received > 0 {
                // The limit is for the whole response, not for each piece of it.
                let rest =
                    deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
                if rest == Some(Duration::ZERO) {
                    return Err(self.no_answer(command, received));
                }
                self.set_read_limit(command, rest.unwrap_or(self.limits.read))?;
                shortened = true;
            }
            received += match self.stream.read(&mut self.response[received..]) {
                Ok(0) => return Err(Error::ConnectionClosed { command: command.name(), received }),
                Ok(count) => count,
                Err(error) => match error.kind() {
                    ErrorKind::Interrupted => 0,
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                        return Err(self.no_answer(command, received));
                    }
                    _ => return Err(io_error(command.name(), &error, received)),
                },
            };
        };
        if shortened {
            self.set_read_limit(command, self.limits.read)?;
        }
        if received > size {
            let packet = command.response().name();
            return Err(Error::WrongSize { packet, expected: size, found: received });
        }
        Ok(size)
    }

    fn set_read_limit(&self, command: CommandId, limit: Duration) -> Result<(), Error> {
        self.stream
            .set_read_timeout(Some(limit.max(SHORTEST_LIMIT)))
            .map_err(|error| io_error(command.name(), &error, 0))
    }

    fn no_answer(&self, command: CommandId, received: usize) -> Error {
        Error::NoAnswer { command: command.name(), limit: self.limits.read, received }
    }
}

/// The size of a response of which the first bytes have come in, once they tell it.
fn response_size(command: CommandId, start: &[u8]) -> Result<Option<usize>, Error> {
    let response = command.response();
    if start.len() < ID_LEN {
        return Ok(None);
    }
    response.check(start)?;
    Ok(match response {
        ResponseId::QueryStatus => Some(QueryStatusResponse::LEN),
        ResponseId::ExchangeData => Some(ExchangeDataResponse::LEN),
        ResponseId::ExchangeDataCmpr => match start.get(..CmprHeader::LEN) {
            Some(header) => {
                let header = CmprHeader::parse_response(header)?;
                Some(CmprHeader::LEN + header.extra_size as usize)
            }
            None => None,
        },
        ResponseId::StartOnline
        | ResponseId::UpdateConfig
        | ResponseId::StopOnline
        | ResponseId::StartCameraOnline
        | ResponseId::StopCameraOnline => Some(ID_LEN),
    })
}

/// What there is to read in a response that is its id alone, which was checked on the way in.
fn no_values(_response: &[u8]) -> Result<(), Error> {
    Ok(())
}
