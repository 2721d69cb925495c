//! The I2C calls of the TX: their flags, and a thread that carries them out over [`I2cClient`].
//!
//! It knows neither hooks nor handles: a request goes in, its value and status come back through a closure
//! that runs in the thread.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender, TrySendError};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use ft_transfer_area::{Error, I2cClient};

use crate::errors::{
    FTLIB_ERR_FAILED, FTLIB_ERR_NO_MEMORY, FTLIB_I2C_C_INVALID_FLAGS_ADDRMODE,
    FTLIB_I2C_C_INVALID_FLAGS_DATAMODE, FTLIB_I2C_C_INVALID_FLAGS_ERRMODE,
    FTLIB_I2C_INVALID_DEV_ADDR,
};
use crate::process;
use crate::report;

/// `I2C_SUCCESS`.
pub(crate) const I2C_SUCCESS: u16 = 0;
/// `I2C_READ_ERROR`.
pub(crate) const I2C_READ_ERROR: u16 = 1;
/// `I2C_WRITE_ERROR`.
pub(crate) const I2C_WRITE_ERROR: u16 = 2;

/// The highest address of a device.
pub(crate) const DEVICE_MAX: u8 = 127;
/// The TX's own EEPROM.
const EEPROM: [u8; 2] = [80, 84];
/// How many requests may wait.
const WAITING: usize = 256;
/// How often a request is repeated when it may be repeated up to 10 times.
const REPEATS: u32 = 10;
/// The pause before a request is repeated.
const PAUSE: Duration = Duration::from_millis(5);
/// How long the end waits for a request that is on its way.
const END_LIMIT: Duration = Duration::from_secs(1);

/// What is called at the end of a request: its value and one of `I2C_…`.
pub(crate) type Done = Box<dyn FnOnce(u16, u16) + Send>;

/// Whether a request is still to be carried out: it is for the controller of its transfer.
pub(crate) type IsValid = Box<dyn Fn() -> bool + Send>;

/// What to do with a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// Reads a value.
    Read,
    /// Writes this value.
    Write(u16),
}

/// A request whose flags are right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Request {
    device: u8,
    /// The address inside the device, and the value to write.
    write: Vec<u8>,
    access: Access,
    width: Width,
    /// `None` for as often as needed.
    repeats: Option<u32>,
}

/// How a number lies on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Width {
    None,
    Byte,
    HighFirst,
    LowFirst,
}

impl Width {
    fn of(bits: u8) -> Self {
        match bits & 3 {
            0 => Self::None,
            1 => Self::Byte,
            2 => Self::HighFirst,
            _ => Self::LowFirst,
        }
    }

    fn bytes(self, number: u16) -> Vec<u8> {
        match self {
            Self::None => Vec::new(),
            Self::Byte => vec![number as u8],
            Self::HighFirst => number.to_be_bytes().to_vec(),
            Self::LowFirst => number.to_le_bytes().to_vec(),
        }
    }

    fn number(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::None => 0,
            Self::Byte => bytes[0].into(),
            Self::HighFirst => u16::from_be_bytes(bytes),
            Self::LowFirst => u16::from_le_bytes(bytes),
        }
    }

    fn max(self) -> u32 {
        match self {
            // There is no address, and what is given for it does not matter.
            Self::None => u32::MAX,
            Self::Byte => u8::MAX.into(),
            Self::HighFirst | Self::LowFirst => u16::MAX.into(),
        }
    }
}

impl Request {
    /// Checks device, flags and offset.
    ///
    /// Bit 4, which keeps the bus between two requests, needs nothing: requests are carried out one after
    /// another. Bit 7, the clock, is the controller's affair: the protocol has no field for it.
    ///
    /// # Errors
    ///
    /// The code that the call returns at once.
    pub(crate) fn new(device: u8, offset: u32, protocol: u8, access: Access) -> Result<Self, u32> {
        if device > DEVICE_MAX || EEPROM.contains(&device) {
            return Err(FTLIB_I2C_INVALID_DEV_ADDR);
        }
        let (address, width) = (Width::of(protocol), Width::of(protocol >> 2));
        if offset > address.max() {
            return Err(FTLIB_I2C_C_INVALID_FLAGS_ADDRMODE);
        }
        if width == Width::None {
            return Err(FTLIB_I2C_C_INVALID_FLAGS_DATAMODE);
        }
        let repeats = match protocol >> 5 & 3 {
            0 => Some(0),
            1 => Some(REPEATS),
            2 => None,
            _ => return Err(FTLIB_I2C_C_INVALID_FLAGS_ERRMODE),
        };
        let mut write = address.bytes(offset as u16);
        if let Access::Write(value) = access {
            write.extend(width.bytes(value));
        }
        Ok(Self { device, write, access, width, repeats })
    }

    /// Carries it out, and returns the value.
    fn perform(&self, client: &mut I2cClient) -> Result<u16, Error> {
        let mut bytes = [0; 2];
        let read = match (self.access, self.width) {
            (Access::Write(value), _) => {
                client.write_read(self.device, &self.write, &mut [])?;
                return Ok(value);
            }
            (Access::Read, Width::Byte) => &mut bytes[..1],
            (Access::Read, _) => &mut bytes[..],
        };
        client.write_read(self.device, &self.write, read)?;
        Ok(self.width.number(bytes))
    }

