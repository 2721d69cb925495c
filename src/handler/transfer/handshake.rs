//! Making a connection on which the exchange can begin.

use std::time::Duration;

use crate::client::TimeLimits;
#[cfg(not(all(test, shuttle)))]
use crate::client::TxtClient;
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
/// Calls `found` with the controller, and returns how many configurations there were.
///
/// Any thread can call this. Connecting takes at most `limit`, and each response as long as the settings
/// allow.
pub(crate) fn connect(
    settings: &Settings,
    limit: Duration,
    areas: &[FishX1Transfer],
    mut found: impl FnMut(Controller),
) -> Result<(Link, u64), Error> {
    let Settings { network, host, port, .. } = settings;
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
    client.start_online()?;
    let mut exchange = Exchange::new(settings.mode, version);
    let config_updates = client.update_configs(&mut exchange, areas)?;
    Ok((Link { client, exchange }, config_updates))
}
