//! The cycle: outputs to the controller, inputs to the program, and time for the program to answer.

use std::cell::Cell;
use std::time::Duration;

use crate::client::Endpoint;
use crate::error::Error;
use crate::events::Comparison;
use crate::exchange::{Inputs, Outgoing, SentConfigs};
use crate::handler::parts::camera_work::CameraCommand;
use crate::handler::parts::phase::Stop;
use crate::handler::shared::Shared;
use crate::handler::state::{Delivered, State};
use crate::handler::sync::{now, MutexGuard};
use crate::handler::transfer::handshake::Link;
use crate::handler::transfer::side::Delivery;
use crate::handler::transfer::TxtClient;
use crate::wire::StartCameraOnline;

/// How often to look in lock-step whether the camera's stream is ready.
const LOOK: Duration = Duration::from_millis(1);

/// A connection, and what one cycle keeps for the next.
pub(crate) struct Cycle<'a> {
    link: Link,
    shared: &'a Shared,
    window: Duration,
    /// The content of the next request.
    areas: Vec<Outgoing>,
    /// The last two responses, if there are listeners for events.
    inputs_before: Inputs,
    inputs: Inputs,
    /// The configurations at the response before the last.
    configs_before: SentConfigs,
    /// Whether others were sent before the last one.
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
    if shared.lock_step {
        shared.wait_for_stop(now() + pause);
        return Ok(shared.stop().is_none());
    }
    Ok(pause.is_zero())
}

impl<'a> Cycle<'a> {
    /// Cycles on a connection that is in online mode and has the areas' configuration.
    pub(crate) fn new(
        link: Link,
        areas: Vec<Outgoing>,
        shared: &'a Shared,
        window: Duration,
    ) -> Self {
        let configs_before = *link.exchange.sent_configs();
        Self {
            link,
            shared,
            window,
            areas,
            inputs_before: Inputs::default(),
            inputs: Inputs::default(),
            configs_before,
            configs_changed: false,
        }
    }

    /// One cycle. Returns a stop if the transfer is to stop.
    pub(crate) fn run(&mut self) -> Result<Option<Stop>, Error> {
        if self.shared.lock_step {
            // Before the first request, too.
            let stop = loop {
                match self.shared.wait_for_step(&mut self.areas) {
                    Some(stop) => break stop,
                    None => self.run_command()?,
                }
            };
            if stop.is_some() {
                return Ok(stop);
            }
        }
        self.run_command()?;
        if let Some(stop) = self.update_configs()? {
            return Ok(Some(stop));
        }
        let (delivery, locked) = self.exchange()?;
        Ok(self.finish(&delivery, locked))
    }

    /// Ends a cycle whose response has come in: sends its events, gives the program time to answer, and takes its
    /// outputs; in lock-step they are taken later. Returns a stop if the transfer is to stop.
    ///
    /// The state may be `locked` since the delivery if there is nobody to send events to.
    pub(crate) fn finish(
        &mut self,
        delivery: &Delivery,
        locked: Option<MutexGuard<'_, State>>,
    ) -> Option<Stop> {
        self.announce(delivery);
        if self.shared.lock_step {
            return None;
        }
        self.shared.hold_window(locked, self.window, &mut self.areas)
    }

    /// Sends the configurations that have changed. Returns a stop that came meanwhile: the exchange that stops the motors
    /// needs none of them, and each waits for an answer.
    fn update_configs(&mut self) -> Result<Option<Stop>, Error> {
        let (Link { client, exchange }, shared) = (&mut self.link, self.shared);
        // Asked only when there is something to send.
        let stop = Cell::new(None);
        let goes_on = || {
            stop.set(shared.stop());
            stop.get().is_none()
        };
        let config_updates = client.update_configs(exchange, &self.areas, goes_on)?;
        if config_updates == 0 {
            return Ok(stop.get());
        }
        self.configs_changed = true;
        let mut state = shared.state();
        state.statistics.config_updates += config_updates;
        Ok(state.transfer.stop())
    }

