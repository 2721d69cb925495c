//! The one error type of the crate.

mod io_error;
mod message;
mod origin;

use std::any::Any;
use std::fmt;
use std::io;
use std::ops::RangeInclusive;
use std::time::Duration;

pub use io_error::IoError;
pub(crate) use origin::Origin;

use crate::firmware::FirmwareVersion;
use crate::found::{FoundController, TriedAddress};
use crate::tx::InvalidCall;

/// What can go wrong between a program and its controller.
///
/// Every message is a sentence that says what happened and what to check. The
/// [`source`](std::error::Error::source) is the operating system's error or the error that led to this one, if
/// any. `{}` is the sentence alone; `{:#}` has what led to it, too, as with the crate `anyhow`. So has `{:?}`, because
/// Rust prints it when `main` returns an error:
///
/// ```
/// use std::io;
/// use ft_transfer_area::Error;
///
/// let cause = io::Error::other("too many threads").into();
/// let error = Error::ThreadNotStarted { cause };
/// assert!(error.to_string().starts_with("the operating system could not start a thread; check how many"));
/// assert!(format!("{error:#}").ends_with("may have: too many threads"));
/// assert_eq!(format!("{error:?}"), format!("{error:#}"));
/// ```
///
/// After an error in talking to the controller the connection can't be used any more: a
/// [`TxtClient`](crate::TxtClient) returns the same error for every later call, and a
/// [`TransferAreaComHandler`](crate::TransferAreaComHandler) until the next `begin_transfer`;
/// an [`I2cClient`](crate::I2cClient) connects again at its next call.
/// The errors that leave the connection usable say so, and so do those after which a transfer goes on.
#[doc(alias = "FtErrors")]
#[doc(alias = "ftxGetLibErrorString")]
#[derive(Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A number of transfer areas outside 1..=9. Nothing was sent.
    AreaCount {
        /// How many areas were asked for.
        given: usize,
    },
    /// An argument is out of its range. Nothing was changed, and nothing sent.
    #[doc(alias = "FTLIB_ERR_INVALID_PARAM")]
    OutOfRange {
        /// What the number is for.
        what: &'static str,
        /// What was given.
        given: i64,
        /// The lowest number allowed.
        least: i64,
        /// The highest number allowed.
        most: i64,
    },
    /// A call of [`tx`](crate::tx) was refused. Nothing was changed, and nothing sent.
    #[doc(alias = "FTLIB_ERR_INVALID_PARAM")]
    InvalidCall(InvalidCall),
    /// `begin_transfer` was called while a transfer is running. That transfer goes on.
    #[doc(alias = "FTLIB_ERR_THREAD_IS_RUNNING")]
    AlreadyStarted,
    /// The call needs a running transfer, and there is none: call `begin_transfer` first.
    #[doc(alias = "FTLIB_ERR_THREAD_NOT_RUNNING")]
    NotStarted,
    /// The command needs online mode: call `start_online` first; or an I2C request needs a transfer that runs. The
    /// connection stays usable.
    NotOnline {
        /// The command that was refused.
        command: &'static str,
    },
    /// What a call waited for did not happen within its time limit. The transfer goes on.
    WaitTimedOut {
        /// The limit that was given.
        limit: Duration,
    },

    /// The controller's address is wrong: the host is missing, or no port follows the colon. Nothing was
    /// sent.
    BadAddress {
        /// What was given.
        given: String,
    },
    /// No controller was found, by the host `auto` or by
    /// [`find_controllers`](crate::find_controllers). Nothing was started. The only error that prints several
    /// lines: after its sentence one for each address, and what to check.
    NoController {
        /// The addresses that were tried, and what happened there.
        tried: Vec<TriedAddress>,
    },
    /// The host `auto` means the only controller, and there are several, or there may be. Nothing was started.
    SeveralControllers {
        /// Those that answered.
        found: Vec<FoundController>,
        /// Where another one is perhaps in use by a program, so that it does not answer.
        in_use: Vec<TriedAddress>,
    },
    /// The host name has no address.
    HostNotFound {
        /// The name as it was given.
        host: String,
        /// What the operating system said.
        cause: IoError,
    },
    /// The addresses of the host name were not found within the time limit for connecting.
    LookupTimedOut {
        /// The name as it was given.
        host: String,
        /// The limit that was set.
        limit: Duration,
    },
    /// The host answered that nothing listens on this port.
    ConnectionRefused {
        /// Host and port.
        address: String,
    },
    /// The host did not answer within the time limit for connecting, or within its address's share
    /// of it when the host has several.
    ConnectTimedOut {
        /// Host and port.
        address: String,
        /// The limit that was set.
        limit: Duration,
    },
    /// The connection could not be made for another reason.
    ConnectFailed {
        /// Host and port.
        address: String,
        /// What the operating system said.
        cause: IoError,
    },

    /// The controller did not take a command within the time limit for writing.
    NotTaken {
        /// The command.
        command: &'static str,
        /// The limit that was set.
        limit: Duration,
    },
    /// The controller did not answer a command within the time limit for reading.
    NoAnswer {
        /// The command.
        command: &'static str,
        /// The limit that was set.
        limit: Duration,
        /// How many bytes of the response had come in.
        received: usize,
    },
    /// The controller closed the connection instead of sending a response.
    ConnectionClosed {
        /// The command.
        command: &'static str,
        /// How many bytes of the response had come in.
        received: usize,
    },
    /// A command could not be sent, or its response could not be read.
    Io {
        /// The command.
        command: &'static str,
        /// What the operating system said.
        cause: IoError,
    },

    /// A packet starts with another id than the expected one.
    WrongId {
        /// The packet that was expected.
        packet: &'static str,
        /// Its id.
        expected: u32,
        /// The id that came.
        found: u32,
    },
    /// A packet has a wrong size for its kind.
    WrongSize {
        /// The packet.
        packet: &'static str,
        /// Its size in bytes.
        expected: usize,
        /// How many bytes came.
        found: usize,
    },
    /// A packet announces more data than the limit allows.
    TooLarge {
        /// The packet.
        packet: &'static str,
        /// The announced number of bytes.
        announced: u32,
        /// The limit.
        limit: usize,
    },
    /// Compressed data ends before all words are there.
    DataEndsEarly {
        /// How many words were expected.
        expected: usize,
        /// How many the data held.
        found: usize,
    },
    /// The checksum of the expanded data differs from the announced one.
    WrongCrc {
        /// The checksum announced in the packet.
        announced: u32,
        /// The checksum of what came.
        computed: u32,
    },
    /// The controller's firmware is too old for this crate.
    FirmwareTooOld {
        /// The controller's version.
        found: FirmwareVersion,
        /// The oldest supported version.
        required: FirmwareVersion,
    },

    /// `start_camera` was called while the camera is started. The camera goes on.
    CameraAlreadyStarted,
    /// The camera announces a frame of an implausible size.
    FrameSize {
        /// The announced number of bytes.
        announced: i32,
        /// The limit that was set.
        limit: usize,
    },
    /// A frame can't be repaired or decoded. The next one may be fine.
    BadPicture {
        /// What is wrong with it.
        reason: String,
    },

    /// No I2C device answers at this address. The connection stays usable.
    ///
    /// The maker's firmware 4.7.0 also reports a transfer that has failed on the bus in this way (measured under
    /// emulation).
    I2cNoDevice {
        /// The 7-bit address.
        device: u8,
    },

    /// A thread of the program panicked while it used the transfer area. The motors were stopped if the connection
    /// still worked, and the transfer ended.
    ProgramPanicked,
    /// The program showed no sign of life for the watchdog's limit, or a call of the cycle hook kept the areas for that
    /// long: all outputs were set to 0, and what it wrote since is lost. The transfer goes on, and the program can go
    /// on, too.
    WatchdogExpired {
        /// The limit that was set; without one half a second, for the cycle hook.
        limit: Duration,
    },
    /// The connection was lost and is being re-established: all outputs in the areas were set to 0, all commands
    /// forgotten, and what the program wrote before is lost. Motors may go on until the connection is back, and are
    /// off then, unless another controller answers at the address, which a warning tells. The transfer goes on, and the program can go on, too.
    ConnectionLost {
        /// What went wrong with the connection.
        cause: Box<Error>,
    },
    /// A lost connection could not be re-established within the limit. The transfer ended.
    ReconnectFailed {
        /// The limit that was set.
        limit: Duration,
        /// What went wrong with the last attempt.
        cause: Box<Error>,
    },
    /// A thread for the transfer, the camera or a host name could not be started.
    #[doc(alias = "FTLIB_ERR_THREAD_NOT_STARTABLE")]
    ThreadNotStarted {
        /// What the operating system said.
        cause: IoError,
    },
    /// A thread of this crate panicked, which is a bug in the crate.
    ThreadPanicked {
        /// What the panic said.
        reason: String,
    },
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self:#}")
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        if let Self::ConnectionLost { cause } | Self::ReconnectFailed { cause, .. } = self {
            return Some(cause);
        }
        if let Self::HostNotFound { cause, .. }
        | Self::ConnectFailed { cause, .. }
        | Self::Io { cause, .. }
        | Self::ThreadNotStarted { cause } = self
        {
            return Some(&**cause);
        }
        None
    }
}

