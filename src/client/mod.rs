//! One blocking call per command, without a transfer area or a thread.

mod address;
mod connect;
mod connection;
mod find;
mod i2c_line;
mod limits;
mod resolve;
mod response;
#[cfg(test)]
pub(crate) mod scripted;
#[cfg(all(test, unix))]
pub(crate) mod signals;
mod tcp;
#[cfg(test)]
mod tests;
mod transact;
mod transport;
mod watched;

use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

pub(crate) use address::host_and_port;
pub(crate) use connection::Connection;
pub(crate) use find::found_host;
pub use find::{controller_address, find_controllers, SearchOptions, USUAL_HOSTS};
pub(crate) use i2c_line::I2cLine;
use i2c_line::I2cSession;
#[cfg(test)]
pub(crate) use i2c_line::I2C_NAMES;
pub use limits::TimeLimits;
pub(crate) use limits::LIMIT_RANGE;
#[cfg(test)]
pub(crate) use tcp::Tcp;
pub(crate) use tcp::TCP;
pub(crate) use transport::{Addresses, Close, Endpoint, Network, Transport};
#[cfg(test)]
pub(crate) use watched::WaitEnds;

use crate::error::Error;
use crate::exchange::{check_area_count, Exchange, Inputs, Sends};
use crate::transfer_area::{FishX1Transfer, MAX_AREAS};
use crate::wire::{
    CmprHeader, CommandId, ExchangeData, ExchangeDataResponse, QueryStatusResponse,
    StartCameraOnline, StartOnline, UpdateConfig, MAX_EXTRA_SIZE,
};

/// Port of the controller's main connection.
pub const PORT: u16 = 65000;

/// How long after StopCameraOnline the camera may be started again.
///
/// The maker's firmware 4.7.0 (under emulation) checks with each picture whether its camera should end. Started again
/// before that, it has two cameras, and its program ends when they stop.
const CAMERA_PAUSE: Duration = Duration::from_secs(1);

/// The longest response, and one more byte to detect a longer one.
const BUFFER_SIZE: usize = CmprHeader::LEN + MAX_EXTRA_SIZE + 1;

/// A connection to the controller: one blocking call per command.
///
/// For programs that want no transfer area and no thread. Each call sends one command, waits for
/// its response, and returns within the [`TimeLimits`]. Dropping the client closes the
/// connection, which does not stop the motors: send an exchange with all duties 0 first. (The maker's firmware
/// 4.7.0, measured under emulation, clears outputs only at the next StartOnline; whether its I/O board has a
/// watchdog is not known.)
///
/// After an error in talking to the controller, every later call returns the same error; connect
/// again. After [`Error::NotOnline`] and [`Error::AreaCount`] the connection is still usable.
///
/// ```no_run
/// use ft_transfer_area::wire::ExchangeData;
/// use ft_transfer_area::{TimeLimits, TxtClient};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let mut client = TxtClient::connect("192.168.7.2", TimeLimits::default())?;
/// println!("firmware {}", client.query_status()?.version);
/// client.start_online()?;
/// let mut outputs = ExchangeData::default();
/// outputs.duty[0] = 512; // M1 forward
/// let inputs = client.exchange_data(&outputs)?;
/// println!("I1 is {}", inputs.uni[0]);
/// client.exchange_data(&ExchangeData::default())?; // stops M1
/// client.stop_online()?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct TxtClient {
    /// Where its connection leads.
    endpoint: Endpoint,
    /// `None` when it was abandoned.
    connection: Option<Connection>,
    /// How I2C requests reach the controller while it is in online mode.
    i2c: I2cAccess,
    /// When to check next whether the I2C connection needs a request.
    i2c_look: Instant,
    /// `None` when online mode has not begun, or has ended.
    online: Option<I2cSession>,
    /// The error after which the connection can't be used any more.
    broken: Option<Error>,
    /// By extension, the byte of the configuration's id that the firmware has.
    config_ids: [u8; MAX_AREAS],
    /// When the camera was last stopped.
    camera_stopped: Option<Instant>,
    request: Vec<u8>,
    response: Box<[u8; BUFFER_SIZE]>,
}

/// How I2C requests reach the controller of a [`TxtClient`].
#[derive(Clone, Debug)]
pub(crate) struct I2cAccess {
    pub(crate) line: I2cLine,
    pub(crate) port: u16,
    /// Whether the connection is made with StartOnline, and not with the first request. At a port that nobody has
    /// named there may be another server than a controller's.
    pub(crate) at_once: bool,
}

