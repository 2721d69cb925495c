//! One controller of the panel, and the threads that work for it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};
use tokio::sync::watch;

use super::camera::{self, Camera};
use super::common::{spawn, Common};
use super::course::Course;
use super::i2c;
use super::order::{not_connected, only_looks, Order};
use super::problem::Problem;
use super::reply::Reply;
use super::request::{CameraRequest, I2cRequest, Work, WorldRequest};
use super::shown::Shown;
use super::state::Newest;
use super::watched::Watched;
use super::worker::{AreaOrder, Controller, Worker};
use super::world::Simulated;
use crate::gate::Gate;
use crate::names::Names;
use crate::recording::on_demand::{Button, Keeper};

/// How many commands may wait for a controller. It takes them 100 times a second.
const WAITING: usize = 64;
/// How long the library tries to re-establish a lost connection. After that, this program begins a new transfer.
const RECONNECT: Duration = Duration::from_secs(3600);
/// When the outputs are stopped because the worker hangs.
const WATCHDOG: Duration = Duration::from_millis(500);
const CONNECT_LIMIT: Duration = Duration::from_secs(2);

/// A controller, as the server knows it.
pub(crate) struct Host {
    pub(crate) address: String,
    pub(crate) state: watch::Receiver<Newest>,
    simulated: Option<Arc<Simulated>>,
    /// Whether a page may change the world of a simulated TXT.
    hands: bool,
    camera: Arc<Camera>,
    /// `None` if another program drives it.
    driven: Option<Driven>,
    /// Where that program goes through this one.
    gate: Option<Arc<Gate>>,
    /// Where it can be recorded.
    button: Option<Button>,
    /// What people call its terminals.
    names: Names,
    /// Whether the outputs were off then.
    ended: Receiver<bool>,
}

/// The ways to the threads of a controller that this program drives.
struct Driven {
    running: Arc<AtomicBool>,
    orders: Sender<AreaOrder>,
    i2c: Sender<Order<I2cRequest>>,
    camera: Sender<Order<CameraRequest>>,
    stopper: Sender<()>,
}

impl Host {
    /// A controller at this address, with so many areas.
    pub(crate) fn at(address: &str, areas: usize, common: &Arc<Common>) -> anyhow::Result<Self> {
        Self::start(address.to_owned(), areas, None, common)
    }

    /// A simulated TXT in this program.
    pub(crate) fn simulated(simulated: Simulated, common: &Arc<Common>) -> anyhow::Result<Self> {
        let (address, areas) = (simulated.address(), 1 + simulated.extensions());
        Self::start(address, areas, Some(Arc::new(simulated)), common)
    }

    /// A simulated TXT in this program, which another program drives.
    pub(crate) fn shown(simulated: Simulated, common: &Arc<Common>) -> Result<Self, Error> {
        let (address, simulated) = (simulated.address(), Arc::new(simulated));
        let (publish, state) = watch::channel(None);
        let (end, ended) = bounded(1);
        let shown = Shown::new(Arc::clone(&simulated), Arc::clone(common), publish);
        spawn("host", move || {
            shown.run();
            // Nobody may wait for it any more.
            let _ = end.send(true);
        })?;
        let camera = Arc::default();
        let simulated = Some(simulated);
        let (driven, gate, button) = (None, None, None);
        let (hands, names) = (true, Names::default());
        Ok(Self { address, state, simulated, hands, camera, driven, gate, button, names, ended })
    }

    /// A controller that another program drives through this one, and where to say what has happened to it.
    pub(crate) fn watched(
        address: &str,
        common: &Arc<Common>,
        gate: &Arc<Gate>,
        button: Option<Button>,
    ) -> (Self, Watched) {
        let (publish, state) = watch::channel(None);
        let camera = Arc::new(Camera::default());
        let (common, kept) = (Arc::clone(common), Arc::clone(gate));
        let watched = Watched::new(common, Arc::clone(&camera), kept, button.clone(), publish);
        // Its end is that of the program.
        let (_, ended) = bounded(0);
        let (address, gate) = (address.to_owned(), Some(Arc::clone(gate)));
        let (simulated, hands, driven, names) = (None, false, None, Names::default());
        let host =
            Self { address, state, simulated, hands, camera, driven, gate, button, names, ended };
        (host, watched)
    }

