//! The thread of one controller: keeps the connection, carries out commands, publishes the state.

use std::mem;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;
use ft_transfer_area::{Error, FishX1Transfer, TransferAreaComHandler};
use tokio::sync::watch;

use super::camera::Camera;
use super::common::Common;
use super::control_lock::ControlLock;
use super::histogram::Histogram;
use super::order::{not_connected, stopped, Order};
use super::problem::{Problem, REPLACED};
use super::request::I2cRequest;
use super::state::{self, HostState, Link, Newest, Phase, STATE_PERIOD};
use super::world::Simulated;
use crate::commands::{absent, is_connected, stop_absent, stop_all, Command, Reconfigured};
use crate::recording::on_demand::Button;

/// How long to wait for a response before looking after everything else.
const WAIT: Duration = Duration::from_millis(40);
/// How long to wait before connecting again to a controller that is not there.
const PAUSE: Duration = Duration::from_secs(1);

/// A command for the area with this index.
pub(super) type AreaOrder = Order<(usize, Command)>;

/// A controller, as all its threads know it.
#[derive(Clone)]
pub(super) struct Controller {
    pub(super) handler: Arc<TransferAreaComHandler>,
    pub(super) simulated: Option<Arc<Simulated>>,
    pub(super) camera: Arc<Camera>,
    pub(super) button: Button,
    pub(super) common: Arc<Common>,
    pub(super) running: Arc<AtomicBool>,
    pub(super) outputs: Arc<Outputs>,
}

/// Under which lease the outputs of a controller were set. Whoever has the areas may look.
#[derive(Debug, Default)]
pub(super) struct Outputs {
    lease: AtomicU64,
}

impl Outputs {
    /// Sets all outputs to 0 if the worker has not seen yet that another lease has begun. It does the same, in any case.
    pub(super) fn stop_outdated(&self, control: &ControlLock, areas: &mut [FishX1Transfer]) {
        if self.lease.load(Ordering::Relaxed) != control.lease() {
            stop_all(areas);
        }
    }
}

pub(super) struct Worker {
    controller: Controller,
    orders: Receiver<AreaOrder>,
    /// Those for another thread, which this one only refuses.
    for_i2c: Receiver<Order<I2cRequest>>,
    publish: watch::Sender<Newest>,
    phase: Phase,
    /// Why there is no connection, or that this is another controller.
    error: Option<Problem>,
    /// The name of the controller that was driven last.
    driven: Option<String>,
    histogram: Histogram,
    next_state: Instant,
    reconfigured: Reconfigured,
    /// The connection was lost and is not made again, so outputs may be on.
    is_cut: bool,
}

impl Worker {
    pub(super) fn new(
        controller: Controller,
        orders: Receiver<AreaOrder>,
        for_i2c: Receiver<Order<I2cRequest>>,
        publish: watch::Sender<Newest>,
    ) -> Self {
        let worker = Self {
            controller,
            orders,
            for_i2c,
            publish,
            phase: Phase::Connecting,
            error: None,
            driven: None,
            histogram: Histogram::default(),
            next_state: Instant::now(),
            reconfigured: Reconfigured::default(),
            is_cut: false,
        };
        // A page that comes before the first response sees a whole state, too.
        worker.publish_now();
        worker
    }

    /// Works until the program ends; returns whether the outputs are off then, as far as that is known.
    pub(super) fn run(mut self) -> bool {
        // Other threads have the handler, too, so only a handle of this thread notices its panic.
        let _handle = self.controller.handler.areas().clone();
        while !self.controller.common.is_ending() {
            self.histogram = Histogram::default();
            match self.controller.handler.begin_transfer() {
                Ok(()) => self.transfer(),
                Err(error) => self.lose(Phase::Connecting, error),
            }
            self.pause();
        }
        let ended = self.controller.handler.end_transfer();
        if let Err(error) = &ended {
            log::info!("the transfer ended: {error:#}");
        }
        // One that never answered has nothing on.
        !self.is_cut && (self.phase != Phase::Running || ended.is_ok())
    }

    /// Cycles until the transfer ends or the program does.
    fn transfer(&mut self) {
        while !self.controller.common.is_ending() {
            match self.cycle() {
                Ok(()) => {}
                Err(Error::WaitTimedOut { .. }) => self.idle(),
                Err(Error::WatchdogExpired { .. }) => {
                    // What was ordered meanwhile comes too late to be wanted.
                    self.controller.common.control.stop_after_hang();
                    self.idle();
                }
                Err(error @ Error::ConnectionLost { .. }) => self.lose(Phase::Gap, error),
                Err(error) => return self.lose(Phase::Connecting, error),
            }
        }
    }

