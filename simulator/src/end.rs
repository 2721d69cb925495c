//! Why a connection ends, and what the log says about it.

use std::io;

use crate::shared::Stopped;

/// Why a connection ends.
#[derive(Debug)]
pub(super) enum End {
    /// The thread should end.
    Stopped,
    /// The client closed it.
    Left,
    /// The client sent nothing in time.
    Idle,
    /// The client did not read a response in time.
    Unread,
    /// The client sent something that can't be answered.
    Misbehaved(String),
    /// It is closed on purpose, for this reason.
    Closed(&'static str),
    Broken(io::Error),
}

impl End {
    /// Logs how the connection of this client ended.
    pub(super) fn tell(self, client: &str) {
        match self {
            Self::Stopped => {}
            Self::Left => log::info!("{client} has left"),
            Self::Idle => log::warn!("{client} is cut off: it sent no command"),
            Self::Unread => log::warn!("{client} is cut off: it reads no responses"),
            Self::Misbehaved(what) => log::warn!("{client} is cut off: {what}"),
            Self::Closed(reason) => log::info!("the connection of {client} is closed: {reason}"),
            Self::Broken(error) => log::info!("the connection of {client} broke: {error}"),
        }
    }
}

impl From<Stopped> for End {
    fn from(Stopped: Stopped) -> Self {
        Self::Stopped
    }
}

impl From<io::Error> for End {
    fn from(error: io::Error) -> Self {
        Self::Broken(error)
    }
}
