//! What can go wrong with a file.

use std::error::Error as _;
use std::fmt;
use std::io;
use std::path::PathBuf;

use ft_transfer_area::IoError;

use crate::format::FORMAT;

/// What can go wrong with a recording.
///
/// `{}` is a sentence without the error of the operating system that led to it; `{:#}` and `{:?}` have that, too, as
/// with [`ft_transfer_area::Error`].
#[non_exhaustive]
pub enum Error {
    /// The file can't be opened or read.
    #[non_exhaustive]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The file can't be created, or a write has failed, as on a full disk. What was written before can be read.
    #[non_exhaustive]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: IoError,
        /// How many cycles were handed to the file before.
        cycles: u64,
    },
    /// The file is empty, or cut off before its first entry.
    #[non_exhaustive]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is not an MCAP file.
    #[non_exhaustive]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// The file is an MCAP file of another program.
    #[non_exhaustive]
    OtherMcap {
        /// The file.
        path: PathBuf,
        /// What its header says about who wrote it.
        library: String,
    },
    /// The file was written by a newer version of this program.
    #[non_exhaustive]
    Newer {
        /// The file.
        path: PathBuf,
        /// The version of its format.
        format: String,
    },
    /// Something in the file is wrong, so nothing after it can be read.
    #[non_exhaustive]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What.
        cause: String,
    },
    /// A handler or the operating system refuses what a recorder needs.
    #[non_exhaustive]
    NotStarted {
        /// Why.
        cause: IoError,
    },
    /// There is no terminal of this name.
    #[non_exhaustive]
    NoColumn {
        /// The name.
        name: String,
    },
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self:#}")
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
            Self::Read { path, cause: _ } => write!(f, "can't read {}", path.display()),
            Self::Write { path, cause: _, cycles } => {
                write!(f, "can't write {}", path.display())?;
                match cycles {
                    0 => Ok(()),
                    _ => write!(f, "; it has about {cycles} cycles from before, which can be read"),
                }
            }
            Self::Empty { path } => {
                write!(f, "{} is empty, or cut off before its first entry", path.display())
            }
            Self::NotMcap { path } => write!(f, "{} is not an MCAP file", path.display()),
            Self::OtherMcap { path, library } => {
                let by = if library.is_empty() { "another program" } else { library };
                write!(f, "{} is an MCAP file, but not a recording of a TXT: it was written by {by}", path.display())
            }
            Self::Newer { path, format } => write!(
                f,
                "{} has format {format}, and this program knows formats up to {FORMAT}: use a newer version of it",
                path.display()
            ),
            Self::Damaged { path, cause } => write!(f, "{} is damaged: {cause}", path.display()),
            Self::NotStarted { cause: _ } => write!(f, "the recording can't be started"),
            Self::NoColumn { name } => write!(
                f,
                "there is no {name:?}: write I1 to I8, C1 to C4, M1 to M4 or O1 to O8, and E1.I1 for extension 1"
            ),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Read { cause, .. } => Some(cause),
            Self::Write { cause, .. } | Self::NotStarted { cause } => Some(&**cause),
            Self::Empty { .. }
            | Self::NotMcap { .. }
            | Self::OtherMcap { .. }
            | Self::Newer { .. }
            | Self::Damaged { .. }
            | Self::NoColumn { .. } => None,
        }
    }
}
