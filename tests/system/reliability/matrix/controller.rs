//! A simulated TXT that records when its motors ran.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder};
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

use super::row::{By, DEADLINE};

/// The controller's idle limit in tests where it stops the motors.
pub(crate) const IDLE_LIMIT: Duration = Duration::from_secs(1);

/// The duty that the programs give to M1.
pub(crate) const DUTY: i16 = 512;

/// The exchanges that were received.
type Record = Arc<Mutex<Vec<Exchange>>>;

#[derive(Clone, Copy)]
struct Exchange {
    at: Instant,
    /// Whether it has a duty.
    on: bool,
}

/// A simulated TXT, and a thread that watches its motors.
pub(crate) struct Controller {
    pub(crate) txt: Arc<SimulatedTxt>,
    record: Record,
    finished: Arc<AtomicBool>,
    /// Returns when the motors were off again.
    watcher: Mutex<Option<JoinHandle<Option<Instant>>>>,
}

/// Longer than any test runs.
const FOREVER: Duration = Duration::from_secs(3600);

/// A simulated TXT at the controller's pace.
pub(crate) fn txt() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().idle_limit(FOREVER).camera_start_up(Duration::ZERO)
}

/// Settings for a handler of what listens at this port.
pub(crate) fn handler_at(port: u16) -> TransferAreaComHandlerBuilder {
    TransferAreaComHandler::builder(format!("127.0.0.1:{port}"))
}

/// Whether a motor is on.
pub(crate) fn is_on(machine: &Machine) -> bool {
    machine.controllers.iter().any(|controller| controller.outputs.duty != [0; 8])
}

impl Controller {
    /// A controller that never closes an idle connection.
    pub(crate) fn start(builder: SimulatedTxtBuilder) -> Self {
        Self::with_idle_limit(builder, FOREVER)
    }

    pub(crate) fn with_idle_limit(builder: SimulatedTxtBuilder, idle_limit: Duration) -> Self {
        let record = Record::default();
        let noted = Arc::clone(&record);
        let txt = builder
            .idle_limit(idle_limit)
            .on_exchange(move |machine| {
                let (at, on) = (Instant::now(), is_on(machine));
                noted.lock().unwrap().push(Exchange { at, on });
            })
            .start()
            .unwrap();
        let (txt, finished) = (Arc::new(txt), Arc::new(AtomicBool::new(false)));
        let watcher = {
            let (txt, finished) = (Arc::clone(&txt), Arc::clone(&finished));
            let record = Arc::clone(&record);
            thread::spawn(move || {
                let is_finished = || finished.load(Ordering::SeqCst);
                // They may be off again before this thread wakes.
                let was_on = || record.lock().unwrap().iter().any(|exchange| exchange.on);
                txt.wait_until(|_| was_on() || is_finished(), FOREVER);
                txt.wait_until(|machine| !is_on(machine) || is_finished(), FOREVER);
                (!is_finished()).then(Instant::now)
            })
        };
        Self { txt, record, finished, watcher: Mutex::new(Some(watcher)) }
    }

    pub(crate) fn port(&self) -> u16 {
        self.txt.port()
    }

    /// Settings for a handler of it.
    pub(crate) fn handler(&self) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandler::builder(self.txt.address())
    }

    pub(crate) fn wait(&self, what: &str, condition: impl FnMut(&Machine) -> bool) {
        assert!(self.txt.wait_until(condition, DEADLINE), "waited in vain for {what}");
    }

    /// Waits until a motor is on.
    pub(crate) fn wait_on(&self) {
        self.wait("a duty", is_on);
    }

    /// How many requests with a duty have come in after this moment.
    pub(crate) fn duties_since(&self, moment: Instant) -> usize {
        let record = self.record.lock().unwrap();
        record.iter().filter(|exchange| exchange.on && exchange.at > moment).count()
    }

    /// What has stopped the motors, and how long after the fault, if anything has. Waits until the client is gone.
    pub(crate) fn stopped_after(&self, fault: Instant) -> (By, Option<Duration>) {
        self.wait("the end of online mode", |machine| !machine.online());
        if self.txt.with_machine(|machine| is_on(machine)) {
            self.end_watcher();
            return (By::Board, None);
        }
        let off = self.finish();
        let record = self.record.lock().unwrap().clone();
        let runs = record.chunk_by(|before, after| before.on == after.on);
        assert!(runs.filter(|run| run[0].on).count() <= 1, "the motors are on again");
        let Some(index) = record.iter().rposition(|exchange| exchange.on) else {
            return (By::NeverOn, None);
        };
        let off = off.expect("motors that were on are off");
        match record.get(index + 1) {
            Some(next) => (By::Exchange, Some(next.at.saturating_duration_since(fault))),
            None => (By::Board, Some(off.saturating_duration_since(fault))),
        }
    }

    /// Stops the watcher, and returns when the motors were off.
    fn finish(&self) -> Option<Instant> {
        let watcher = self.watcher.lock().unwrap().take()?;
        // First the watcher must see that the motors are off.
        let begin = Instant::now();
        let was_on = self.record.lock().unwrap().iter().any(|exchange| exchange.on);
        while was_on && !watcher.is_finished() && begin.elapsed() < DEADLINE {
            thread::sleep(Duration::from_millis(1));
        }
        self.end_watcher();
        watcher.join().unwrap()
    }
}

impl Controller {
    /// Lets the watcher end, whether the motors are off or not.
    fn end_watcher(&self) {
        self.finished.store(true, Ordering::SeqCst);
        // Wakes the watcher.
        self.txt.with_machine(|_| ());
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.end_watcher();
        if let Some(watcher) = self.watcher.get_mut().ok().and_then(Option::take) {
            let _ = watcher.join();
        }
    }
}
