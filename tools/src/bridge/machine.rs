//! One controller: its transfer, begun again and again, and what each response brings.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;
use ft_transfer_area::transfer_area::{IZ_MOTOR, MAX_AREAS};
use ft_transfer_area::tx::Motor;
use ft_transfer_area::{Error, Event, Events, FishX1Transfer, TimeLimits, TransferAreaComHandler};

use super::relay::{Relay, Setup};
use super::report::{Stage, TOLD};
use crate::commands::{stop_absent, Reconfigured};
use crate::guardian::Guardian;

/// How long a response may take before the broker is checked without one.
const LOOK: Duration = Duration::from_millis(100);

/// For how long to try to re-establish a lost connection before the transfer counts as ended.
const GAP_LIMIT: Duration = Duration::from_secs(10);

/// How long to wait before the next transfer is begun.
const PAUSE: Duration = Duration::from_secs(1);

/// When this program itself hangs for this time, the motors are stopped.
const WATCHDOG: Duration = Duration::from_secs(1);

/// Connecting may take this long; a lookup or a controller that hangs delays the end of the program.
const CONNECT_LIMIT: Duration = Duration::from_secs(2);

/// How many events may wait until the next cycle: more than come in a second.
const EVENTS: usize = 4096;

/// Connects one controller to the broker until `stop`.
pub(crate) struct Machine<'a> {
    handler: TransferAreaComHandler,
    events: Events,
    relay: Relay,
    stop: &'a AtomicBool,
    /// The connection was lost and is not made again.
    is_cut: bool,
    reconfigured: Reconfigured,
    /// Events that the library or the broker had no room for.
    lost: u64,
    told_lost: u64,
    /// Motors whose counters have counted. Of others an unchanged counter says nothing: they have no encoder.
    have_turned: [[bool; IZ_MOTOR]; MAX_AREAS],
}

/// A handler for the bridge. Nothing is connected yet.
pub(crate) fn handler(host: &str, areas: usize) -> Result<TransferAreaComHandler, Error> {
    TransferAreaComHandler::builder(host)
        .areas(areas)
        .time_limits(TimeLimits::default().connect(CONNECT_LIMIT))
        .reconnect(GAP_LIMIT)
        .watchdog(WATCHDOG)
        .build()
}

impl<'a> Machine<'a> {
    pub(crate) fn new(
        handler: TransferAreaComHandler,
        setup: Setup,
        stop: &'a AtomicBool,
    ) -> anyhow::Result<Self> {
        Self::with_relay(handler, setup.stall_limit, stop, || Relay::open(setup))
    }

    /// With this limit for motors that should turn and do not.
    fn with_relay(
        handler: TransferAreaComHandler,
        stall_limit: Option<Duration>,
        stop: &'a AtomicBool,
        relay: impl FnOnce() -> anyhow::Result<Relay>,
    ) -> anyhow::Result<Self> {
        let areas = handler.areas();
        if let Some(limit) = stall_limit {
            for area in 0..areas.lock().len() {
                for motor in Motor::ALL {
                    areas.set_stall_limit(area, motor, limit)?;
                }
            }
        }
        let events = areas.events(&TOLD, EVENTS)?;
        Ok(Self {
            handler,
            events,
            relay: relay()?,
            stop,
            is_cut: false,
            reconfigured: Reconfigured::default(),
            lost: 0,
            told_lost: 0,
            have_turned: Default::default(),
        })
    }

    /// Works until it is stopped, or the broker refuses. The motors are off when it returns, or left to the guardian.
    pub(crate) fn run(mut self, guardian: Option<Guardian>) -> anyhow::Result<()> {
        let worked = self.work();
        let ended = match self.handler.areas().is_running() {
            true => self.handler.end_transfer(),
            false => Ok(()),
        };
        match guardian {
            Some(guardian) if !self.is_cut && ended.is_ok() => guardian.dismiss(),
            // It begins now.
            guardian => drop(guardian),
        }
        let reason = match &worked {
            Ok(()) => "the bridge was ended".to_owned(),
            Err(error) => format!("{error:#}"),
        };
        self.relay.leave(&reason);
        worked?;
        ended.context("the transfer ended with an error")
    }

