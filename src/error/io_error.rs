//! The operating system's errors, in a form that this crate's errors can contain.

use std::fmt;
use std::io;
use std::ops::Deref;
use std::sync::Arc;

/// What the operating system said: an [`io::Error`] that can be cloned and compared.
///
/// It dereferences to the `io::Error`, which is also the [`source`](std::error::Error::source) of the
/// [`Error`](crate::Error) that contains it:
///
/// ```
/// use std::error::Error as _;
/// use std::io;
/// use ft_transfer_area::{Error, IoError};
///
/// let cause = IoError::from(io::Error::from(io::ErrorKind::HostUnreachable));
/// assert_eq!(cause.kind(), io::ErrorKind::HostUnreachable);
/// let error = Error::ConnectFailed { address: "192.168.7.2:65000".to_owned(), cause };
/// let source = error.source().and_then(|source| source.downcast_ref::<io::Error>());
/// assert_eq!(source.map(io::Error::kind), Some(io::ErrorKind::HostUnreachable));
/// ```
///
/// Two are equal when their kind, number and text are equal.
#[derive(Clone)]
pub struct IoError(Arc<io::Error>);

impl From<io::Error> for IoError {
    fn from(error: io::Error) -> Self {
        Self(Arc::new(error))
    }
}

impl Deref for IoError {
    type Target = io::Error;

    fn deref(&self) -> &io::Error {
        &self.0
    }
}

impl PartialEq for IoError {
    fn eq(&self, other: &Self) -> bool {
        (self.kind(), self.raw_os_error()) == (other.kind(), other.raw_os_error())
            && self.to_string() == other.to_string()
    }
}

impl Eq for IoError {}

impl fmt::Display for IoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

impl fmt::Debug for IoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.0, f)
    }
}

#[cfg(test)]
mod tests {
    use std::error::Error as _;
    use std::io::ErrorKind;

    use super::*;
    use crate::error::Error;

    fn os_error(code: i32) -> IoError {
        io::Error::from_raw_os_error(code).into()
    }

    #[test]
    fn errors_of_the_same_kind_number_and_text_are_equal() {
        let named = |text: &str| IoError::from(io::Error::new(ErrorKind::NotFound, text));
        assert_eq!(os_error(1), os_error(1));
        assert_ne!(os_error(1), os_error(2));
        assert_eq!(named("no txt"), named("no txt").clone());
        assert_ne!(named("no txt"), named("no TXT"));
        assert_ne!(named("x"), IoError::from(io::Error::new(ErrorKind::InvalidData, "x")));
    }

    #[test]
    fn errors_keep_what_the_operating_system_said_as_their_source() {
        let cause = os_error(1);
        let (host, address) = ("txt".to_owned(), "txt:65000".to_owned());
        for error in [
            Error::HostNotFound { host, cause: cause.clone() },
            Error::ConnectFailed { address, cause: cause.clone() },
            Error::Io { command: "QueryStatus", cause: cause.clone() },
            Error::ThreadNotStarted { cause: cause.clone() },
        ] {
            let source = error.source().and_then(|source| source.downcast_ref::<io::Error>());
            assert_eq!(source.and_then(io::Error::raw_os_error), Some(1), "{error}");
        }
    }
}
