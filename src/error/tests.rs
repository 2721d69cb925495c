//! What the errors print, alone and as a chain.

use std::error::Error as _;

use super::*;

fn cause() -> IoError {
    io::Error::other("what the system said").into()
}

/// An error of each kind, with what it was made from.
fn all() -> Vec<Error> {
    let limit = Duration::from_secs(2);
    let (command, packet, reason) = ("QueryStatus", "UpdateConfig", "a reason".to_owned());
    let (host, address) = ("txt".to_owned(), "txt:65000".to_owned());
    let version = FirmwareVersion::OLDEST_SUPPORTED;
    let refused = || Error::from(InvalidCall::ZeroPulses);
    vec![
        Error::AreaCount { given: 10 },
        Error::OutOfRange { what: "port", given: 0, least: 1, most: 2 },
        refused(),
        Error::AlreadyStarted,
        Error::NotStarted,
        Error::NotOnline { command },
        Error::WaitTimedOut { limit },
        Error::BadAddress { given: host.clone() },
        Error::NoController { tried: Vec::new() },
        Error::SeveralControllers { found: Vec::new(), in_use: Vec::new() },
        Error::HostNotFound { host: host.clone(), cause: cause() },
        Error::LookupTimedOut { host, limit },
        Error::ConnectionRefused { address: address.clone() },
        Error::ConnectTimedOut { address: address.clone(), limit },
        Error::ConnectFailed { address, cause: cause() },
        Error::NotTaken { command, limit },
        Error::NoAnswer { command, limit, received: 0 },
        Error::ConnectionClosed { command, received: 0 },
        Error::Io { command, cause: cause() },
        Error::WrongId { packet, expected: 1, found: 2 },
        Error::WrongSize { packet, expected: 1, found: 2 },
        Error::TooLarge { packet, announced: 2, limit: 1 },
        Error::DataEndsEarly { expected: 2, found: 1 },
        Error::WrongCrc { announced: 1, computed: 2 },
        Error::FirmwareTooOld { found: version, required: version },
        Error::CameraAlreadyStarted,
        Error::FrameSize { announced: 2, limit: 1 },
        Error::BadPicture { reason: reason.clone() },
        Error::I2cNoDevice { device: 1 },
        Error::ProgramPanicked,
        Error::WatchdogExpired { limit },
        Error::ConnectionLost { cause: Box::new(Error::Io { command, cause: cause() }) },
        Error::ReconnectFailed { limit, cause: Box::new(Error::Io { command, cause: cause() }) },
        Error::ThreadNotStarted { cause: cause() },
        Error::ThreadPanicked { reason },
    ]
}

/// How many errors led to this one. Without `_`, so that the compiler asks for a new kind.
fn causes(error: &Error) -> usize {
    match error {
        Error::ConnectionLost { cause } | Error::ReconnectFailed { cause, .. } => 1 + causes(cause),
        Error::HostNotFound { .. }
        | Error::ConnectFailed { .. }
        | Error::Io { .. }
        | Error::ThreadNotStarted { .. } => 1,
        Error::AreaCount { .. }
        | Error::OutOfRange { .. }
        | Error::InvalidCall(_)
        | Error::AlreadyStarted
        | Error::NotStarted
        | Error::NotOnline { .. }
        | Error::WaitTimedOut { .. }
        | Error::BadAddress { .. }
        | Error::NoController { .. }
        | Error::SeveralControllers { .. }
        | Error::LookupTimedOut { .. }
        | Error::ConnectionRefused { .. }
        | Error::ConnectTimedOut { .. }
        | Error::NotTaken { .. }
        | Error::NoAnswer { .. }
        | Error::ConnectionClosed { .. }
        | Error::WrongId { .. }
        | Error::WrongSize { .. }
        | Error::TooLarge { .. }
        | Error::DataEndsEarly { .. }
        | Error::WrongCrc { .. }
        | Error::FirmwareTooOld { .. }
        | Error::CameraAlreadyStarted
        | Error::FrameSize { .. }
        | Error::BadPicture { .. }
        | Error::I2cNoDevice { .. }
        | Error::ProgramPanicked
        | Error::WatchdogExpired { .. }
        | Error::ThreadPanicked { .. } => 0,
    }
}

#[test]
fn a_chain_of_errors_prints_nothing_twice_and_leaves_nothing_out() {
    for error in all() {
        let mut chain = vec![error.to_string()];
        let mut next = error.source();
        while let Some(cause) = next {
            chain.push(cause.to_string());
            next = cause.source();
        }
        assert_eq!(chain.len(), 1 + causes(&error), "{chain:?}");
        for (place, sentence) in chain.iter().enumerate() {
            let told = chain[..place].iter().find(|other| other.contains(sentence));
            assert_eq!(told, None, "{sentence} is told twice");
        }
        assert_eq!(format!("{error:#}"), chain.join(": "));
        assert_eq!(format!("{error:?}"), chain.join(": "), "Rust prints it after main");
    }
}
