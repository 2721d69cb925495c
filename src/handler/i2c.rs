//! The handler's I2C devices.

use super::com_handler::TransferAreaComHandler;
use super::settings::Settings;
use crate::client::{found_host, is_auto};
use crate::error::Error;
use crate::i2c::I2cClient;

impl TransferAreaComHandler {
    /// Connects to the controller's I2C port, with the handler's host and time limits.
    ///
    /// Blocks up to the limit for connecting. The client has a connection of its own: it does not disturb
    /// a transfer, and may outlive the handler. [`I2cClient`] says what is known about whether a controller
    /// answers without a transfer.
    ///
    /// # Errors
    ///
    /// [`Error::HostNotFound`], [`Error::LookupTimedOut`], [`Error::ConnectionRefused`],
    /// [`Error::ConnectTimedOut`] or [`Error::ConnectFailed`]; for the host `auto` before the first
    /// transfer also [`Error::NoController`] and [`Error::SeveralControllers`].
    #[doc(alias = "StartI2C")]
    pub fn i2c(&self) -> Result<I2cClient, Error> {
        let Settings { host, port, i2c_port, limits, .. } = self.settings();
        let host = match self.controller().and_then(|controller| controller.address) {
            // The transfer's controller: it would not answer a search now.
            Some(address) if is_auto(host) => address.to_string(),
            _ => found_host(host, *port, limits.connect)?,
        };
        I2cClient::connect(&host, *i2c_port, *limits)
    }
}