    /// Exchanges outputs for inputs, and delivers the response, as [`Shared::deliver`].
    fn exchange(&mut self) -> Result<(Delivery, Option<MutexGuard<'a, State>>), Error> {
        let Link { client, exchange } = &mut self.link;
        let inputs = client.exchange(exchange, &self.areas)?;
        let (before, now) = (&mut self.inputs_before, &mut self.inputs);
        let (delivery, locked) = self.shared.deliver(inputs, before, now);
        if delivery.logged {
            let sent = (&*self.areas, exchange.sent_configs());
            self.shared.log(&delivery.response, sent, exchange.inputs());
        }
        Ok((delivery, locked))
    }

    /// Sends the events of a response. In lock-step only then the threads that wait for it are woken, so that all
    /// events are there when their wait ends.
    fn announce(&mut self, delivery: &Delivery) {
        self.send_events(delivery);
        if std::mem::take(&mut self.configs_changed) {
            self.configs_before = *self.link.exchange.sent_configs();
        }
        if delivery.opens_later {
            self.shared.open_window();
        }
    }

    fn send_events(&self, delivery: &Delivery) {
        if delivery.listened.is_empty() {
            return;
        }
        let comparison = Comparison {
            first: delivery.response.first,
            kinds: delivery.listened,
            before: &self.inputs_before,
            now: &self.inputs,
            configs_before: &self.configs_before,
            configs: self.link.exchange.sent_configs(),
            sent: &self.areas,
        };
        let Delivered { number, cycle, arrived, .. } = delivery.response;
        self.shared.listeners.lock().send_response(&comparison, number, cycle, arrived);
    }

    /// Does what has to be done for the camera.
    ///
    /// What must wait is tried again in the next cycle.
    fn run_command(&mut self) -> Result<(), Error> {
        let client = &mut self.link.client;
        let Some(task) = self.shared.state().camera.task() else { return Ok(()) };
        match task.command {
            CameraCommand::Stop => client.stop_camera_online()?,
            CameraCommand::Start(start) => {
                if !is_camera_off(client, self.shared)? {
                    return Ok(());
                }
                if let Some(server) = task.restart_at {
                    return self.restart_camera(&start, &server);
                }
                client.start_camera_online(&start)?;
            }
        }
        self.shared.command_is_done();
        Ok(())
    }

    /// After a gap: starts the camera's server again, when the stream is ready for that.
    fn restart_camera(
        &mut self,
        start: &StartCameraOnline,
        server: &Endpoint,
    ) -> Result<(), Error> {
        if let Some(server) = self.shared.prepare_camera(server) {
            self.link.client.start_camera_online(start)?;
            self.shared.resume_camera(server);
        } else if self.shared.lock_step {
            // The stream needs real time, and in lock-step exchanges take none.
            self.shared.wait_for_stop(now() + LOOK);
        }
        Ok(())
    }

    /// Goes on with a new connection after a lost one: makes the first exchange on it, with these outputs, whose
    /// configurations it has. The next cycle starts the camera again, if it was running, with its server at `camera`.
    pub(crate) fn go_on_with(
        &mut self,
        link: Link,
        areas: Vec<Outgoing>,
        camera: Option<Endpoint>,
    ) -> Result<Delivery, Error> {
        self.configs_before = *link.exchange.sent_configs();
        self.configs_changed = false;
        (self.link, self.areas) = (link, areas);
        self.shared.state().camera.restart_at = camera;
        let (delivery, _) = self.exchange()?;
        Ok(delivery)
    }

    /// Tells the program that the connection is lost, stops the motors if it still works, and closes it.
    pub(crate) fn lose(&mut self, error: &Error) {
        self.shared.lose_connection(error, &mut self.areas);
        self.abandon();
    }

    /// Stops motors and sounds with a last exchange and ends online mode.
    pub(crate) fn leave(&mut self) -> Result<(), Error> {
        self.link.exchange.end_sounds();
        let (delivery, _) = self.exchange()?;
        self.announce(&delivery);
        if self.shared.state().camera.is_running() {
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
        if exchange.request_of(&self.areas, &mut request).is_ok() {
            client.abandon(&request);
        }
    }

    /// The outputs of the last request, to be stopped.
    pub(crate) fn areas_mut(&mut self) -> &mut [Outgoing] {
        &mut self.areas
    }
}
