//! A handler's settings.

use std::time::Duration;

use crate::client::{found_host, Network, TimeLimits, PORT, TCP};
use crate::error::Error;
use crate::exchange::TransferMode;

/// A handler's settings. The defaults are the kit's, if it has one.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) network: &'static dyn Network,
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) camera_port: u16,
    pub(crate) i2c_port: u16,
    /// Whether the program has named that port, or it is a TXT's.
    pub(crate) i2c_port_is_known: bool,
    pub(crate) areas: usize,
    pub(crate) mode: TransferMode,
    pub(crate) limits: TimeLimits,
    pub(crate) reaction_window: Duration,
    /// Whether time moves only while the program waits.
    pub(crate) lock_step: bool,
    /// Whether silence is done with the next response, whatever the controller says.
    pub(crate) silence_is_done: bool,
    /// `None` switches it off.
    pub(crate) watchdog: Option<Duration>,
    /// For how long to try to re-establish a lost connection; `None` ends the transfer.
    pub(crate) reconnect: Option<Duration>,
}

impl Settings {
    pub(crate) fn new(host: String) -> Self {
        Self {
            network: &TCP,
            host,
            port: PORT,
            camera_port: PORT + 1,
            i2c_port: PORT + 2,
            i2c_port_is_known: true,
            areas: 1,
            mode: TransferMode::default(),
            limits: TimeLimits::default(),
            reaction_window: Duration::from_millis(5),
            lock_step: false,
            silence_is_done: true,
            watchdog: None,
            reconnect: None,
        }
    }

    /// The controller, for the log: a program may have several.
    pub(crate) fn peer(&self) -> String {
        format!("{}:{}", self.host, self.port)
    }

    /// The settings, with the controller that was found as the host if that is `auto`.
    pub(crate) fn with_found_host(&self) -> Result<Self, Error> {
        let host = found_host(self.network, &self.host, self.port, self.limits.connect)?;
        Ok(Self { host, ..self.clone() })
    }
}