    fn start(
        address: String,
        areas: usize,
        simulated: Option<Arc<Simulated>>,
        common: &Arc<Common>,
    ) -> anyhow::Result<Self> {
        let limits = ft_transfer_area::TimeLimits::default().connect(CONNECT_LIMIT);
        let handler = TransferAreaComHandler::builder(&*address)
            .areas(areas)
            .time_limits(limits)
            .watchdog(WATCHDOG)
            .reconnect(RECONNECT)
            .build()?;
        if let Some(simulated) = &simulated {
            simulated.configure(&mut handler.areas().lock());
        }
        let (handler, camera) = (Arc::new(handler), Arc::new(Camera::default()));
        let button = Keeper::start(&handler)?;
        let controller = Controller {
            handler: Arc::clone(&handler),
            simulated: simulated.clone(),
            camera: Arc::clone(&camera),
            button: button.clone(),
            common: Arc::clone(common),
            running: Arc::default(),
            outputs: Arc::default(),
        };
        let (orders, for_worker) = bounded(WAITING);
        let (i2c, for_i2c) = bounded(i2c::WAITING);
        let (publish, state) = watch::channel(None);
        let (end, ended) = bounded(1);
        let running = Arc::clone(&controller.running);
        let stopper = start_stopper(handler.areas().clone(), &controller)?;
        let worker = Worker::new(controller, for_worker, for_i2c.clone(), publish);
        i2c::start(Arc::clone(&handler), Arc::clone(common), for_i2c)?;
        let driven = Driven {
            i2c,
            camera: camera::start(
                handler,
                Arc::clone(&camera),
                button.clone(),
                Arc::clone(&running),
            )?,
            running,
            orders,
            stopper,
        };
        let (driven, gate, button) = (Some(driven), None, Some(button));
        let (hands, names) = (true, Names::default());
        let host =
            Self { address, state, simulated, hands, camera, driven, gate, button, names, ended };
        spawn("host", move || {
            // Nobody may wait for it any more.
            let _ = end.send(worker.run());
        })?;
        Ok(host)
    }

    /// The pictures of its camera.
    pub(crate) fn pictures(&self) -> watch::Receiver<Arc<[u8]>> {
        self.camera.pictures()
    }

    pub(crate) fn is_simulated(&self) -> bool {
        self.simulated.is_some()
    }

    /// The same controller for a page that changes nothing of it.
    pub(crate) fn looked_at(&self) -> Self {
        Self {
            address: self.address.clone(),
            state: self.state.clone(),
            simulated: self.simulated.clone(),
            hands: false,
            camera: Arc::clone(&self.camera),
            driven: None,
            gate: None,
            button: None,
            names: self.names.clone(),
            ended: self.ended.clone(),
        }
    }

    /// The same with names for its terminals.
    pub(crate) fn named(self, names: Names) -> Self {
        Self { names, ..self }
    }

    /// By the number of their area.
    pub(crate) fn names(&self) -> &Names {
        &self.names
    }

    /// The lesson of its pupil.
    pub(crate) fn course(&self) -> Option<Arc<dyn Course>> {
        self.simulated.as_ref()?.course()
    }

    /// Whether a page may press buttons of its world.
    pub(crate) fn has_hands(&self) -> bool {
        self.hands
    }

    /// Whether this program drives it.
    pub(crate) fn is_driven(&self) -> bool {
        self.driven.is_some()
    }

    /// Whether another program drives it through this one.
    pub(crate) fn is_watched(&self) -> bool {
        self.gate.is_some()
    }

    /// Disconnects the program that drives it through this one, or lets programs in again.
    pub(crate) fn gate(&self, opens: bool) -> Result<(), Problem> {
        let text = "no other program drives this controller through this one";
        let gate = self.gate.as_ref().ok_or_else(|| Problem::new("not_watched", text))?;
        if opens {
            gate.open();
        } else {
            gate.shut();
        }
        Ok(())
    }

    /// Starts or stops a recording.
    pub(crate) fn record(&self, starts: bool) -> Result<(), Problem> {
        let text = "this page does not start or stop a recording";
        let clicked = self.button.as_ref().is_some_and(|button| button.click(starts));
        clicked.then_some(()).ok_or_else(|| Problem::new("not_recorded", text))
    }

    /// Ends a recording. What is returned has an end when that is done.
    pub(crate) fn end_recording(&self) -> Option<Receiver<()>> {
        self.button.as_ref().map(Button::end)
    }

    /// Sets all outputs to 0 now. The worker does it, too; this works even if that hangs.
    pub(crate) fn stop(&self) {
        if let Some(driven) = &self.driven {
            // One that is full is stopping them already.
            let _ = driven.stopper.try_send(());
        }
    }

    /// Waits until the motors are off for good and the connection is closed.
    pub(crate) fn wait_for_end(&self, deadline: Instant) -> bool {
        self.ended.recv_deadline(deadline).unwrap_or(false)
    }

    /// Hands work on to the thread that does it.
    pub(crate) fn order(&self, lease: u64, area: usize, work: Work, reply: Reply) {
        let Some(driven) = &self.driven else { return reply.send(Err(only_looks())) };
        if !driven.running.load(Ordering::Relaxed) {
            return reply.send(Err(not_connected()));
        }
        match work {
            Work::Area(command) => {
                Order { lease, request: (area, command), reply }.send_to(&driven.orders);
            }
            Work::I2c(request) => Order { lease, request, reply }.send_to(&driven.i2c),
            Work::Camera(request) => Order { lease, request, reply }.send_to(&driven.camera),
        }
    }

