//! The handler's I2C devices.

use super::com_handler::TransferAreaComHandler;
use super::settings::Settings;
use crate::error::Error;
use crate::i2c::I2cClient;

impl TransferAreaComHandler {
    /// Connects to the controller's I2C port, with the handler's host and time limits.
    ///
    /// Blocks up to the limit for connecting. The client has a connection of its own: it does not disturb
    /// a transfer, outlives the handler, and works without a transfer as far as the controller lets it, of
    /// which [`I2cClient`] says what is known.
    ///
    /// # Errors
    ///
    /// [`Error::HostNotFound`], [`Error::LookupTimedOut`], [`Error::ConnectionRefused`],
    /// [`Error::ConnectTimedOut`] or [`Error::ConnectFailed`].
    pub fn i2c(&self) -> Result<I2cClient, Error> {
        let Settings { host, i2c_port, limits, .. } = self.settings();
        I2cClient::connect(host, *i2c_port, *limits)
    }
}
