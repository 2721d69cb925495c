//! The settings of a handler.

use std::time::Duration;

use super::TransferAreaComHandler;
use crate::client::{TimeLimits, PORT};
use crate::error::Error;
use crate::exchange::{check_area_count, TransferMode};

/// What a handler needs to know. The defaults are the kit's, where it has one.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) host: String,
    pub(super) port: u16,
    /// `None` for the port behind the main connection's.
    pub(super) camera_port: Option<u16>,
    /// `None` for the second port behind the main connection's.
    pub(super) i2c_port: Option<u16>,
    pub(super) areas: usize,
    pub(super) mode: TransferMode,
    pub(super) limits: TimeLimits,
    pub(super) reaction_window: Duration,
}

/// Settings of a [`TransferAreaComHandler`], made by [`TransferAreaComHandler::builder`].
///
/// ```
/// use std::time::Duration;
/// use ft_transfer_area::{TransferAreaComHandler, TransferMode};
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.8.2")
///     .areas(2)
///     .mode(TransferMode::Compressed)
///     .reaction_window(Duration::from_millis(3))
///     .build()?;
/// # let _ = handler;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
#[must_use = "settings do nothing until build is called"]
pub struct TransferAreaComHandlerBuilder {
    settings: Settings,
}

impl TransferAreaComHandlerBuilder {
    pub(super) fn new(host: String) -> Self {
        Self {
            settings: Settings {
                host,
                port: PORT,
                camera_port: None,
                i2c_port: None,
                areas: 1,
                mode: TransferMode::default(),
                limits: TimeLimits::default(),
                reaction_window: Duration::from_millis(5),
            },
        }
    }

    /// The port of the main connection. Default [`PORT`], 65000.
    pub fn port(mut self, port: u16) -> Self {
        self.settings.port = port;
        self
    }

    /// The port of the camera's frames. Default the one behind the main connection's, 65001.
    pub fn camera_port(mut self, port: u16) -> Self {
        self.settings.camera_port = Some(port);
        self
    }

    /// The port of I2C. Default the second one behind the main connection's, 65002.
    pub fn i2c_port(mut self, port: u16) -> Self {
        self.settings.i2c_port = Some(port);
        self
    }

    /// How many areas there are: 1 for the master alone, 2 with one extension, up to 9.
    /// Default 1.
    #[doc(alias = "nAreas")]
    pub fn areas(mut self, areas: usize) -> Self {
        self.settings.areas = areas;
        self
    }

    /// How outputs and inputs travel. Default [`TransferMode::Compressed`].
    #[doc(alias = "SetTransferMode")]
    pub fn mode(mut self, mode: TransferMode) -> Self {
        self.settings.mode = mode;
        self
    }

    /// How long connecting, a response, and sending may take. Default 5 s, 2 s and 2 s.
    pub fn time_limits(mut self, limits: TimeLimits) -> Self {
        self.settings.limits = limits;
        self
    }

    /// How long after a response the next request is held back, so that the program can answer
    /// in it. Default 5 ms; zero sends at once, and an answer goes out a request later.
    ///
    /// The controller sends a response 10 ms after its previous one, so a window well below that
    /// costs no cycle rate; a longer one slows the cycle down, and one of some seconds makes the
    /// controller close the connection. Threads in `wait_cycle` that are done sooner end it sooner.
    pub fn reaction_window(mut self, window: Duration) -> Self {
        self.settings.reaction_window = window;
        self
    }

    /// The handler with these settings. Connects to nothing yet.
    ///
    /// # Errors
    ///
    /// [`Error::AreaCount`] unless there are 1 to 9 areas.
    pub fn build(self) -> Result<TransferAreaComHandler, Error> {
        check_area_count(self.settings.areas)?;
        Ok(TransferAreaComHandler::new(self.settings))
    }
}