    /// The status for the program.
    fn status(&self, is_done: bool) -> u16 {
        match self.access {
            _ if is_done => I2C_SUCCESS,
            Access::Read => I2C_READ_ERROR,
            Access::Write(_) => I2C_WRITE_ERROR,
        }
    }
}

/// Whether an error may have come from the bus. How a real controller reports such errors is not known. Other
/// errors do not go away when the request is repeated.
fn is_of_the_bus(error: &Error) -> bool {
    !matches!(
        error,
        Error::OutOfRange { .. }
            | Error::BadAddress { .. }
            | Error::NoController { .. }
            | Error::SeveralControllers { .. }
            | Error::HostNotFound { .. }
            | Error::LookupTimedOut { .. }
            | Error::ConnectionRefused { .. }
            | Error::ConnectTimedOut { .. }
            | Error::ConnectFailed { .. }
            | Error::ThreadNotStarted { .. }
    )
}

/// The thread that carries out the requests for one controller, in their order.
pub(crate) struct I2cThread {
    /// `None` when it ends.
    requests: Option<SyncSender<(Request, IsValid, Done)>>,
    ending: Arc<AtomicBool>,
    /// Closed when the thread has ended.
    ended: Receiver<()>,
    thread: Option<JoinHandle<()>>,
}

impl I2cThread {
    /// Starts the thread, which connects at its first request. What goes wrong is said of this host.
    ///
    /// # Errors
    ///
    /// `FTLIB_ERR_FAILED` when the thread could not be started.
    pub(crate) fn start(
        host: &str,
        connect: impl FnMut() -> Result<I2cClient, Error> + Send + 'static,
    ) -> Result<Self, u32> {
        let (requests, waiting) = mpsc::sync_channel(WAITING);
        let (alive, ended) = mpsc::channel();
        let ending = Arc::new(AtomicBool::new(false));
        let mut worker = Worker {
            host: host.to_owned(),
            connect,
            client: None,
            ending: Arc::clone(&ending),
            _alive: alive,
        };
        process::begin();
        let thread = thread::Builder::new().name("ft/i2c".into());
        let thread = thread.spawn(move || worker.run(&waiting)).map_err(|error| {
            log::error!("no thread for I2C could be started: {error}");
            FTLIB_ERR_FAILED
        })?;
        Ok(Self { requests: Some(requests), ending, ended, thread: Some(thread) })
    }

    /// Has a request carried out, unless it is no longer valid then. Returns at once; `done` is called later, by the
    /// thread, unless the thread is asked to end before.
    ///
    /// # Errors
    ///
    /// `FTLIB_ERR_NO_MEMORY` when too many requests are waiting, `FTLIB_ERR_FAILED` when the thread has ended.
    pub(crate) fn request(
        &self,
        request: Request,
        is_valid: IsValid,
        done: Done,
    ) -> Result<(), u32> {
        let requests = self.requests.as_ref().ok_or(FTLIB_ERR_FAILED)?;
        requests.try_send((request, is_valid, done)).map_err(|error| match error {
            TrySendError::Full(_) => FTLIB_ERR_NO_MEMORY,
            TrySendError::Disconnected(_) => FTLIB_ERR_FAILED,
        })
    }
}

/// Gives up what waits. Blocks until the request on its way is answered, at most for a second; after that
/// the thread ends by itself.
impl Drop for I2cThread {
    fn drop(&mut self) {
        self.ending.store(true, Ordering::Release);
        drop(self.requests.take());
        let Some(thread) = self.thread.take() else { return };
        if thread.thread().id() == thread::current().id() {
            return;
        }
        let ended = self.ended.recv_timeout(END_LIMIT);
        if ended == Err(mpsc::RecvTimeoutError::Disconnected) && thread.join().is_err() {
            log::error!("the thread for I2C panicked");
        }
    }
}

struct Worker<C> {
    host: String,
    connect: C,
    client: Option<I2cClient>,
    ending: Arc<AtomicBool>,
    _alive: mpsc::Sender<()>,
}

impl<C: FnMut() -> Result<I2cClient, Error>> Worker<C> {
    fn run(&mut self, waiting: &Receiver<(Request, IsValid, Done)>) {
        while let Ok((request, is_valid, done)) = waiting.recv() {
            let result = self.repeat(&request, &is_valid);
            if self.is_ending() {
                return;
            }
            if let Err(why) = &result {
                report::warning(format_args!("{}, I2C: {why}", self.host));
            }
            done(*result.as_ref().unwrap_or(&0), request.status(result.is_ok()));
        }
    }

    /// Carries out a request, and repeats it as its flags say, as long as it is valid. An error is a sentence.
    fn repeat(&mut self, request: &Request, is_valid: &IsValid) -> Result<u16, String> {
        let mut repeats = request.repeats;
        loop {
            // A transfer does not end and another one begin before the next line is done.
            if !is_valid() {
                return Err("the transfer has ended in which this was requested".to_owned());
            }
            let result = self.perform(request);
            let repeatable = result.as_ref().err().is_some_and(is_of_the_bus);
            if !repeatable || repeats == Some(0) || self.is_ending() {
                return result.map_err(|error| format!("{error:#}"));
            }
            repeats = repeats.map(|repeats| repeats - 1);
            thread::sleep(PAUSE);
        }
    }

    fn perform(&mut self, request: &Request) -> Result<u16, Error> {
        let client = match &mut self.client {
            Some(client) => client,
            none => none.insert((self.connect)()?),
        };
        request.perform(client)
    }

    fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire)
    }
}

#[cfg(test)]
mod tests;