    fn work(&mut self) -> anyhow::Result<()> {
        while !self.should_stop() {
            // Those of the last transfer, whose responses had other numbers.
            self.publish_events();
            let reason = match self.handler.begin_transfer() {
                Ok(()) => match self.exchange()? {
                    Some(error) => error,
                    None => return Ok(()),
                },
                Err(error) => error,
            };
            self.relay.enter(Stage::Ended, Some(reason.to_string()));
            self.wait_for_next()?;
        }
        Ok(())
    }

    fn should_stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Exchanges until the transfer ends with an error; `None` when the bridge should stop.
    fn exchange(&mut self) -> anyhow::Result<Option<Error>> {
        // What came before the transfer is too late.
        self.relay.read(None)?;
        let mut copy: Vec<FishX1Transfer> = Vec::new();
        while !self.should_stop() {
            let cycle = match self.handler.areas().wait_cycle_for(LOOK) {
                Ok(mut areas) => {
                    stop_absent(&mut areas);
                    // What came while the controller was away is too late.
                    let open = !self.relay.is(Stage::Gap);
                    let cycle = areas.cycle();
                    if !self.relay.is(Stage::Online) {
                        // It may be another controller, also of the same name.
                        self.have_turned = Default::default();
                        self.reconfigured = Reconfigured::default();
                    }
                    self.reconfigured.change(&mut areas, cycle, |areas| {
                        self.relay.read(open.then_some(areas))
                    })?;
                    copy.clear();
                    copy.extend_from_slice(&areas);
                    cycle
                }
                Err(Error::WaitTimedOut { .. }) => {
                    if self.relay.is(Stage::Gap) {
                        self.relay.read(None)?;
                    }
                    continue;
                }
                Err(error @ Error::ConnectionLost { .. }) => {
                    self.is_cut = true;
                    self.relay.enter(Stage::Gap, Some(format!("{error:#}")));
                    continue;
                }
                Err(error @ Error::WatchdogExpired { .. }) => {
                    self.relay.stopped(format!("{error:#}"));
                    continue;
                }
                Err(error) => {
                    self.is_cut = true;
                    return Ok(Some(error));
                }
            };
            self.is_cut = false;
            self.publish(&copy, cycle);
        }
        Ok(None)
    }

    /// Tells every change of a digital input since the last time, and the newest values.
    fn publish(&mut self, areas: &[FishX1Transfer], cycle: u64) {
        if !self.relay.is(Stage::Online) {
            let firmware = self.handler.version().map(|version| version.to_string());
            let name = self.handler.device_name();
            self.relay.online(name, firmware);
        }
        for (turned, area) in self.have_turned.iter_mut().zip(areas) {
            for motor in Motor::ALL {
                let index = motor.index();
                let has_counted = area.input.counter[motor.counter().index()] != 0;
                // Two single outputs are no motor.
                turned[index] = area.config.motor[index] != 0 && (turned[index] || has_counted);
            }
        }
        self.publish_events();
        self.relay.publish_areas(areas, &self.reconfigured, cycle);
        let lost = self.lost + self.events.lost();
        if lost > self.told_lost {
            self.relay.publish_lost(lost - self.told_lost);
            self.told_lost = lost;
        }
    }

    fn publish_events(&mut self) {
        while let Ok(reported) = self.events.try_recv() {
            if !self.counts(&reported.event) {
                continue;
            }
            if !self.relay.publish_event(&reported) {
                self.lost += 1;
            }
        }
    }

    /// Whether an event is about something that is there.
    fn counts(&self, event: &Event) -> bool {
        match event {
            Event::MotorStalled { area, motor, .. } => self.have_turned[*area][motor.index()],
            _ => true,
        }
    }

    /// Waits before the next attempt; commands are refused meanwhile.
    fn wait_for_next(&mut self) -> anyhow::Result<()> {
        let next = Instant::now() + PAUSE;
        while Instant::now() < next && !self.should_stop() {
            self.relay.read(None)?;
            thread::sleep(LOOK / 2);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
