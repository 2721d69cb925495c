//! The program's calls that subscribe to events.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::area::TransferArea;
use super::com_handler::TransferAreaComHandler;
use super::events::{CycleLog, EventKind, Events, Source, Step};
use super::shared::Shared;
use super::state::Stop;
use crate::error::Error;
use crate::terminals::Motor;

impl TransferArea {
    /// Subscribes to events of these kinds, on a channel that holds up to `capacity` of them,
    /// 1..=[`Events::MAX_CAPACITY`]. This replaces FtTxtLib's callbacks; see [`Event`](crate::Event).
    ///
    /// Events come for changes after this call, from a response or from the state of the transfer. An event
    /// comes after the change is in the areas: a listener that locks them finds it there, and what it writes
    /// within the reaction window goes out in the next request. Threads in
    /// [`wait_cycle`](Self::wait_cycle) that are done sooner end the window sooner, so to answer
    /// immediately, wait there instead.
    ///
    /// The transfer thread does not wait for a listener. While the channel is full, new events are
    /// dropped and [counted](Events::lost); those in it stay, in order.
    ///
    /// [`Event::TransferEnded`](crate::Event::TransferEnded) comes to every listener, also to one that has
    /// not asked for it, so that no loop waits for ever. There is one more place for it in the channel: it
    /// comes even when the channel is full, unless that of an earlier transfer is still in it.
    ///
    /// If the handler was already dropped, the channel has ended.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        Error::check_range("capacity for events", capacity, 1..=Events::MAX_CAPACITY as i64)?;
        let shared = Arc::clone(self.shared());
        Ok(Events::new(&self.shared().listeners, kinds, capacity, Subscribed(shared)))
    }
}

impl TransferArea {
    /// Logs every cycle from now on, for a recorder: each request with the response to it, and the beginnings,
    /// gaps and ends of transfers. The channel holds up to `capacity` cycles, 1..=[`CycleLog::MAX_CAPACITY`],
    /// each of about 9 kB; a few other entries have more room.
    ///
    /// The transfer thread does not wait for a log, and allocates nothing for a cycle. While the channel is
    /// full, new entries are lost; the next one that fits [tells how many](crate::LogEntry::lost).
    ///
    /// If a transfer is running, the first entry is its beginning. If the handler was already dropped, the
    /// channel has ended.
    ///
    /// ```
    /// use ft_transfer_area_simulator::SimulatedTxt;
    /// use ft_transfer_area::{Logged, TransferAreaComHandler};
    ///
    /// # fn run() -> Result<(), Box<dyn std::error::Error>> {
    /// let txt = SimulatedTxt::builder().start()?;
    /// let handler = TransferAreaComHandler::builder(txt.address().to_string()).build()?;
    /// let log = handler.cycle_log(500)?; // five seconds
    /// handler.begin_transfer()?;
    /// handler.wait_cycle()?.iter_mut().for_each(|area| area.output.duty[0] = 512);
    /// handler.end_transfer()?;
    /// drop(handler);
    ///
    /// let entries: Vec<Logged> = log.map(|entry| entry.what).collect();
    /// let Some(Logged::Began(began)) = entries.first() else { panic!("it begins so") };
    /// assert_eq!(began.device_name, "TX2013");
    /// let cycles = entries.iter().filter(|entry| matches!(entry, Logged::Cycle(_)));
    /// assert!(cycles.count() >= 2, "the last one stops the motors");
    /// # Ok(())
    /// # }
    /// # run().unwrap();
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    pub fn cycle_log(&self, capacity: usize) -> Result<CycleLog, Error> {
        Error::check_range("capacity for a log", capacity, 1..=CycleLog::MAX_CAPACITY as i64)?;
        let shared = self.shared();
        Ok(CycleLog::new(Arc::clone(&shared.listeners), shared.add_log(capacity)))
    }

    /// Sends [`Event::MotorStalled`](crate::Event::MotorStalled) when a motor should turn but its counter does
    /// not change for `limit`. With `None`, the default, this event is never sent.
    ///
    /// This is for motors with an encoder at the counter of the same number; for others an unchanged counter
    /// means nothing. The time is measured between responses, and starts with the response to the first
    /// request that makes the motor turn. Choose a limit above the time that the motor needs to start, about
    /// 100 ms; zero tells of it with that response, and [`Duration::MAX`] never. The limit is the same for all listeners, and stays for later transfers. It is checked only
    /// while there is a listener for this kind of event.
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use ft_transfer_area::transfer_area::LOCAL_IO;
    /// use ft_transfer_area::tx::Motor;
    /// use ft_transfer_area::{Error, Event, EventKind, TransferArea};
    ///
    /// /// Drives M1 against its stop, which has no switch; returns whether it got there in time.
    /// fn drive_to_stop(area: &TransferArea) -> Result<bool, Error> {
    ///     area.set_stall_limit(LOCAL_IO, Motor::M1, Some(Duration::from_millis(300)))?;
    ///     let events = area.events(&[EventKind::MotorStalled, EventKind::TransferEnded], 10)?;
    ///     area.lock()[LOCAL_IO].output.duty[0] = 200;
    ///     let told = events.recv_timeout(Duration::from_secs(10));
    ///     area.lock()[LOCAL_IO].output.duty[0] = 0;
    ///     Ok(told.is_ok_and(|told| matches!(told.event, Event::MotorStalled { .. })))
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist.
    pub fn set_stall_limit(
        &self,
        area: usize,
        motor: Motor,
        limit: Option<Duration>,
    ) -> Result<(), Error> {
        self.check_area(area)?;
        self.shared().listeners.lock().set_stall_limit(area, motor, limit);
        Ok(())
    }
}

/// The transfer that a subscription belongs to.
struct Subscribed(Arc<Shared>);

impl Source for Subscribed {
    fn panicked(&self) {
        self.0.ask_to_stop(Stop::ProgramPanicked);
    }

    fn step(&self) -> Step {
        self.0.step()
    }

    fn now(&self) -> Instant {
        self.0.clock().now()
    }
}

impl TransferAreaComHandler {
    /// Subscribes to events. See [`TransferArea::events`].
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        self.area().events(kinds, capacity)
    }

    /// Logs every cycle from now on. See [`TransferArea::cycle_log`].
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    pub fn cycle_log(&self, capacity: usize) -> Result<CycleLog, Error> {
        self.area().cycle_log(capacity)
    }

    /// Sends an event when a motor stalls. See [`TransferArea::set_stall_limit`].
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for an area that does not exist.
    pub fn set_stall_limit(
        &self,
        area: usize,
        motor: Motor,
        limit: Option<Duration>,
    ) -> Result<(), Error> {
        self.area().set_stall_limit(area, motor, limit)
    }
}
