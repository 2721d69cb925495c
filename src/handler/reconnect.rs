//! Making a lost connection again.

use std::sync::Arc;
use std::time::{Duration, Instant};

use log::{debug, info, warn};

use super::cycle::Cycle;
use super::handshake;
use super::settings::Settings;
use super::shared::{Controller, Shared};
use super::state::Stop;
use super::transfer_side::Delivered;
use crate::error::Error;

/// How long to wait after an attempt that failed: twice as long each time.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// How the attempts ended.
pub(super) enum Attempts {
    /// The connection stands, and its first response has come in.
    Connected(Delivered),
    /// The transfer is to stop.
    Stopped(Stop),
}

/// Makes the connection again, however often that fails within the limit.
///
/// The outputs are stopped before, and what is sent first are the outputs that the program has written
/// since it learned of that.
pub(super) fn reconnect(
    cycle: &mut Cycle,
    shared: &Arc<Shared>,
    settings: &Settings,
    limit: Duration,
) -> Result<Attempts, Error> {
    let begin = Instant::now();
    let mut pause = FIRST_PAUSE;
    loop {
        if let Some(stop) = shared.stop() {
            return Ok(Attempts::Stopped(stop));
        }
        let rest = limit.saturating_sub(begin.elapsed());
        match attempt(cycle, shared, settings, rest) {
            Ok(Attempts::Connected(delivered)) => {
                info!("connected again after {:?}", begin.elapsed());
                shared.resume(begin.elapsed());
                return Ok(Attempts::Connected(delivered));
            }
            Ok(stopped) => return Ok(stopped),
            // Another attempt would find the same.
            Err(error @ Error::FirmwareTooOld { .. }) => return Err(error),
            Err(error) if begin.elapsed() >= limit => {
                return Err(Error::ReconnectFailed { limit, cause: Box::new(error) });
            }
            Err(error) => debug!("not connected again yet: {error}"),
        }
        let rest = limit.saturating_sub(begin.elapsed());
        shared.wait_for_stop(Instant::now() + pause.min(rest));
        pause = (2 * pause).min(LONGEST_PAUSE);
    }
}

fn attempt(
    cycle: &mut Cycle,
    shared: &Arc<Shared>,
    settings: &Settings,
    rest: Duration,
) -> Result<Attempts, Error> {
    let limit = settings.limits.connect.min(rest);
    let mut host = None;
    // Before the first response, by which the program learns that the connection stands.
    let found = |controller: Controller| {
        host = controller.address;
        shared.set_controller(controller);
    };
    let (mut link, config_updates) =
        handshake::connect(settings, limit, &shared.outgoing(), found)?;
    if let Some(stop) = shared.stop() {
        // Nothing moves yet, and nothing shall begin to.
        let _ = link.client.stop_online();
        return Ok(Attempts::Stopped(stop));
    }
    let delivered = match cycle.go_on_with(link) {
        Ok(delivered) => delivered,
        Err(error) => {
            // What the program has written since the last gap may have moved something.
            lose(cycle, shared, &error);
            return Err(error);
        }
    };
    if let Some(host) = host.filter(|_| cycle.camera_is_started()) {
        shared.resume_camera((host, settings.camera_port).into());
    }
    shared.count_config_updates(config_updates);
    Ok(Attempts::Connected(delivered))
}

/// Tells the program that the connection is lost, stops the motors as far as it allows, and closes it.
pub(super) fn lose(cycle: &mut Cycle, shared: &Shared, error: &Error) {
    warn!("the connection is lost, and is made again: {error}");
    shared.lose_connection(error, cycle.areas_mut());
    cycle.abandon();
}
