//! Stops a controller whose program has crashed or was killed: a TXT does not stop by itself.

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::{Error, TransferAreaComHandler};

/// Goes online, sends an exchange with all outputs off, also those of extensions, and goes offline.
pub(crate) fn stop(host: &str) -> Result<(), Error> {
    let handler = TransferAreaComHandler::builder(host).areas(MAX_AREAS).build()?;
    handler.begin_transfer()?;
    drop(handler.areas().wait_cycle()?);
    handler.end_transfer()
}
