//! A handler of a run, and the controller that it talks to.

use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};
use std::thread;
use std::time::Duration;

use ft_transfer_area::{TimeLimits, TransferAreaComHandler, TransferAreas, TransferMode};
use ft_transfer_area_simulator::{Fault, Machine, SimulatedTxt};

use super::plan::Setup;
use super::program::locked;
use super::record::{Exchange, Record};
use crate::proxy::Proxy;

/// The limit for connecting, and for a response.
pub(crate) const CONNECT_LIMIT: Duration = Duration::from_millis(300);
pub(crate) const READ_LIMIT: Duration = Duration::from_millis(250);
/// After this time without a request, the simulated TXT closes the connection.
pub(crate) const IDLE_LIMIT: Duration = Duration::from_secs(3);
/// After this time without one, its board clears the outputs, so that each run ends with motors off.
const BOARD_WATCHDOG: Duration = Duration::from_millis(500);

/// After so many exchanges a controller takes its time, because the rules compare each with each.
const MOST_AT_FULL_SPEED: u64 = 30_000;

pub(crate) struct Slot {
    /// `None` when the program has dropped it.
    handler: Mutex<Option<Arc<TransferAreaComHandler>>>,
    /// The handle that all threads share.
    pub(crate) shared: TransferAreas,
    // The connection is closed before the controller is gone.
    _proxy: Option<Proxy>,
    txt: SimulatedTxt,
}

impl Slot {
    pub(crate) fn new(setup: &Setup, seed: u64, which: usize, record: &Arc<Record>) -> Self {
        let txt = controller(setup, seed, which, record);
        let strikes = setup.network;
        let proxy = strikes.map(|strike| Proxy::start(txt.port(), [strike]));
        let port = proxy.as_ref().map_or(txt.port(), Proxy::port);
        let handler = handler(setup, port, &txt);
        let shared = handler.areas().clone();
        Self { handler: Mutex::new(Some(Arc::new(handler))), shared, _proxy: proxy, txt }
    }

    pub(crate) fn handler(&self) -> Option<Arc<TransferAreaComHandler>> {
        locked(&self.handler).clone()
    }

    /// Drops the handler now or, if other threads are in its calls, when the last one returns.
    pub(crate) fn drop_handler(&self) -> Option<Weak<TransferAreaComHandler>> {
        let handler = locked(&self.handler).take()?;
        let left = Arc::downgrade(&handler);
        drop(handler);
        Some(left)
    }

    pub(crate) fn with_machine<R>(&self, f: impl FnOnce(&mut Machine) -> R) -> R {
        self.txt.with_machine(f)
    }

    /// Waits until no motor is on.
    pub(crate) fn wait_until_off(&self, limit: Duration) -> bool {
        let is_off = |machine: &Machine| Exchange::of(machine).is_off();
        self.txt.wait_until(is_off, limit)
    }
}

fn controller(setup: &Setup, seed: u64, which: usize, record: &Arc<Record>) -> SimulatedTxt {
    let record = Arc::clone(record);
    let mut txt = SimulatedTxt::builder()
        .extensions(setup.extension.into())
        .pace(Duration::from_millis(setup.pace_ms))
        .idle_limit(IDLE_LIMIT)
        .board_watchdog(BOARD_WATCHDOG)
        .camera_start_up(Duration::from_millis(30))
        .seed(seed)
        .on_exchange(move |machine| {
            // All inputs of a response are the same number.
            let number = (machine.exchanges() % 5000) as i16;
            machine.controllers[0].uni = [number; 8];
            record.trace(which).exchanges.push(Exchange::of(machine));
            if machine.exchanges() > MOST_AT_FULL_SPEED {
                thread::sleep(Duration::from_millis(1));
            }
        });
    for (exchange, kind) in &setup.faults {
        txt = txt.fault(Fault::at_exchange(*exchange, *kind));
    }
    if setup.lock_step {
        txt = txt.lock_step();
    }
    let txt = txt.start().expect("a simulated TXT starts");
    txt.with_machine(|machine| machine.i2c_device(0x20)[0] = 7);
    txt
}

fn handler(setup: &Setup, port: u16, txt: &SimulatedTxt) -> TransferAreaComHandler {
    let limits = TimeLimits::default().connect(CONNECT_LIMIT).read(READ_LIMIT).write(READ_LIMIT);
    let ms = Duration::from_millis;
    let mut builder = TransferAreaComHandler::builder(format!("127.0.0.1:{port}"))
        .camera_port(txt.camera_port())
        .i2c_port(txt.i2c_port())
        .areas(1 + usize::from(setup.extension))
        .time_limits(limits)
        .reaction_window(ms(setup.window_ms));
    if setup.simple {
        builder = builder.mode(TransferMode::Simple);
    }
    if let Some(limit) = setup.watchdog_ms {
        builder = builder.watchdog(ms(limit));
    }
    if let Some(limit) = setup.reconnect_ms {
        builder = builder.reconnect(ms(limit));
    }
    if setup.lock_step {
        builder = builder.lock_step();
    }
    builder.build().expect("these settings are right")
}

/// Longer than the limit of a hook. Other threads may wait for its areas meanwhile.
const HANGS: Duration = Duration::from_millis(800);

/// Where hooks hang until the program ends, for the longest time of [`HANGS`].
#[derive(Default)]
pub(crate) struct Gate {
    open: Mutex<bool>,
    opened: Condvar,
}

impl Gate {
    pub(crate) fn wait(&self) {
        let open = locked(&self.open);
        let waited = self.opened.wait_timeout_while(open, HANGS, |open| !*open);
        drop(waited.unwrap_or_else(PoisonError::into_inner));
    }

    pub(crate) fn open(&self) {
        *locked(&self.open) = true;
        self.opened.notify_all();
    }
}
