//! Why a simulated TXT could not be started.

use std::error::Error as _;
use std::fmt;
use std::io::ErrorKind;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::IoError;

/// Why a simulated TXT or its world could not be made. Nothing was started.
///
/// `{}` is a sentence without the error of the operating system that led to it; `{:#}` and `{:?}` have that, too, as
/// with [`ft_transfer_area::Error`].
#[derive(Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A world has a mistake.
    World {
        /// The line of the file, counted from 1; 0 for a world without a file.
        line: usize,
        /// What is wrong, and what was expected.
        reason: String,
    },
    /// The file of a world can't be read.
    WorldNotRead {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        cause: IoError,
    },
    /// More than 8 extensions are asked for.
    TooManyExtensions {
        /// How many were asked for.
        given: usize,
    },
    /// A setting is out of its range.
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
    /// A port is taken, or the operating system refused a socket or a thread.
    NotStarted {
        /// What the operating system said.
        cause: IoError,
    },
}

impl Error {
    /// Returns an error unless a number is in its range.
    pub(crate) fn check_range(
        what: &'static str,
        given: impl TryInto<i64>,
        range: RangeInclusive<i64>,
    ) -> Result<(), Self> {
        // Only a time can be too large for an i64, and it is above any range.
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
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence(f)?;
        match self.source() {
            Some(cause) if f.alternate() => write!(f, ": {cause:#}"),
            _ => Ok(()),
        }
    }
}

impl Error {
    /// Writes what happened, without what led to it.
    fn sentence(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::World { line: 0, reason } => {
                write!(f, "the simulated world can't be used: {reason}")
            }
            Self::World { line, reason } => {
                write!(f, "line {line} of the simulated world is wrong: {reason}")
            }
            Self::WorldNotRead { path, cause: _ } => {
                write!(f, "the simulated world in {} can't be read", path.display())
            }
            Self::TooManyExtensions { given } => {
                write!(f, "there can be {MAX_EXTENSIONS} extensions at most, and not {given}")
            }
            Self::OutOfRange { what, given, least, most } => {
                write!(f, "the {what} is {given}, but has to be {least} to {most}")
            }
            Self::NotStarted { cause } => {
                write!(f, "the simulated TXT could not be started")?;
                match cause.kind() {
                    ErrorKind::AddrInUse => {
                        f.write_str("; check that no other program uses its port")
                    }
                    ErrorKind::PermissionDenied => f.write_str(
                        "; the system allows this port to nobody or to administrators only: choose another one",
                    ),
                    _ => Ok(()),
                }
            }
        }
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self:#}")
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::WorldNotRead { cause, .. } | Self::NotStarted { cause } => Some(&**cause),
            Self::World { .. } | Self::TooManyExtensions { .. } | Self::OutOfRange { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn errors_keep_what_the_operating_system_said_as_their_source() {
        let cause = IoError::from(io::Error::from_raw_os_error(1));
        for error in [
            Error::WorldNotRead { path: "gate.toml".into(), cause: cause.clone() },
            Error::NotStarted { cause: cause.clone() },
        ] {
            let source = error.source().and_then(|source| source.downcast_ref::<io::Error>());
            assert_eq!(source.and_then(io::Error::raw_os_error), Some(1), "{error}");
            assert!(!error.to_string().contains(&cause.to_string()), "{error}");
            assert!(format!("{error:#}").ends_with(&format!(": {cause}")), "{error}");
        }
    }
}
