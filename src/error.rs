//! The one error type of the crate.

mod message;

use std::any::Any;
use std::io;
use std::ops::RangeInclusive;
use std::time::Duration;

use crate::firmware::FirmwareVersion;
use crate::terminals::{Input, Motor, Output};

/// What can go wrong between a program and its controller.
///
/// Every message is a sentence that says what happened and what to check. After an error that
/// came while talking to the controller the connection is of no further use: a
/// [`TxtClient`](crate::TxtClient) returns the same error for every later call, and a
/// [`TransferAreaComHandler`](crate::TransferAreaComHandler) until `begin_transfer` starts afresh;
/// an [`I2cClient`](crate::I2cClient) connects anew at its next call.
/// The errors that leave the connection as it was say so, and so do those after which a transfer goes on.
#[doc(alias = "FtErrors")]
#[doc(alias = "ftxGetLibErrorString")]
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A number of transfer areas outside 1..=9. Nothing was sent.
    AreaCount {
        /// How many areas were asked for.
        given: usize,
    },
    /// A number that a call was given is out of its range. Nothing was changed, and nothing sent.
    #[doc(alias = "FTLIB_ERR_INVALID_PARAM")]
    OutOfRange {
        /// What the number is for.
        what: &'static str,
        /// What was given.
        given: i64,
        /// The least that there can be.
        least: i64,
        /// The most that there can be.
        most: i64,
    },
    /// The call is for a motor, but these outputs are configured as two single ones. Nothing was
    /// changed.
    #[doc(alias = "FTLIB_ERR_INVALID_PARAM")]
    NotAMotor {
        /// The motor.
        motor: Motor,
    },
    /// The call is for a single output, but this one is configured as half of a motor. Nothing was
    /// changed.
    #[doc(alias = "FTLIB_ERR_INVALID_PARAM")]
    NotAnOutput {
        /// The output.
        output: Output,
    },
    /// A motor command names this motor twice. Nothing was changed.
    MotorTwice {
        /// The motor.
        motor: Motor,
    },
    /// The call is for a digital input, but this one reports a measured value.
    NotDigital {
        /// The input.
        input: Input,
    },
    /// The call is for a measured value, but this input is digital.
    NotAnalog {
        /// The input.
        input: Input,
    },
    /// `begin_transfer` was called while a transfer is running, which goes on undisturbed.
    #[doc(alias = "FTLIB_ERR_THREAD_IS_RUNNING")]
    AlreadyStarted,
    /// The call needs a running transfer, and there is none: call `begin_transfer` first.
    #[doc(alias = "FTLIB_ERR_THREAD_NOT_RUNNING")]
    NotStarted,
    /// The command needs online mode: call `start_online` first. The connection stays usable.
    NotOnline {
        /// The command that was refused.
        command: &'static str,
    },
    /// What a call waited for did not come about within its time limit. The transfer goes on.
    WaitTimedOut {
        /// The limit that was given.
        limit: Duration,
    },

    /// The host name has no address.
    HostNotFound {
        /// The name as it was given.
        host: String,
        /// What the operating system said.
        reason: String,
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
        reason: String,
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
    /// The controller closed the connection where a response was due.
    ConnectionClosed {
        /// The command.
        command: &'static str,
        /// How many bytes of the response had come in.
        received: usize,
    },
    /// A command could not be sent or its response not be read.
    Io {
        /// The command.
        command: &'static str,
        /// The kind of the operating system's error.
        kind: io::ErrorKind,
        /// What the operating system said.
        reason: String,
    },

    /// A packet starts with another id than the one that is due.
    WrongId {
        /// The packet that was due.
        packet: &'static str,
        /// Its id.
        expected: u32,
        /// The id that came.
        found: u32,
    },
    /// A packet has another size than its kind has.
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
    /// Compressed data ends before all words are told.
    DataEndsEarly {
        /// How many words were due.
        expected: usize,
        /// How many the data held.
        found: usize,
    },
    /// The checksum of expanded data is not the announced one.
    WrongCrc {
        /// The checksum announced in the packet.
        announced: u32,
        /// The checksum of what came.
        computed: u32,
    },
    /// The controller's firmware is older than this crate can talk to.
    FirmwareTooOld {
        /// The controller's version.
        found: FirmwareVersion,
        /// The oldest supported version.
        required: FirmwareVersion,
    },

    /// `start_camera` was called while the camera is started, which goes on undisturbed.
    CameraAlreadyStarted,
    /// The camera announces a frame of an implausible size.
    FrameSize {
        /// The announced number of bytes.
        announced: i32,
        /// The limit that was set.
        limit: usize,
    },
    /// A frame is no picture that can be mended or decoded. The next one may be.
    BadPicture {
        /// What is wrong with it.
        reason: String,
    },

    /// No I2C device answers at this address. The connection stays usable.
    ///
    /// So says the simulated TXT. How a real controller says it is not known, and may come out as
    /// another error.
    I2cNoDevice {
        /// The address, of 7 bits.
        device: u8,
    },

    /// A thread of the program panicked with the transfer area in its hands; the motors were
    /// stopped and the transfer ended.
    ProgramPanicked,
    /// The cycle hook did not return within its limit; the motors were stopped and the transfer ended. The
    /// hook is not called again, and its thread ends when it returns.
    HookHangs {
        /// The limit that was set.
        limit: Duration,
    },
    /// The program showed no sign of life for the watchdog's limit: all outputs were set to 0, and what it
    /// wrote since is gone. The transfer goes on, and so can the program.
    WatchdogExpired {
        /// The limit that was set.
        limit: Duration,
    },
    /// The connection was lost and is made again: all outputs were set to 0, all commands forgotten, and
    /// what the program wrote before is gone. The transfer goes on, and so can the program.
    ConnectionLost {
        /// What went wrong with the connection.
        cause: Box<Error>,
    },
    /// A lost connection could not be made again within the limit for that, and the transfer ended.
    ReconnectFailed {
        /// The limit that was set.
        limit: Duration,
        /// What went wrong with the last attempt.
        cause: Box<Error>,
    },
    /// A thread for the transfer, the camera or a host name could not be started, or ended by a
    /// panic. The latter is a defect of this crate.
    #[doc(alias = "FTLIB_ERR_THREAD_NOT_STARTABLE")]
    Thread {
        /// What happened.
        reason: String,
    },
    /// A world for the simulated TXT has a mistake. Nothing was started.
    World {
        /// The line of the file, counted from 1; 0 for a file that can't be read and for a world
        /// that was built in code.
        line: usize,
        /// What is wrong, and what was expected.
        reason: String,
    },
    /// A simulated TXT could not be started: its port is taken, or the operating system refused
    /// a socket or a thread.
    SimulatorFailed {
        /// What the operating system said.
        reason: String,
    },
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::ConnectionLost { cause } | Self::ReconnectFailed { cause, .. } => Some(cause),
            _ => None,
        }
    }
}

impl Error {
    /// Errs unless a number is in its range.
    pub(crate) fn check_range(
        what: &'static str,
        given: impl TryInto<i64>,
        range: RangeInclusive<i64>,
    ) -> Result<(), Self> {
        // What does not fit is a number of things, and larger than any range.
        let given = given.try_into().unwrap_or(i64::MAX);
        if range.contains(&given) {
            return Ok(());
        }
        Err(Self::OutOfRange { what, given, least: *range.start(), most: *range.end() })
    }

    /// The error for a thread that could not be started.
    pub(crate) fn not_started(error: &io::Error) -> Self {
        Self::Thread { reason: error.to_string() }
    }

    /// The error for a thread that ended by a panic.
    pub(crate) fn from_panic(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<&str>().copied();
        let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        Self::Thread { reason: text.unwrap_or("panic").to_owned() }
    }
}
