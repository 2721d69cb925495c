//! The transfer thread: cycles until it is stopped, and stops the motors whatever happens.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::time::Duration;

use log::{error, info};

use super::events::Comparison;
use super::mail::{Delivery, Errand, Stop};
use super::shared::Shared;
use crate::client::TxtClient;
use crate::error::Error;
use crate::exchange::{Exchange, Inputs, SentConfigs};
use crate::transfer_area::FishX1Transfer;

pub(super) struct Cycler {
    client: TxtClient,
    exchange: Exchange,
    /// What the next request tells.
    areas: Vec<FishX1Transfer>,
    shared: Arc<Shared>,
    reaction_window: Duration,
    /// Whether the controller's camera server is started.
    camera_started: bool,
    /// The response before the last one, when somebody listens for events.
    inputs_before: Inputs,
    /// The configurations by which that came in.
    configs_before: SentConfigs,
    /// Whether others were sent since.
    configs_changed: bool,
}

impl Cycler {
    /// A thread's work on a connection that is in online mode and has the areas' configuration.
    pub(super) fn new(
        client: TxtClient,
        exchange: Exchange,
        areas: Vec<FishX1Transfer>,
        shared: Arc<Shared>,
        reaction_window: Duration,
    ) -> Self {
        let configs_before = *exchange.sent_configs();
        Self {
            client,
            exchange,
            areas,
            shared,
            reaction_window,
            camera_started: false,
            inputs_before: Inputs::default(),
            configs_before,
            configs_changed: false,
        }
    }

    pub(super) fn run(mut self) {
        // Nothing that a panic may have left half done is used afterwards but the connection,
        // and the areas, of which only the outputs count, which are all set below.
        let result = catch_unwind(AssertUnwindSafe(|| self.cycle_until_stopped()))
            .unwrap_or_else(|panic| Err(Error::from_panic(&*panic)));
        // Before the controller hears of the end, which would look like a failure of the stream.
        self.shared.stop_camera();
        for area in &mut self.areas {
            area.output.stop_motors();
        }
        let result = result.and_then(|stop| {
            self.leave()?;
            match stop {
                Stop::Asked => Ok(()),
                Stop::ProgramPanicked => Err(Error::ProgramPanicked),
            }
        });
        // The motors are stopped already when it was the program that panicked.
        if !matches!(result, Ok(()) | Err(Error::ProgramPanicked)) {
            self.abandon();
        }
        drop(self.client);
        self.shared.finish(result.clone(), &self.areas);
        // Last, because a logger may panic too.
        match result {
            Ok(()) => info!("the transfer has ended"),
            Err(error) => error!("the transfer has ended: {error}"),
        }
    }

    fn cycle_until_stopped(&mut self) -> Result<Stop, Error> {
        loop {
            self.run_errand()?;
            if let Some(stop) = self.cycle()? {
                return Ok(stop);
            }
        }
    }

    fn cycle(&mut self) -> Result<Option<Stop>, Error> {
        let delivery = self.exchange()?;
        self.shared.run_hook(self.reaction_window);
        self.announce(&delivery);
        Ok(self.shared.hold_window(self.reaction_window, &mut self.areas))
    }

    /// Sends what has changed, and hands in the response.
    fn exchange(&mut self) -> Result<Delivery, Error> {
        if self.configs_changed {
            self.configs_before = *self.exchange.sent_configs();
        }
        let config_updates = self.client.update_configs(&mut self.exchange, &self.areas)?;
        self.configs_changed = config_updates > 0;
        let inputs = self.client.exchange(&mut self.exchange, &self.areas)?;
        Ok(self.shared.deliver(inputs, config_updates, &mut self.inputs_before))
    }

    /// Tells the program of a response: first who waits for it, then who listens for events.
    fn announce(&self, delivery: &Delivery) {
        self.shared.open_window();
        if delivery.listened.is_empty() {
            return;
        }
        let comparison = Comparison {
            first: delivery.first,
            kinds: delivery.listened,
            before: &self.inputs_before,
            now: self.exchange.inputs(),
            configs_before: &self.configs_before,
            configs: self.exchange.sent_configs(),
            sent: &self.areas,
        };
        let listeners = self.shared.listeners.lock();
        comparison.for_each_event(|event| listeners.tell(&event, delivery.number));
    }

