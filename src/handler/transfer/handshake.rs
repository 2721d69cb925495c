//! Making a connection on which the exchange can begin.

use std::time::Duration;

use crate::client::{I2cAccess, TimeLimits};
use crate::error::Error;
use crate::exchange::{Exchange, Outgoing};
use crate::firmware::FirmwareVersion;
use crate::handler::settings::Settings;
use crate::handler::shared::Shared;
use crate::handler::state::Controller;
use crate::handler::sync::now;
use crate::handler::transfer::TxtClient;
use crate::notices::{self, notice};

/// A connection in online mode, and the exchange on it.
pub(crate) struct Link {
    pub(crate) client: TxtClient,
    pub(crate) exchange: Exchange,
}

impl Link {
    /// Hands over the configurations that have changed; returns how many there were. Whoever ends the transfer meanwhile
    /// waits for the exchange that stops the motors, which needs none of them.
    pub(crate) fn update_configs(
        &mut self,
        areas: &[Outgoing],
        shared: &Shared,
    ) -> Result<u64, Error> {
        self.client.update_configs(&mut self.exchange, areas, || shared.stop().is_none())
    }

    /// Stops motors and sounds with exchanges that do nothing else, whatever the areas say, and ends online mode.
    /// Without them, the controller keeps the outputs of the session before.
    pub(crate) fn leave(mut self, areas: usize) -> Result<(), Error> {
        let Self { client, exchange } = &mut self;
        let mut stopped = Outgoing::default();
        stopped.output.stop_motors();
        exchange.end_sounds();
        let stopped = vec![stopped; areas];
        // The first response says which extensions there are.
        for _ in 0..areas.min(2) {
            client.exchange(exchange, &stopped)?;
        }
        client.stop_online()
    }
}

/// How long to wait between two attempts while the firmware's program starts again.
pub(crate) const RESTART_PAUSE: Duration = Duration::from_millis(200);

/// Connects for a transfer that begins, as [`connect`]. When the controller closes the connection at StartOnline,
/// tries again within the limit for connecting.
///
/// The maker's firmware 4.7.0 (measured under emulation) ends at a StartOnline less than 5 s after another client's,
/// unless that client was right with I2C. It is back after 2 s.
pub(crate) fn begin(settings: &Settings, shared: &Shared) -> Result<(Link, u64), Error> {
    let limit = settings.limits.connect;
    let closed = match connect(settings, limit, shared) {
        Err(error @ Error::ConnectionClosed { command: "StartOnline", received: 0 }) => error,
        result => return result,
    };
    notice!(Warn, "{}: {closed}; it is tried again for {limit:?}", settings.peer());
    let deadline = now() + limit;
    loop {
        shared.wait_for_stop(now() + RESTART_PAUSE);
        if let Some(stop) = shared.stop() {
            stop.result()?;
            return Err(Error::NotStarted);
        }
        let rest = deadline.saturating_duration_since(now());
        match connect(settings, rest.max(RESTART_PAUSE), shared) {
            Err(error @ Error::FirmwareTooOld { .. }) => return Err(error),
            Err(_) if rest.is_zero() => return Err(closed),
            Err(error) => notice!(Debug, "not connected to {} yet: {error:#}", settings.peer()),
            connected => return connected,
        }
    }
}

/// An error for a firmware that does not know what is sent.
pub(crate) fn supported(found: FirmwareVersion) -> Result<FirmwareVersion, Error> {
    let required = FirmwareVersion::OLDEST_SUPPORTED;
    if found < required {
        return Err(Error::FirmwareTooOld { found, required });
    }
    Ok(found)
}

/// The one before may have outputs on, and nobody can tell it anything at this address.
fn warn_of_another_one(settings: &Settings, now: &str, before: &str) {
    let peer = settings.peer();
    notices::warn_always(
        concat!(module_path!(), "::another_one"),
        format_args!("{peer}: {now} answers in place of {before}, whose motors may go on"),
    );
}

/// Connects, checks the firmware, begins online mode and hands over the configurations of all areas; returns how many
/// there were. I2C requests reach the controller then, and its name and version are known.
///
/// Any thread can call this. Connecting takes at most `limit`, and each response as long as the settings
/// allow.
pub(crate) fn connect(
    settings: &Settings,
    limit: Duration,
    shared: &Shared,
) -> Result<(Link, u64), Error> {
    let Settings { network, host, port, i2c_port, i2c_port_is_known, .. } = settings;
    let limits = TimeLimits { connect: limit, ..settings.limits };
    let mut client = TxtClient::connect_within(*network, host, *port, limits)?;
    let address = client.address();
    let status = client.query_status()?;
    let replaced = shared.state().meet(Controller { status, address, peer: settings.peer() });
    if let Some(before) = replaced {
        warn_of_another_one(settings, &status.name(), &before);
    }
    let version = supported(status.version)?;
    notice!(Info, "{} with firmware {version} at {}", status.name(), settings.peer());
    client.set_i2c_access(I2cAccess {
        line: shared.i2c.clone(),
        port: *i2c_port,
        at_once: *i2c_port_is_known,
    });
    client.start_online()?;
    let mut exchange = Exchange::new(settings.mode, version);
    exchange.name_peer(settings.peer());
    exchange.tell_silence(settings.silence_is_done);
    let areas = shared.outgoing();
    let mut link = Link { client, exchange };
    let config_updates = link.update_configs(&areas, shared)?;
    Ok((link, config_updates))
}