    /// Waits for a response, and answers it.
    fn cycle(&mut self) -> Result<(), Error> {
        let handler = Arc::clone(&self.controller.handler);
        let mut areas = handler.areas().wait_cycle_for(WAIT)?;
        self.histogram.count(areas.cycle(), areas.arrived());
        if self.phase != Phase::Running {
            self.refuse_orders();
            self.error = self.replaced();
            self.phase = Phase::Running;
            self.is_cut = false;
            self.reconfigured = Reconfigured::default();
            self.controller.running.store(true, Ordering::Relaxed);
        }
        stop_absent(&mut areas);
        self.obey(&mut areas);
        let (cycle, mut reconfigured) = (areas.cycle(), mem::take(&mut self.reconfigured));
        reconfigured.change(&mut areas, cycle, |areas| self.carry_out(areas));
        self.reconfigured = reconfigured;
        let copy = self.is_due().then(|| areas.to_vec());
        // The request goes out before the state is written.
        drop(areas);
        if let Some(areas) = copy {
            self.publish(areas);
        }
        Ok(())
    }

    /// What a page tells when another controller answers than the one that was driven last. The library warns of it.
    fn replaced(&mut self) -> Option<Problem> {
        let now = self.controller.handler.device_name()?;
        let before = self.driven.replace(now.clone()).filter(|before| *before != now)?;
        self.controller.camera.replaced();
        let text = format!("{now} answers in place of {before}, whose motors may go on");
        Some(Problem::new(REPLACED, text))
    }

    /// In another lease than before, nothing that was set counts any more. Returns the present one.
    fn obey(&self, areas: &mut [FishX1Transfer]) -> u64 {
        let lease = self.controller.common.control.lease();
        if self.controller.outputs.lease.swap(lease, Ordering::Relaxed) != lease {
            stop_all(areas);
        }
        lease
    }

    fn carry_out(&mut self, areas: &mut [FishX1Transfer]) {
        while let Ok(order) = self.orders.try_recv() {
            // A lease that begins after this look is found before the next order or in the next cycle.
            let lease = self.obey(areas);
            let result = if order.lease != lease {
                Err(stopped())
            } else {
                let (index, command) = &order.request;
                let connected = is_connected(areas, *index);
                match areas.get_mut(*index) {
                    Some(_) if !connected => Err(Problem::new("absent", absent(*index))),
                    Some(area) => command.apply(area).map_err(Problem::from),
                    None => Err(no_area(*index, areas.len())),
                }
            };
            if result.as_ref().is_err_and(Problem::is_senseless) {
                self.controller.common.control.stop();
            }
            order.reply.send(result.map(|()| None));
        }
    }

    /// There is no connection for now.
    fn lose(&mut self, phase: Phase, error: Error) {
        self.controller.running.store(false, Ordering::Relaxed);
        // After that no picture of before is shown.
        self.controller.camera.forget();
        self.is_cut |= self.phase == Phase::Running;
        (self.phase, self.error) = (phase, Some(error.into()));
        self.reconfigured = Reconfigured::default();
        self.histogram.interrupt();
        self.refuse_orders();
        self.publish_now();
    }

    /// What was ordered for the connection before, or without one, moves nothing on the next one. Another controller may
    /// answer there.
    fn refuse_orders(&self) {
        let replies = self.orders.try_iter().map(|order| order.reply);
        for reply in replies.chain(self.for_i2c.try_iter().map(|order| order.reply)) {
            reply.send(Err(not_connected()));
        }
    }

    /// What has to be done without a response, too.
    fn idle(&mut self) {
        if self.phase != Phase::Running {
            self.refuse_orders();
        }
        if self.is_due() {
            self.publish_now();
        }
    }

    fn pause(&mut self) {
        let end = Instant::now() + PAUSE;
        while !self.controller.common.is_ending() && Instant::now() < end {
            thread::sleep(WAIT);
            self.idle();
        }
    }

    /// Whether it is time to publish the state.
    fn is_due(&mut self) -> bool {
        let now = Instant::now();
        if now < self.next_state {
            return false;
        }
        // A few milliseconds late is still on time; after a longer pause it begins anew.
        self.next_state = (self.next_state + STATE_PERIOD).max(now);
        true
    }

    fn publish_now(&self) {
        let areas = self.controller.handler.areas().lock().to_vec();
        self.publish(areas);
    }

    fn publish(&self, mut areas: Vec<FishX1Transfer>) {
        self.reconfigured.show_before(&mut areas);
        let handler = &self.controller.handler;
        let statistics = handler.areas().statistics();
        let state = HostState {
            at: self.controller.common.begin.elapsed().as_millis(),
            link: Link {
                phase: self.phase,
                name: handler.device_name(),
                firmware: handler.version().map(|version| version.to_string()),
                error: self.error.as_ref(),
                cycle_ms: statistics.last_cycle.as_secs_f64() * 1000.0,
                histogram: self.histogram.bins(),
                cycles: statistics.cycles,
                late: statistics.late_reactions,
                gaps: statistics.gaps,
            },
            areas: state::areas(&areas, self.phase == Phase::Running),
            world: self.controller.simulated.as_ref().and_then(|simulated| simulated.report()),
            camera: self.controller.camera.state(),
            i2c: self.phase == Phase::Running,
            watched: None,
            lesson: None,
            recording: Some(self.controller.button.state()),
        };
        state.publish(&self.publish);
    }
}

fn no_area(area: usize, count: usize) -> Problem {
    Problem::out_of_range("area", area.try_into().unwrap_or(i64::MAX), 0, count as i64 - 1)
}
