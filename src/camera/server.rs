//! The camera server, which sends the frames.

use std::time::Duration;

use super::CameraOptions;
use crate::client::{Endpoint, TimeLimits, Transport};
use crate::notices::notice;

/// The longest that connecting before the command may take. A host that listens or refuses answers
/// immediately.
const EARLY_LIMIT: Duration = Duration::from_millis(300);

/// A camera server, and the connection to it if there is one already.
#[derive(Debug)]
pub(crate) struct CameraServer {
    pub(super) endpoint: Endpoint,
    pub(super) early: Option<Box<dyn Transport>>,
}

impl CameraServer {
    /// A server to which there is no connection yet.
    pub(crate) fn not_connected(endpoint: Endpoint) -> Self {
        Self { endpoint, early: None }
    }

    /// The server that the next command starts. Connects to it before that command is sent, if it already
    /// accepts connections. Blocks for 300 ms at most.
    ///
    /// A TXT refuses until the command has started its camera server. The server program for the
    /// TXT 4.0 always listens, but checks for a connection only once: when the command comes.
    pub(crate) fn before_start(endpoint: Endpoint) -> Self {
        let frame_limit = CameraOptions::default().frame_limit;
        let limits = TimeLimits { connect: EARLY_LIMIT, read: frame_limit, write: frame_limit };
        let early = endpoint.open(&limits);
        if let Err(error) = &early {
            notice!(Debug, "the camera accepts no connection before its start: {error:#}");
        }
        Self { endpoint, early: early.ok() }
    }
}