impl From<InvalidCall> for Error {
    fn from(refused: InvalidCall) -> Self {
        Self::InvalidCall(refused)
    }
}

impl Error {
    /// Returns an error unless a number is in its range.
    pub(crate) fn check_range(
        what: &'static str,
        given: impl TryInto<i64>,
        range: RangeInclusive<i64>,
    ) -> Result<(), Self> {
        // Only a count or a time can be too large for an i64, and it is above any range.
        let given = given.try_into().unwrap_or(i64::MAX);
        if range.contains(&given) {
            return Ok(());
        }
        Err(Self::OutOfRange { what, given, least: *range.start(), most: *range.end() })
    }

    /// Returns an error unless a time is in its range of milliseconds.
    pub(crate) fn check_millis(
        what: &'static str,
        given: Duration,
        range: RangeInclusive<i64>,
    ) -> Result<(), Self> {
        // A part of a millisecond is not enough for the least, and too much for the most.
        Self::check_range(what, given.as_millis(), range.clone())?;
        Self::check_range(what, given.as_nanos().div_ceil(1_000_000), range)
    }

    /// The error for a thread that could not be started.
    pub(crate) fn not_started(error: io::Error) -> Self {
        Self::ThreadNotStarted { cause: error.into() }
    }

    /// The error for a thread that panicked.
    pub(crate) fn from_panic(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<&str>().copied();
        let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        Self::ThreadPanicked { reason: text.unwrap_or("panic").to_owned() }
    }
}

#[cfg(test)]
mod tests;