impl TxtClient {
    /// Connects to the controller. Blocks up to `limits.connect`.
    ///
    /// `address` is as for [`builder`](crate::TransferAreaComHandler::builder): a host, with a port behind it unless
    /// that is 65000. The host `auto` means the only controller that is found; the search takes up to 1.5 s more.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for a limit; [`Error::NoController`] or [`Error::SeveralControllers`] for `auto`;
    /// [`Error::BadAddress`], [`Error::HostNotFound`], [`Error::LookupTimedOut`], [`Error::ConnectionRefused`],
    /// [`Error::ConnectTimedOut`], [`Error::ConnectFailed`], or [`Error::ThreadNotStarted`] when no thread
    /// could be started to look up a host name.
    pub fn connect(address: impl ToString, limits: TimeLimits) -> Result<Self, Error> {
        limits.check()?;
        Self::connect_within(&TCP, &address.to_string(), PORT, limits)
    }

    /// Connects with limits that may be shorter than a program's: what is left of another limit.
    pub(crate) fn connect_within(
        network: &'static dyn Network,
        host: &str,
        port: u16,
        limits: TimeLimits,
    ) -> Result<Self, Error> {
        let mut endpoint = Endpoint::new(network, host, port)?;
        endpoint.host = found_host(network, &endpoint.host, endpoint.port, limits.connect)?;
        let connection = Connection::open(&endpoint, limits)?;
        Ok(Self::over(endpoint, connection))
    }

    fn over(endpoint: Endpoint, connection: Connection) -> Self {
        let port = endpoint.port;
        let (line, at_once) = (I2cLine::default(), port == PORT);
        Self {
            endpoint,
            connection: Some(connection),
            i2c: I2cAccess { line, port: port.saturating_add(2), at_once },
            i2c_look: Instant::now(),
            online: None,
            broken: None,
            config_ids: [0; MAX_AREAS],
            camera_stopped: None,
            request: Vec::with_capacity(BUFFER_SIZE),
            response: Box::new([0; BUFFER_SIZE]),
        }
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

    /// Begins online mode: the controller stops a program that runs on it, locks its screen and
    /// resets the compression. Blocks until the response.
    ///
    /// At port 65000 it then connects to the I2C port 65002, which takes 0.3 s at most. Each command holds that
    /// connection open, and [`stop_online`](Self::stop_online) closes it; [`i2c`](Self::i2c) uses it. A controller
    /// without I2C refuses, which is no error. If nobody connects, another StartOnline within 5 s ends the
    /// program of the maker's firmware (4.7.0, measured under emulation), which is away for 2 s then.
    ///
    /// # Errors
    ///
    /// Any error of talking to the controller.
    #[doc(alias = "ftIF2013CommandId_StartOnline")]
    #[doc(alias = "BeginTransfer")]
    pub fn start_online(&mut self) -> Result<(), Error> {
        self.online = None;
        self.command(CommandId::StartOnline, |out| StartOnline::new().emit(out), no_values)?;
        self.config_ids = [0; MAX_AREAS];
        let I2cAccess { line, port, at_once } = &self.i2c;
        let limits = self.connection.as_ref().map(Connection::limits).unwrap_or_default();
        self.online = Some(line.begin(self.other_port(*port), limits, *at_once));
        Ok(())
    }

    /// Hands over the configuration of one controller. Blocks until the response.
    ///
    /// The maker's firmware 4.7.0 (measured under emulation) takes a configuration if the low byte of its id is another
    /// one than before; after StartOnline it is 0. So an id with the same low byte is sent with bit 7 inverted.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "ftIF2013CommandId_UpdateConfig")]
    pub fn update_config(&mut self, update: &UpdateConfig) -> Result<(), Error> {
        self.online(CommandId::UpdateConfig)?;
        let mut update = *update;
        let area = usize::try_from(update.extension_id).ok();
        if let Some(sent) = area.and_then(|area| self.config_ids.get_mut(area)) {
            if update.config_id as u8 == *sent {
                update.config_id ^= 0x80;
            }
            *sent = update.config_id as u8;
        }
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

    /// One exchange between the areas and the controller: sends the configurations that have
    /// changed, then the outputs, and writes the inputs into the areas. Blocks until the
    /// response, which the controller sends 10 ms after its previous one.
    ///
    /// This is the C samples' `DoTransfer`, for programs with a loop of their own. It also sets each
    /// area's [`id`](crate::transfer_area::State::id) to its index. If the program uses the master's
    /// timers, it sets them with [`Timer::set_elapsed`](crate::transfer_area::Timer::set_elapsed).
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), [`Error::AreaCount`], and
    /// any error of talking to the controller; then the areas' inputs do not change.
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
        for (id, area) in (0..).zip(areas.iter_mut()) {
            area.state.id = id;
        }
        self.update_configs(exchange, areas, || true)?;
        self.exchange(exchange, areas)?.apply(areas);
        Ok(())
    }