    /// Sends the command that the program wants to have sent.
    fn run_errand(&mut self) -> Result<(), Error> {
        match self.shared.errand() {
            Some(Errand::StartCamera(start)) => {
                self.client.start_camera_online(&start)?;
                self.camera_started = true;
            }
            Some(Errand::StopCamera) => {
                self.client.stop_camera_online()?;
                self.camera_started = false;
            }
            None => return Ok(()),
        }
        self.shared.errand_is_done();
        Ok(())
    }

    /// Leaves a machine whose motors are to be stopped in good order.
    fn leave(&mut self) -> Result<(), Error> {
        let delivery = self.exchange()?;
        self.announce(&delivery);
        if self.camera_started {
            self.client.stop_camera_online()?;
        }
        self.client.stop_online()
    }

    /// Stops the motors over a connection that may be of no use any more.
    fn abandon(&mut self) {
        let mut request = Vec::new();
        // There are areas, so there is a request.
        if self.exchange.request(&self.areas, &mut request).is_ok() {
            self.client.abandon(&request);
        }
    }
}

#[cfg(all(test, feature = "simulator"))]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::client::TimeLimits;
    use crate::exchange::TransferMode;
    use crate::handler::{EventKind, TransferAreaComHandler};
    use crate::simulator::SimulatedTxt;
    use crate::terminals::Counter;
    use crate::wire::CommandId;

    /// A thread's work that has not begun.
    fn cycler(txt: &SimulatedTxt, shared: &Arc<Shared>, areas: usize) -> Cycler {
        let mut client =
            TxtClient::connect("127.0.0.1", txt.port(), TimeLimits::default()).unwrap();
        let exchange =
            Exchange::new(TransferMode::Compressed, client.query_status().unwrap().version);
        client.start_online().unwrap();
        let areas = vec![FishX1Transfer::default(); areas];
        Cycler::new(client, exchange, areas, Arc::clone(shared), Duration::ZERO)
    }

    #[test]
    fn a_cycle_allocates_nothing_with_listeners_and_a_hook_either() {
        let txt = SimulatedTxt::builder().pace(Duration::ZERO).extensions(1);
        let mut number = 0;
        let txt = txt.on_exchange(move |machine| {
            number += 1;
            for controller in &mut machine.controllers {
                controller.uni = [number % 2; 8];
                controller.counter = [number; 4];
                controller.ir[1].left_x = (number % 15) as i8;
            }
            machine.alive[0] = number % 4 != 0;
        });
        let txt = txt.start().unwrap();
        let mut handler = TransferAreaComHandler::builder("127.0.0.1").areas(2).build().unwrap();
        let area = handler.transfer_area();
        let all = handler.events(&EventKind::ALL, 10_000).unwrap();
        let slow = handler.events(&EventKind::ALL, 1).unwrap();
        handler.set_cycle_hook(|areas| {
            for area in areas {
                area.start_counter_reset(Counter::C1);
            }
            ControlFlow::Continue(())
        });
        area.shared().begin(0);
        let mut cycler = cycler(&txt, area.shared(), 2);
        // Some room is made when it is first needed.
        for _ in 0..10 {
            cycler.cycle().unwrap();
        }
        let before = all.receiver().len();
        let allocations = allocation_counter::measure(|| {
            for _ in 0..100 {
                cycler.cycle().unwrap();
            }
        });
        assert_eq!(allocations.count_total, 0);
        assert!(all.receiver().len() > before + 100, "there was nothing to tell");
        assert!(slow.lost() > 100, "there was nothing to lose");
        handler.end_transfer().unwrap();
    }

    #[test]
    fn a_panic_of_the_transfer_thread_stops_the_motors_and_is_told() {
        let txt = SimulatedTxt::builder().start().unwrap();
        let shared = Arc::new(Shared::new(1));
        shared.begin(0);
        // Another number of areas than the program has makes the thread panic.
        cycler(&txt, &shared, 2).run();

        assert!(matches!(shared.error(), Some(Error::Thread { .. })));
        assert!(!shared.is_running());
        let limit = Duration::from_secs(30);
        assert!(txt.wait_until(limit, |machine| !machine.connected()));
        txt.with_machine(|machine| {
            assert_eq!(machine.exchanges(), 2, "the last one stops the motors");
            assert_eq!(machine.commands().last(), Some(CommandId::StopOnline));
        });
    }
}
