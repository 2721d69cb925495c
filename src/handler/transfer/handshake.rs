//! Making a connection on which the exchange can begin.

use std::time::Duration;

#[cfg(not(all(test, shuttle)))]
use crate::client::TxtClient;
use crate::client::{I2cAccess, I2cLine, TimeLimits};
use crate::error::Error;
use crate::exchange::{Exchange, Outgoing};
use crate::firmware::FirmwareVersion;
#[cfg(all(test, shuttle))]
use crate::handler::model::TxtClient;
use crate::handler::settings::Settings;
use crate::handler::state::Controller;
use crate::handler::sync::now;
use crate::handler::transfer::side::Side;
use crate::notices::notice;

/// A connection in online mode, and the exchange on it.
pub(crate) struct Link {
    pub(crate) client: TxtClient,
    pub(crate) exchange: Exchange,
}

/// How long to wait between two attempts while the firmware's program starts again.
const RESTART_PAUSE: Duration = Duration::from_millis(200);

/// Connects for a transfer that begins, as [`connect`]. When the controller closes the connection at StartOnline,
/// tries again within the limit for connecting.
///
/// The maker's firmware 4.7.0 (measured under emulation) ends at a StartOnline less than 5 s after another client's,
/// unless that client was right with I2C. It is back after 2 s.
pub(crate) fn begin(settings: &Settings, side: Side<'_>) -> Result<(Link, u64), Error> {
    let limit = settings.limits.connect;
    let attempt = |limit| {
        let found = |controller| side.state().set_controller(controller);
        connect(settings, limit, &side.0.i2c, &side.outgoing(), found)
    };
    let closed = match attempt(limit) {
        Err(error @ Error::ConnectionClosed { command: "StartOnline", received: 0 }) => error,
        result => return result,
    };
    notice!(Warn, "{closed}; it is tried again for {limit:?}");
    let deadline = now() + limit;
    loop {
        side.wait_for_stop(now() + RESTART_PAUSE);
        if let Some(stop) = side.stop() {
            stop.result()?;
            return Err(Error::NotStarted);
        }
        let rest = deadline.saturating_duration_since(now());
        match attempt(rest.max(RESTART_PAUSE)) {
            Err(error @ Error::FirmwareTooOld { .. }) => return Err(error),
            Err(_) if rest.is_zero() => return Err(closed),
            Err(error) => notice!(Debug, "not connected yet: {error:#}"),
            connected => return connected,
        }
    }
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
    areas: &[Outgoing],
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