    /// Hands over the configurations that have changed, as long as it `goes_on`; returns how many there were.
    pub(crate) fn update_configs(
        &mut self,
        exchange: &mut Exchange,
        areas: &[impl Sends],
        goes_on: impl Fn() -> bool,
    ) -> Result<u64, Error> {
        let mut count = 0;
        while let Some(update) = exchange.next_config(areas, &goes_on) {
            self.update_config(&update)?;
            count += 1;
        }
        Ok(count)
    }

    /// Exchanges the areas' outputs for inputs.
    pub(crate) fn exchange<'a>(
        &mut self,
        exchange: &'a mut Exchange,
        areas: &[impl Sends],
    ) -> Result<&'a Inputs, Error> {
        let command = exchange.command();
        self.online(command)?;
        exchange.request_of(areas, &mut self.request)?;
        let size = self.transact(command)?;
        exchange.receive(&self.response[..size]).map_err(|error| self.broken(error))
    }

    /// Starts the camera server on the controller, without reading frames; see
    /// [`start_camera`](Self::start_camera) for both. The server is ready 1 to 2 s after the response. Its
    /// frames come over a connection of their own, each after a
    /// [`CameraFrameHeader`](crate::wire::CameraFrameHeader).
    /// Blocks until the response; within a second after [`stop_camera_online`](Self::stop_camera_online) it waits before
    /// the command is sent, because the maker's firmware 4.7.0 (measured under emulation) needs that time to stop.
    ///
    /// # Errors
    ///
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "ftIF2013CommandId_StartCameraOnline")]
    pub fn start_camera_online(&mut self, start: &StartCameraOnline) -> Result<(), Error> {
        let command = CommandId::StartCameraOnline;
        self.online(command)?;
        if let Some(pause) = self.camera_pause() {
            thread::sleep(pause);
        }
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
        self.camera_stopped = Some(Instant::now());
        self.command(command, |out| command.emit(out), no_values)
    }

    /// How long the camera must wait until it can be started; `None` if it was not stopped over this connection.
    pub(crate) fn camera_pause(&self) -> Option<Duration> {
        Some(CAMERA_PAUSE.saturating_sub(self.camera_stopped?.elapsed()))
    }

    /// Ends online mode. Blocks until the response. It does not stop the motors of the maker's firmware 4.7.0
    /// (measured under emulation): send an exchange with all duties 0 first. The I2C connection is closed before
    /// the command is sent.
    ///
    /// # Errors
    ///
    /// Any error of talking to the controller.
    #[doc(alias = "ftIF2013CommandId_StopOnline")]
    #[doc(alias = "EndTransfer")]
    pub fn stop_online(&mut self) -> Result<(), Error> {
        self.online = None;
        let command = CommandId::StopOnline;
        self.command(command, |out| command.emit(out), no_values)
    }

    pub(crate) fn i2c_access(&self) -> &I2cAccess {
        &self.i2c
    }

    /// Another way for I2C requests, from the next StartOnline on.
    #[cfg_attr(all(test, shuttle), allow(dead_code, reason = "the models have their own client"))]
    pub(crate) fn set_i2c_access(&mut self, access: I2cAccess) {
        self.i2c = access;
    }

    /// The controller's address, with its main port, unless the connection is lost already.
    pub fn address(&self) -> Option<SocketAddr> {
        self.connection.as_ref().and_then(Connection::peer)
    }

    /// Another port of the controller to which this is connected: at that one of the host's addresses which has
    /// answered.
    pub(crate) fn other_port(&self, port: u16) -> Endpoint {
        let Endpoint { network, host, .. } = &self.endpoint;
        match self.address() {
            Some(address) => Endpoint::at(*network, address, port),
            None => Endpoint { network: *network, host: host.clone(), port },
        }
    }

    /// Returns the error that broke the connection.
    fn usable(&self) -> Result<(), Error> {
        self.broken.clone().map_or(Ok(()), Err)
    }

    /// Returns an error when the connection is broken or not in online mode.
    pub(crate) fn online(&self, command: CommandId) -> Result<(), Error> {
        self.usable()?;
        if self.online.is_some() {
            Ok(())
        } else {
            Err(Error::NotOnline { command: command.name() })
        }
    }
}

/// For a response that has only an id, which was checked when it came in.
fn no_values(_response: &[u8]) -> Result<(), Error> {
    Ok(())
}
