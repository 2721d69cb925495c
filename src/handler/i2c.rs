//! The handler's I2C devices.

use super::TransferAreaComHandler;
use crate::error::Error;
use crate::i2c::I2cClient;

impl TransferAreaComHandler {
    /// Connects to the controller's I2C port, with the handler's host and time limits.
    ///
    /// Blocks up to the limit for connecting for each address of the host. The client has a
    /// connection of its own: it does not disturb a transfer, outlives the handler, and works without
    /// a transfer as far as the controller lets it, of which [`I2cClient`] says what is known.
    ///
    /// # Errors
    ///
    /// [`Error::HostNotFound`], [`Error::ConnectionRefused`], [`Error::ConnectTimedOut`] or
    /// [`Error::ConnectFailed`].
    pub fn i2c(&self) -> Result<I2cClient, Error> {
        let port = self.settings.i2c_port.unwrap_or(self.settings.port.wrapping_add(2));
        I2cClient::connect(&self.settings.host, port, self.settings.limits)
    }
}
