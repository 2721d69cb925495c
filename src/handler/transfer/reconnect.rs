//! Re-establishing a lost connection.

use std::time::Duration;

use crate::client::Endpoint;
use crate::error::Error;
use crate::handler::settings::Settings;
use crate::handler::sync::now;
use crate::handler::transfer::handshake;
use crate::handler::transfer::side::Delivery;
use crate::handler::transfer::thread::TransferThread;
use crate::notices::notice;

/// How long to wait after a failed attempt: twice as long each time.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LONGEST_PAUSE: Duration = Duration::from_secs(1);
/// How long the last attempt may take to connect, which only stops the motors: somebody waits for it.
const LAST_CONNECT: Duration = Duration::from_secs(2);
/// An attempt that fails in less time, such as by a refusal, says little about a controller that is just coming back.
const SOON: Duration = Duration::from_secs(1);

impl TransferThread<'_> {
    /// Re-establishes the connection, with repeated attempts within the limit. Returns the first response on it, or
    /// `None` if the transfer is to stop: then the motors are stopped by an exchange on it.
    ///
    /// The outputs are stopped before this is called. The first request has the outputs that the program has
    /// written since it knew of that.
    pub(super) fn reconnect(&mut self, limit: Duration) -> Result<Option<Delivery>, Error> {
        let (begin, lost_at) = (now(), self.shared.state().clock.now());
        let mut pause = FIRST_PAUSE;
        loop {
            let rest = limit.saturating_sub(now() - begin);
            let (started, is_last) = (now(), self.shared.stop().is_some());
            match self.attempt(if is_last { LAST_CONNECT } else { rest }) {
                Ok(Some(delivered)) => {
                    let peer = self.settings.peer();
                    notice!(Info, "connected to {peer} again after {:?}", now() - begin);
                    self.shared.resume(lost_at);
                    return Ok(Some(delivered));
                }
                Ok(None) => return Ok(None),
                // Another attempt would find the same firmware.
                Err(error @ Error::FirmwareTooOld { .. }) => return Err(error),
                Err(error) if is_last => return Err(error),
                Err(error) if self.shared.stop().is_some() && now() - started > SOON => {
                    return Err(error);
                }
                Err(error) if now() - begin >= limit && self.shared.stop().is_none() => {
                    return Err(Error::ReconnectFailed { limit, cause: Box::new(error) });
                }
                Err(error) => {
                    let peer = self.settings.peer();
                    notice!(Debug, "not connected to {peer} again yet: {error:#}");
                }
            }
            let rest = limit.saturating_sub(now() - begin);
            self.shared.wait_for_stop(now() + pause.min(rest));
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }

    /// Tries once to connect and to exchange; `None` if the transfer is to stop.
    fn attempt(&mut self, rest: Duration) -> Result<Option<Delivery>, Error> {
        let limit = self.settings.limits.connect.min(rest);
        let (mut link, mut config_updates) =
            handshake::connect(&self.settings, limit, self.shared)?;
        if self.shared.lock_step {
            // A command is sent after the first exchange.
            self.shared.wait_for_step(self.cycle.areas_mut());
        }
        let areas = self.shared.outgoing();
        config_updates += link.update_configs(&areas, self.shared)?;
        if self.shared.stop().is_some() {
            link.leave(areas.len())?;
            self.shared.state().left_on = None;
            return Ok(None);
        }
        let Settings { network, camera_port, .. } = self.settings;
        let host = self.shared.state().controller.as_ref().and_then(|it| it.address);
        let camera = host.map(|host| Endpoint::at(network, host, camera_port));
        let delivered = match self.cycle.go_on_with(link, areas, camera) {
            Ok(delivered) => delivered,
            Err(error) => {
                // What the program has written since the last gap may have moved something.
                self.cycle.lose(&error);
                return Err(error);
            }
        };
        self.shared.state().statistics.config_updates += config_updates;
        Ok(Some(delivered))
    }
}
