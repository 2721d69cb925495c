//! The transfer thread: runs cycles until it is stopped, and always stops the motors at the end.

use std::panic::{catch_unwind, AssertUnwindSafe};

use crate::error::{Error, Origin};
use crate::exchange::Outgoing;
use crate::handler::parts::phase::Stop;
use crate::handler::settings::Settings;
use crate::handler::shared::Shared;
use crate::handler::sync::{JoinHandle, Mutex};
use crate::handler::transfer::cycle::Cycle;
use crate::handler::transfer::handshake::Link;
use crate::notices::notice;

pub(crate) struct TransferThread<'a> {
    pub(super) cycle: Cycle<'a>,
    pub(super) shared: &'a Shared,
    pub(super) settings: Settings,
    /// Whether the connection works.
    connected: bool,
}

impl<'a> TransferThread<'a> {
    /// The work of a thread on a connection that is in online mode and has the areas' configuration.
    pub(crate) fn new(
        link: Link,
        areas: Vec<Outgoing>,
        shared: &'a Shared,
        settings: Settings,
    ) -> Self {
        let window = settings.reaction_window;
        Self { cycle: Cycle::new(link, areas, shared, window), shared, settings, connected: true }
    }

    pub(crate) fn run(mut self) {
        // A panic may leave things half done. Of these only the connection is used afterwards, and the
        // areas' outputs, which are all set below.
        let result = catch_unwind(AssertUnwindSafe(|| self.cycle_until_stopped()))
            .unwrap_or_else(|panic| Err(Error::from_panic(&*panic)));
        // Before the controller learns of the end, which would look like a failure of the stream.
        self.shared.stop_camera();
        self.shared.leave(self.cycle.areas_mut());
        let result = result.and_then(|stop| {
            if self.connected {
                self.cycle.leave()?;
                self.connected = false;
            }
            stop.result()
        });
        if self.connected {
            self.cycle.abandon();
            self.shared.state().leave_on();
        }
        drop(self.cycle);
        self.shared.finish(result.clone().err());
        let peer = self.settings.peer();
        match result {
            Ok(()) => notice!(Info, "the transfer with {peer} has ended"),
            Err(error) => notice!(Error, "the transfer with {peer} has ended: {error:#}"),
        }
    }

    /// Runs cycles until a stop is requested or an error ends it; after an error the connection can't be
    /// used any more.
    fn cycle_until_stopped(&mut self) -> Result<Stop, Error> {
        loop {
            let result = self.cycle.run().or_else(|error| self.reconnect_after(error));
            if let Some(stop) = result? {
                return Ok(stop);
            }
        }
    }

    /// Re-establishes a lost connection, if the program wants that; returns a stop if the transfer is to stop
    /// instead.
    fn reconnect_after(&mut self, error: Error) -> Result<Option<Stop>, Error> {
        let limit = self.settings.reconnect.filter(|_| error.origin() != Origin::Other);
        let Some(limit) = limit else { return Err(error) };
        let peer = self.settings.peer();
        notice!(Warn, "the connection to {peer} is lost and is being re-established: {error:#}");
        self.cycle.lose(&error);
        self.connected = false;
        let delivered = match self.reconnect(limit) {
            Ok(Some(delivered)) => delivered,
            Ok(None) => return Ok(self.shared.stop()),
            // A panic of the program is the reason that counts.
            Err(error) => {
                self.shared.stop().map_or(Ok(()), Stop::result)?;
                return Err(error);
            }
        };
        self.connected = true;
        Ok(self.cycle.finish(&delivered, None))
    }
}

/// Has the thread as soon as its transfer runs: who sees the transfer running finds its thread here.
#[derive(Debug, Default)]
pub(crate) struct ThreadSlot(Mutex<Option<(u64, JoinHandle<()>)>>);

impl ThreadSlot {
    /// Starts the thread of the transfer with this number. Others wait meanwhile.
    pub(crate) fn start<E>(
        &self,
        number: u64,
        start: impl FnOnce() -> Result<JoinHandle<()>, E>,
    ) -> Result<(), E> {
        let mut slot = self.0.lock();
        *slot = Some((number, start()?));
        Ok(())
    }

    /// Waits for the threads of transfers up to this number. Others that do so wait, too.
    pub(crate) fn join(&self, number: u64) {
        let mut slot = self.0.lock();
        if let Some((_, thread)) = slot.take_if(|(of, _)| *of <= number) {
            // The thread catches its own panics, so there is nothing to report here.
            let _ = thread.join();
        }
    }
}

