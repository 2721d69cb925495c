//! The cycle: outputs to the controller, inputs to the program, and time for the program to answer.

use std::time::Duration;

use crate::client::Endpoint;
#[cfg(not(all(test, shuttle)))]
use crate::client::TxtClient;
use crate::error::Error;
use crate::exchange::{Inputs, SentConfigs};
use crate::handler::events::Comparison;
#[cfg(all(test, shuttle))]
use crate::handler::model::TxtClient;
use crate::handler::parts::state::Stop;
use crate::handler::shared::{CameraCommand, Shared, State};
use crate::handler::sync::{now, MutexGuard};
use crate::handler::transfer::calls::Delivered;
use crate::handler::transfer::handshake::Link;
use crate::transfer_area::FishX1Transfer;
use crate::wire::StartCameraOnline;

/// How often to look in lock-step whether the camera's stream is ready.
const LOOK: Duration = Duration::from_millis(1);

/// A connection, and what one cycle keeps for the next.
pub(crate) struct Cycle<'a> {
    link: Link,
    shared: &'a Shared,
    window: Duration,
    /// The content of the next request.
    areas: Vec<FishX1Transfer>,
    /// How the controller's camera server was started, while it is running.
    camera: Option<StartCameraOnline>,
    /// After a gap, the camera's server, which is to be started again.
    camera_to_restart: Option<Endpoint>,
    /// The last two responses, if there are listeners for events.
    inputs_before: Inputs,
    inputs: Inputs,
    /// The configurations at the response before the last.
    configs_before: SentConfigs,
    /// Whether others were sent since then.
    configs_changed: bool,
}

/// Whether the controller's camera has ended, so that it can be started; otherwise exchanges go on until then. In
/// lock-step, where no exchange may come meanwhile, this waits until then or for a stop.
///
/// It may still run since before a gap, or since a program that was killed. Two cameras end the maker's firmware (4.7.0,
/// under emulation) when they stop.
fn is_camera_off(client: &mut TxtClient, shared: &Shared) -> Result<bool, Error> {
    if client.camera_pause().is_none() {
        client.stop_camera_online()?;
    }
    let pause = client.camera_pause().unwrap_or_default();
    if shared.is_lock_step() {
        shared.wait_for_stop(now() + pause);
        return Ok(shared.stop().is_none());
    }
    Ok(pause.is_zero())
}

impl<'a> Cycle<'a> {
    /// Cycles on a connection that is in online mode and has the areas' configuration.
    pub(crate) fn new(
        link: Link,
        areas: Vec<FishX1Transfer>,
        shared: &'a Shared,
        window: Duration,
    ) -> Self {
        let configs_before = *link.exchange.sent_configs();
        Self {
            link,
            shared,
            window,
            areas,
            camera: None,
            camera_to_restart: None,
            inputs_before: Inputs::default(),
            inputs: Inputs::default(),
            configs_before,
            configs_changed: false,
        }
    }

    /// One cycle. Returns a stop if the transfer is to stop.
    pub(crate) fn run(&mut self) -> Result<Option<Stop>, Error> {
        if self.shared.is_lock_step() {
            // Before the first request, too.
            while self.shared.wait_for_step() {
                self.run_command()?;
            }
            if let Some(stop) = self.take_outputs() {
                return Ok(Some(stop));
            }
        }
        self.run_command()?;
        let (delivered, locked) = self.exchange()?;
        if let Some(state) = locked {
            // There is nothing to tell between the response and its window.
            return Ok(self.shared.hold_window(Some(state), self.window, &mut self.areas));
        }
        Ok(self.finish(&delivered))
    }

    /// Ends a cycle whose response has come in: tells the program of it, and takes its outputs; in lock-step
    /// they are taken later. Returns a stop if the transfer is to stop.
    pub(crate) fn finish(&mut self, delivered: &Delivered) -> Option<Stop> {
        self.announce(delivered);
        if self.shared.is_lock_step() {
            return None;
        }
        self.take_outputs()
    }

    /// Gives the program time to answer, and takes its outputs. Returns a stop if the transfer is to stop.
    fn take_outputs(&mut self) -> Option<Stop> {
        self.shared.hold_window(None, self.window, &mut self.areas)
    }