    /// Changes the world of a simulated TXT.
    pub(crate) fn change_world(&self, area: usize, request: &WorldRequest) -> Result<(), Problem> {
        let Some(simulated) = &self.simulated else {
            return Err(Problem::new("not_simulated", "this controller is not simulated"));
        };
        if !self.hands {
            return Err(only_looks());
        }
        simulated.change(area, request)
    }
}

/// A thread that sets all outputs of a controller to 0 when it is asked to, unless the worker has done so meanwhile: it
/// may come late, and what was ordered after the stop goes on.
fn start_stopper(areas: TransferAreas, controller: &Controller) -> Result<Sender<()>, Error> {
    let (common, outputs) = (Arc::clone(&controller.common), Arc::clone(&controller.outputs));
    let (stopper, stop) = bounded(1);
    spawn("stopper", move || {
        for () in stop {
            outputs.stop_outdated(&common.control, &mut areas.lock());
        }
    })?;
    Ok(stopper)
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::tx::Motor;
    use ft_transfer_area_simulator::SimulatedTxt;

    use std::thread;

    use super::super::control_lock::ReleaseReason;
    use super::super::reply::Answers;
    use super::*;
    use crate::commands::Command;

    const LIMIT: Duration = Duration::from_secs(30);

    /// Waits until it is true, while page 1 shows that it is there.
    fn wait_until(common: &Common, what: &str, is_true: impl Fn() -> bool) {
        let begin = Instant::now();
        while !is_true() {
            assert!(begin.elapsed() < LIMIT, "{what}");
            common.control.sign_of_life(1);
            thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn motors_stop_when_the_worker_hangs_and_what_was_ordered_meanwhile_moves_nothing() {
        let txt = SimulatedTxt::builder().start().unwrap();
        let common = Arc::new(Common::new());
        let host = Host::at(&txt.address().to_string(), 1, &common).unwrap();
        let duty = || txt.with_machine(|machine| machine.controllers[0].outputs.duty);
        let (answers, mut waiting) = Answers::channel();
        let order = |motor| {
            let lease = common.control.lease_of(1).unwrap();
            let work = Work::Area(Command::Motor { motor, duty: 512, stops_followers: true });
            host.order(lease, 0, work, answers.reply(Some(1)));
        };

        wait_until(&common, "it is connected", || {
            host.driven.as_ref().unwrap().running.load(Ordering::Relaxed)
        });
        common.control.drive(1).unwrap();
        order(Motor::M1);
        wait_until(&common, "M1 turns", || duty()[0] == 512);
        assert!(waiting.blocking_recv().unwrap().contains("\"ok\":true"));

        // The worker needs the camera's state for its report.
        let hang = host.camera.lock();
        wait_until(&common, "the watchdog has stopped M1", || duty() == [0; 8]);
        order(Motor::M2);
        drop(hang);
        wait_until(&common, "nobody drives", || common.control.driver().is_err());
        let answer = waiting.blocking_recv().unwrap();
        assert!(answer.contains("\"stopped\""), "{answer}");
        assert_eq!(common.control.driver(), Err(Some(ReleaseReason::Hang)));
        assert_eq!(duty(), [0; 8]);

        common.end();
        assert!(host.wait_for_end(Instant::now() + LIMIT));
    }

    #[test]
    fn a_late_stop_leaves_what_was_ordered_after_it() {
        let txt = SimulatedTxt::builder().start().unwrap();
        let common = Arc::new(Common::new());
        let host = Host::at(&txt.address().to_string(), 1, &common).unwrap();
        let driven = host.driven.as_ref().unwrap();
        let duty = || txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]);
        let (answers, _waiting) = Answers::channel();
        let order = |duty| {
            let lease = common.control.lease_of(1).unwrap();
            let command = Command::Motor { motor: Motor::M1, duty, stops_followers: true };
            host.order(lease, 0, Work::Area(command), answers.reply(Some(1)));
        };
        wait_until(&common, "it is connected", || driven.running.load(Ordering::Relaxed));
        common.control.drive(1).unwrap();
        order(512);
        wait_until(&common, "M1 turns", || duty() == 512);

        common.control.stop();
        wait_until(&common, "M1 stands", || duty() == 0);
        common.control.drive(1).unwrap();
        order(400);
        wait_until(&common, "M1 turns again", || duty() == 400);
        // The thread is woken only now. It takes the third request when it has done the first one.
        (0..3).for_each(|_| driven.stopper.send(()).unwrap());
        let exchanged = || txt.with_machine(|machine| machine.exchanges());
        let exchanges = exchanged();
        wait_until(&common, "an exchange", || exchanged() > exchanges + 1);
        assert_eq!(duty(), 400);

        common.end();
        assert!(host.wait_for_end(Instant::now() + LIMIT));
    }
}
