//! Re-establishing a lost connection.

use std::time::Duration;

use crate::client::Endpoint;
use crate::error::Error;
use crate::handler::parts::phase::Stop;
use crate::handler::settings::Settings;
use crate::handler::state::Controller;
use crate::handler::sync::now;
use crate::handler::transfer::cycle::Cycle;
use crate::handler::transfer::handshake;
use crate::handler::transfer::side::{Delivery, Side};
use crate::notices::notice;

/// How long to wait after a failed attempt: twice as long each time.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// How the attempts ended.
pub(crate) enum Attempts {
    /// The connection is made, and its first response has come in.
    Connected(Delivery),
    /// The transfer is to stop.
    Stopped(Stop),
}

/// Re-establishes the connection, with repeated attempts within the limit.
///
/// The outputs are stopped before this is called. The first request has the outputs that the program has
/// written since it knew of that.
pub(crate) fn reconnect(
    cycle: &mut Cycle<'_>,
    side: Side<'_>,
    settings: &Settings,
    limit: Duration,
) -> Result<Attempts, Error> {
    let (begin, lost_at) = (now(), side.state().clock.now());
    let mut pause = FIRST_PAUSE;
    loop {
        if let Some(stop) = side.stop() {
            return Ok(Attempts::Stopped(stop));
        }
        let rest = limit.saturating_sub(now() - begin);
        match attempt(cycle, side, settings, rest) {
            Ok(Attempts::Connected(delivered)) => {
                notice!(Info, "connected again after {:?}", now() - begin);
                let now = side.state().clock.now();
                side.resume(now - lost_at);
                return Ok(Attempts::Connected(delivered));
            }
            Ok(stopped) => return Ok(stopped),
            // Another attempt would find the same firmware.
            Err(error @ Error::FirmwareTooOld { .. }) => return Err(error),
            Err(error) if now() - begin >= limit => {
                return Err(Error::ReconnectFailed { limit, cause: Box::new(error) });
            }
            Err(error) => notice!(Debug, "not connected again yet: {error:#}"),
        }
        let rest = limit.saturating_sub(now() - begin);
        side.wait_for_stop(now() + pause.min(rest));
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
}

fn attempt(
    cycle: &mut Cycle<'_>,
    side: Side<'_>,
    settings: &Settings,
    rest: Duration,
) -> Result<Attempts, Error> {
    let limit = settings.limits.connect.min(rest);
    let mut host = None;
    // Before the first response, by which the program learns of the connection.
    let found = |controller: Controller| {
        host = controller.address;
        side.state().set_controller(controller);
    };
    let (mut link, config_updates) =
        handshake::connect(settings, limit, &side.0.i2c, &side.outgoing(), found)?;
    if side.is_lock_step() {
        // A command is sent after the first exchange.
        side.wait_for_step(cycle.areas_mut());
    }
    if let Some(stop) = side.stop() {
        // No motor runs, and none is to start.
        let _ = link.client.stop_online();
        return Ok(Attempts::Stopped(stop));
    }
    let camera = host.map(|host| Endpoint::at(settings.network, host, settings.camera_port));
    let delivered = match cycle.go_on_with(link, camera) {
        Ok(delivered) => delivered,
        Err(error) => {
            // What the program has written since the last gap may have moved something.
            lose(cycle, side, &error);
            return Err(error);
        }
    };
    side.state().statistics.config_updates += config_updates;
    Ok(Attempts::Connected(delivered))
}

/// Tells the program that the connection is lost, stops the motors if it still works, and closes it.
pub(crate) fn lose(cycle: &mut Cycle<'_>, side: Side<'_>, error: &Error) {
    notice!(Warn, "the connection is lost and is being re-established: {error:#}");
    side.lose_connection(error, cycle.areas_mut());
    cycle.abandon();
}
