//! A handler's settings.

use std::time::Duration;

use crate::client::{found_host, TimeLimits, PORT};
use crate::error::Error;
use crate::exchange::TransferMode;

/// A handler's settings. The defaults are the kit's, if it has one.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) camera_port: u16,
    pub(super) i2c_port: u16,
    pub(super) areas: usize,
    pub(super) mode: TransferMode,
    pub(super) limits: TimeLimits,
    pub(super) reaction_window: Duration,
    pub(super) hook_limit: Duration,
    /// Whether time moves only while the program waits.
    pub(super) lock_step: bool,
    /// `None` switches it off.
    pub(super) watchdog: Option<Duration>,
    /// For how long a lost connection is made again; `None` ends the transfer.
    pub(super) reconnect: Option<Duration>,
}

impl Settings {
    pub(super) fn new(host: String) -> Self {
        Self {
            host,
            port: PORT,
            camera_port: PORT + 1,
            i2c_port: PORT + 2,
            areas: 1,
            mode: TransferMode::default(),
            limits: TimeLimits::default(),
            reaction_window: Duration::from_millis(5),
            hook_limit: Duration::from_millis(500),
            lock_step: false,
            watchdog: None,
            reconnect: None,
        }
    }

    /// The settings, with the controller that was found as the host if that is `auto`.
    pub(super) fn with_found_host(&self) -> Result<Self, Error> {
        let host = found_host(&self.host, self.port, self.limits.connect)?;
        Ok(Self { host, ..self.clone() })
    }
}
