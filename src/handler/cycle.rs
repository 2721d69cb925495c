//! The cycle: outputs to the controller, inputs to the program, and time for the program to answer.

use std::sync::Arc;
use std::time::Duration;

use super::command::Command;
use super::events::Comparison;
use super::handshake::Link;
use super::hook_thread::HookThread;
use super::shared::Shared;
use super::state::Stop;
use super::transfer_side::Delivered;
use crate::error::Error;
use crate::exchange::{Inputs, SentConfigs};
use crate::transfer_area::FishX1Transfer;
use crate::wire::StartCameraOnline;

/// A connection, and what is kept from one cycle on it to the next.
pub(super) struct Cycle {
    link: Link,
    shared: Arc<Shared>,
    window: Duration,
    /// What the next request tells.
    areas: Vec<FishX1Transfer>,
    /// How the controller's camera server was started, while it is.
    camera: Option<StartCameraOnline>,
    /// The last two responses, when somebody listens for events.
    inputs_before: Inputs,
    inputs: Inputs,
    /// The configurations by which the one before came in.
    configs_before: SentConfigs,
    /// Whether others were sent since.
    configs_changed: bool,
}

impl Cycle {
    /// The cycle on a connection that is in online mode and has the areas' configuration.
    pub(super) fn new(
        link: Link,
        areas: Vec<FishX1Transfer>,
        shared: Arc<Shared>,
        window: Duration,
    ) -> Self {
        let configs_before = *link.exchange.sent_configs();
        Self {
            link,
            shared,
            window,
            areas,
            camera: None,
            inputs_before: Inputs::default(),
            inputs: Inputs::default(),
            configs_before,
            configs_changed: false,
        }
    }

    /// One cycle. Tells when the transfer is to stop.
    pub(super) fn run(&mut self, hook: &mut HookThread) -> Result<Option<Stop>, Error> {
        self.run_command()?;
        let delivered = self.exchange()?;
        if delivered.hook_first {
            hook.take_turn()?;
        }
        self.announce(&delivered);
        Ok(self.hold())
    }

    /// Gives the program time to answer, and takes its outputs. Tells when the transfer is to stop.
    pub(super) fn hold(&mut self) -> Option<Stop> {
        self.shared.hold_window(self.window, &mut self.areas)
    }

    /// Sends what has changed, and hands in the response.
    pub(super) fn exchange(&mut self) -> Result<Delivered, Error> {
        let Link { client, exchange } = &mut self.link;
        if self.configs_changed {
            self.configs_before = *exchange.sent_configs();
        }
        let config_updates = client.update_configs(exchange, &self.areas)?;
        self.configs_changed = config_updates > 0;
        let inputs = client.exchange(exchange, &self.areas)?;
        let (before, now) = (&mut self.inputs_before, &mut self.inputs);
        Ok(self.shared.deliver(inputs, config_updates, before, now))
    }

    /// Tells the program of a response: first who waits for it, then who listens for events.
    pub(super) fn announce(&self, delivered: &Delivered) {
        if delivered.hook_first {
            self.shared.open_window();
        }
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
        let listeners = self.shared.listeners.lock();
        comparison.for_each_event(|event| listeners.tell(&event, delivered.number));
    }

    /// Sends the command that the program wants to have sent.
    fn run_command(&mut self) -> Result<(), Error> {
        let client = &mut self.link.client;
        match self.shared.command() {
            Some(Command::StartCamera(start)) => {
                client.start_camera_online(&start)?;
                self.camera = Some(start);
            }
            Some(Command::StopCamera) => {
                client.stop_camera_online()?;
                self.camera = None;
            }
            None => return Ok(()),
        }
        self.shared.command_is_done();
        Ok(())
    }

    /// Takes another connection in place of the one that was lost: the first exchange on it, with the
    /// outputs as they are now, and the camera again if it ran.
    pub(super) fn go_on_with(&mut self, link: Link) -> Result<Delivered, Error> {
        self.configs_before = *link.exchange.sent_configs();
        self.configs_changed = false;
        self.link = link;
        self.areas = self.shared.outgoing();
        let delivered = self.exchange()?;
        if let Some(start) = &self.camera {
            self.link.client.start_camera_online(start)?;
        }
        Ok(delivered)
    }

    pub(super) fn camera_is_started(&self) -> bool {
        self.camera.is_some()
    }

    /// Stops the motors with a last exchange and ends online mode.
    pub(super) fn leave(&mut self) -> Result<(), Error> {
        let delivered = self.exchange()?;
        self.announce(&delivered);
        if self.camera.is_some() {
            self.link.client.stop_camera_online()?;
        }
        self.link.client.stop_online()
    }

    /// Stops the motors over a connection that may be of no use any more.
    pub(super) fn abandon(&mut self) {
        let Link { client, exchange } = &mut self.link;
        let mut request = Vec::new();
        // There are areas, so there is a request.
        if exchange.request(&self.areas, &mut request).is_ok() {
            client.abandon(&request);
        }
    }

    /// The outputs of the last request, to be stopped.
    pub(super) fn areas_mut(&mut self) -> &mut [FishX1Transfer] {
        &mut self.areas
    }
}
