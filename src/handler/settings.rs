//! A handler's settings.

use std::time::Duration;

use crate::client::{found_host, Network, TimeLimits, PORT, TCP};
use crate::error::Error;
use crate::exchange::TransferMode;

/// A handler's settings. The defaults are the kit's, if it has one.
#[derive(Clone, Debug)]
pub(in crate::handler) struct Settings {
    pub(in crate::handler) network: &'static dyn Network,
    pub(in crate::handler) host: String,
    pub(in crate::handler) port: u16,
    pub(in crate::handler) camera_port: u16,
    pub(in crate::handler) i2c_port: u16,
    pub(in crate::handler) areas: usize,
    pub(in crate::handler) mode: TransferMode,
    pub(in crate::handler) limits: TimeLimits,
    pub(in crate::handler) reaction_window: Duration,
    pub(in crate::handler) hook_limit: Duration,
    /// Whether time moves only while the program waits.
    pub(in crate::handler) lock_step: bool,
    /// `None` switches it off.
    pub(in crate::handler) watchdog: Option<Duration>,
    /// For how long to try to re-establish a lost connection; `None` ends the transfer.
    pub(in crate::handler) reconnect: Option<Duration>,
}

impl Settings {
    pub(in crate::handler) fn new(host: String) -> Self {
        Self {
            network: &TCP,
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
    pub(in crate::handler) fn with_found_host(&self) -> Result<Self, Error> {
        let host = found_host(self.network, &self.host, self.port, self.limits.connect)?;
        Ok(Self { host, ..self.clone() })
    }
}
