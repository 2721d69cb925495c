//! What has caused an error, as far as a new connection may help.

use super::Error;

/// What has caused an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// There is no connection, or it was lost.
    Connection,
    /// What came over the connection makes no sense.
    Bytes,
    /// A mistake of the program, or something of this computer or in the controller: another connection
    /// would not help.
    Other,
}

impl Error {
    pub(crate) fn origin(&self) -> Origin {
        match self {
            Self::HostNotFound { .. }
            | Self::LookupTimedOut { .. }
            | Self::ConnectionRefused { .. }
            | Self::ConnectTimedOut { .. }
            | Self::ConnectFailed { .. }
            | Self::NotTaken { .. }
            | Self::NoAnswer { .. }
            | Self::ConnectionClosed { .. }
            | Self::Io { .. } => Origin::Connection,
            Self::WrongId { .. }
            | Self::WrongSize { .. }
            | Self::TooLarge { .. }
            | Self::DataEndsEarly { .. }
            | Self::WrongCrc { .. } => Origin::Bytes,
            Self::AreaCount { .. }
            | Self::OutOfRange { .. }
            | Self::InvalidCall(_)
            | Self::AlreadyStarted
            | Self::NotStarted
            | Self::NotOnline { .. }
            | Self::WaitTimedOut { .. }
            | Self::BadAddress { .. }
            | Self::NoController { .. }
            | Self::SeveralControllers { .. }
            | Self::FirmwareTooOld { .. }
            | Self::CameraAlreadyStarted
            | Self::FrameSize { .. }
            | Self::BadPicture { .. }
            | Self::I2cNoDevice { .. }
            | Self::ProgramPanicked
            | Self::WatchdogExpired { .. }
            | Self::ConnectionLost { .. }
            | Self::ReconnectFailed { .. }
            | Self::ThreadNotStarted { .. }
            | Self::ThreadPanicked { .. } => Origin::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_says_whether_another_connection_may_help() {
        let command = "ExchangeDataCmpr";
        assert_eq!(Error::ConnectionClosed { command, received: 0 }.origin(), Origin::Connection);
        assert_eq!(Error::WrongCrc { announced: 1, computed: 2 }.origin(), Origin::Bytes);
        let cause = std::io::Error::other("no thread");
        assert_eq!(Error::not_started(cause).origin(), Origin::Other);
        assert_eq!(Error::ThreadPanicked { reason: String::new() }.origin(), Origin::Other);
        assert_eq!(Error::AreaCount { given: 0 }.origin(), Origin::Other);
    }
}