#[cfg(all(test, not(shuttle)))]
mod tests {
    use std::ops::ControlFlow;
    use std::time::Duration;

    use super::*;
    use crate::events::EventKind;
    use crate::handler::shared::Shared;
    use crate::handler::transfer::handshake;
    use crate::handler::transfer::peer::Peer;
    use crate::handler::TransferAreaComHandler;
    use crate::terminals::Counter;
    use crate::wire::CommandId;

    /// The work of a transfer thread, not yet begun.
    fn work<'a>(peer: &Peer, shared: &'a Shared, areas: usize) -> TransferThread<'a> {
        let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{}", peer.port));
        let handler = builder.reaction_window(Duration::ZERO).build().unwrap();
        let settings = handler.settings().clone();
        let areas = vec![Outgoing::default(); areas];
        let (link, _) = handshake::connect(&settings, settings.limits.connect, shared).unwrap();
        TransferThread::new(link, areas, shared, settings)
    }

    #[test]
    fn a_cycle_with_listeners_and_logs_allocates_nothing() {
        let peer = Peer::start();
        let handler = TransferAreaComHandler::builder("127.0.0.1").areas(2).build().unwrap();
        let area = handler.areas().clone();
        let all = handler.areas().events(EventKind::ALL, 10_000).unwrap();
        let slow = handler.areas().events(EventKind::ALL, 1).unwrap();
        let log = handler.areas().cycle_log(1000).unwrap();
        let slow_log = handler.areas().cycle_log(1).unwrap();
        area.shared().state().transfer.begin().unwrap();
        area.shared().state().run(0).unwrap();
        let mut work = work(&peer, area.shared(), 2);
        let mut cycle = || {
            area.lock()[0].start_counter_reset(Counter::C1);
            work.cycle.run().unwrap();
        };
        // Some memory is allocated when it is first needed.
        (0..10).for_each(|_| cycle());
        let before = all.receiver().len();
        let allocations = allocation_counter::measure(|| (0..100).for_each(|_| cycle()));
        assert_eq!(allocations.count_total, 0);
        assert!(all.receiver().len() > before + 100, "there were no events");
        assert!(slow.lost() > 100, "there was nothing to lose");
        assert!(log.receiver().len() > 100, "there was no log");
        assert!(slow_log.lost() > 100, "there was nothing to lose");
        area.shared().finish(None);
    }

    #[test]
    fn a_cycle_with_a_hook_allocates_nothing() {
        let peer = Peer::start();
        let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
        let area = handler.areas().clone();
        area.shared().state().transfer.begin().unwrap();
        area.shared().state().run(0).unwrap();
        let mut work = work(&peer, area.shared(), 1);
        let set = handler.set_cycle_hook(|areas| {
            areas.unwrap()[0].output.duty[0] ^= 1;
            ControlFlow::Continue(())
        });
        set.unwrap();
        let mut cycle = || assert_eq!(work.cycle.run(), Ok(None));
        (0..10).for_each(|_| cycle());
        let allocations = allocation_counter::measure(|| (0..100).for_each(|_| cycle()));
        assert_eq!(allocations.count_total, 0);
        area.shared().finish(None);
    }

    #[test]
    fn a_panic_of_the_transfer_thread_stops_the_motors_and_is_reported() {
        let peer = Peer::start();
        let shared = Shared::running(None, false);
        // A wrong number of areas makes the thread panic.
        work(&peer, &shared, 2).run();

        assert!(matches!(
            shared.state().transfer.check_running(),
            Err(Error::ThreadPanicked { .. })
        ));
        let commands = peer.commands();
        let exchanges = commands.iter().filter(|id| **id == CommandId::ExchangeDataCmpr).count();
        assert_eq!(exchanges, 2, "the last one stops the motors");
        assert_eq!(commands.last(), Some(&CommandId::StopOnline));
    }

    #[test]
    fn a_connection_that_only_stops_the_motors_needs_no_configurations() {
        let peer = Peer::start();
        let shared = Shared::running(None, false);
        shared.state().transfer.ask_to_stop(Stop::Asked);
        let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{}", peer.port));
        let settings = builder.build().unwrap().settings().clone();
        let (link, _) = handshake::connect(&settings, settings.limits.connect, &shared).unwrap();
        link.leave(1).unwrap();
        let [status, begin, last, end] = [
            CommandId::QueryStatus,
            CommandId::StartOnline,
            CommandId::ExchangeDataCmpr,
            CommandId::StopOnline,
        ];
        assert_eq!(peer.commands(), [status, begin, last, end]);
    }
}
