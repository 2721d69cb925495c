//! Making a connection on which the exchange can begin.

use std::time::Duration;

#[cfg(not(all(test, shuttle)))]
use crate::client::TxtClient;
use crate::client::{I2cAccess, I2cLine, TimeLimits};
use crate::error::Error;
use crate::exchange::Exchange;
use crate::firmware::FirmwareVersion;
#[cfg(all(test, shuttle))]
use crate::handler::model::TxtClient;
use crate::handler::settings::Settings;
use crate::handler::shared::Controller;
use crate::notices::notice;
use crate::transfer_area::FishX1Transfer;

/// A connection in online mode, and the exchange on it.
pub(crate) struct Link {
    pub(crate) client: TxtClient,
    pub(crate) exchange: Exchange,
}

/// Connects, checks the firmware, begins online mode and hands over the configurations of all areas.
/// I2C requests on `i2c` reach the controller then. Calls `found` with the controller, and returns how many configurations there were.
///
/// Any thread can call this. Connecting takes at most `limit`, and each response as long as the settings
/// allow.
pub(crate) fn connect(
    settings: &Settings,
    limit: Duration,
    i2c: &I2cLine,
    areas: &[FishX1Transfer],
    mut found: impl FnMut(Controller),
) -> Result<(Link, u64), Error> {
    let Settings { network, host, port, i2c_port, i2c_port_is_known, .. } = settings;
    let limits = TimeLimits { connect: limit, ..settings.limits };
    let mut client = TxtClient::connect_within(*network, host, *port, limits)?;
    let address = client.address();
    let status = client.query_status()?;
    found(Controller { status, address });
    let (version, required) = (status.version, FirmwareVersion::OLDEST_SUPPORTED);
    if version < required {
        return Err(Error::FirmwareTooOld { found: version, required });
    }
    notice!(Info, "{} with firmware {version} at {host}:{port}", status.name());
    client.set_i2c_access(I2cAccess {
        line: i2c.clone(),
        port: *i2c_port,
        at_once: *i2c_port_is_known,
    });
    client.start_online()?;
    let mut exchange = Exchange::new(settings.mode, version);
    let config_updates = client.update_configs(&mut exchange, areas)?;
    Ok((Link { client, exchange }, config_updates))
}