    /// Sends what has changed, and delivers the response, as [`Shared::deliver`].
    fn exchange(&mut self) -> Result<(Delivered, Option<MutexGuard<'a, State>>), Error> {
        let Link { client, exchange } = &mut self.link;
        if self.configs_changed {
            self.configs_before = *exchange.sent_configs();
        }
        let config_updates = client.update_configs(exchange, &self.areas)?;
        self.configs_changed = config_updates > 0;
        let inputs = client.exchange(exchange, &self.areas)?;
        let (before, now) = (&mut self.inputs_before, &mut self.inputs);
        let (delivered, locked) = self.shared.deliver(inputs, config_updates, before, now);
        if delivered.logged {
            self.shared.log(&delivered, &self.areas, inputs);
        }
        Ok((delivered, locked))
    }

    /// Tells the program of a response: first the threads that wait for it, then the listeners.
    ///
    /// In lock-step the listeners come first, so that all events of a response are there when a wait for it
    /// ends.
    fn announce(&self, delivered: &Delivered) {
        let events_first = self.shared.is_lock_step();
        if events_first {
            self.tell_events(delivered);
        }
        if delivered.opens_later {
            self.shared.open_window();
        }
        if !events_first {
            self.tell_events(delivered);
        }
    }

    fn tell_events(&self, delivered: &Delivered) {
        if delivered.listened.is_empty() {
            return;
        }
        let comparison = Comparison {
            first: delivered.first,
            kinds: delivered.listened,
            before: &self.inputs_before,
            now: &self.inputs,
            configs_before: &self.configs_before,
            configs: self.link.exchange.sent_configs(),
            sent: &self.areas,
        };
        let Delivered { number, cycle, arrived, .. } = *delivered;
        self.shared.listeners.lock().tell_response(&comparison, number, cycle, arrived);
    }

    /// Sends the program's command, if there is one. After a gap, starts the camera again before that.
    ///
    /// What must wait is tried again in the next cycle.
    fn run_command(&mut self) -> Result<(), Error> {
        let client = &mut self.link.client;
        if let (Some(start), Some(server)) = (&self.camera, &self.camera_to_restart) {
            if !is_camera_off(client, self.shared)? {
                return Ok(());
            }
            let Some(server) = self.shared.prepare_camera(server) else {
                if self.shared.is_lock_step() {
                    // No exchange may come meanwhile.
                    self.shared.wait_for_stop(now() + LOOK);
                }
                return Ok(());
            };
            client.start_camera_online(start)?;
            self.shared.resume_camera(server);
            self.camera_to_restart = None;
        }
        match self.shared.command() {
            Some(CameraCommand::Start(start)) => {
                if !is_camera_off(client, self.shared)? {
                    return Ok(());
                }
                client.start_camera_online(&start)?;
                self.camera = Some(start);
                // A gap before this start has left nothing to start again.
                self.camera_to_restart = None;
            }
            Some(CameraCommand::Stop) => {
                client.stop_camera_online()?;
                self.camera = None;
            }
            None => return Ok(()),
        }
        self.shared.command_is_done();
        Ok(())
    }

    /// Goes on with a new connection after a lost one: makes the first exchange on it, with the current
    /// outputs. The next cycle starts the camera again, if it was running, with its server at `camera`.
    pub(crate) fn go_on_with(
        &mut self,
        link: Link,
        camera: Option<Endpoint>,
    ) -> Result<Delivered, Error> {
        self.configs_before = *link.exchange.sent_configs();
        self.configs_changed = false;
        self.link = link;
        self.areas = self.shared.outgoing();
        self.camera_to_restart = camera;
        let (delivered, _) = self.exchange()?;
        Ok(delivered)
    }

    /// Stops motors and sounds with a last exchange and ends online mode.
    pub(crate) fn leave(&mut self) -> Result<(), Error> {
        self.link.exchange.end_sounds();
        let (delivered, _) = self.exchange()?;
        self.announce(&delivered);
        if self.camera.is_some() && self.camera_to_restart.is_none() {
            self.link.client.stop_camera_online()?;
        }
        self.link.client.stop_online()
    }

    /// Stops the motors over a connection that may not work any more.
    pub(crate) fn abandon(&mut self) {
        let Link { client, exchange } = &mut self.link;
        let mut request = Vec::new();
        exchange.end_sounds();
        // There are areas, so there is a request.
        if exchange.request(&self.areas, &mut request).is_ok() {
            client.abandon(&request);
        }
    }

    /// The outputs of the last request, to be stopped.
    pub(crate) fn areas_mut(&mut self) -> &mut [FishX1Transfer] {
        &mut self.areas
    }
}
