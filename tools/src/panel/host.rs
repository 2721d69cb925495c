//! One controller of the panel, and the threads that work for it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::{Error, TransferArea, TransferAreaComHandler};
use tokio::sync::watch;

use super::camera::{self, Camera, CameraOrder};
use super::i2c::{self, I2cOrder};
use super::reply::Reply;
use super::trouble::Trouble;
use super::wheel::Wheel;
use super::wish::{AreaWish, CameraWish, I2cWish, WorldWish};
use super::worker::{Order, Worker};
use super::world::Simulated;

/// How many commands may wait for a controller. It takes them 100 times a second.
const WAITING: usize = 64;
/// How long the library goes on to make a lost connection again. After it, this program begins anew.
const RECONNECT: Duration = Duration::from_secs(3600);
/// When the outputs are stopped because the worker hangs.
const WATCHDOG: Duration = Duration::from_millis(500);
const CONNECT_LIMIT: Duration = Duration::from_secs(2);

/// What all parts of the program share.
#[derive(Debug)]
pub(crate) struct Common {
    pub(crate) wheel: Wheel,
    pub(crate) begin: Instant,
    /// The program ends.
    ending: AtomicBool,
}

impl Common {
    pub(crate) fn new() -> Self {
        Self { wheel: Wheel::default(), begin: Instant::now(), ending: AtomicBool::new(false) }
    }

    pub(crate) fn end(&self) {
        self.ending.store(true, Ordering::Relaxed);
    }

    pub(crate) fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Relaxed)
    }
}

/// A controller, as the server knows it.
pub(crate) struct Host {
    pub(crate) address: String,
    /// The newest state, without the braces around it.
    pub(crate) state: watch::Receiver<Arc<str>>,
    pub(crate) camera: Arc<Camera>,
    simulated: Option<Arc<Simulated>>,
    running: Arc<AtomicBool>,
    orders: Sender<Order>,
    i2c: Sender<I2cOrder>,
    camera_orders: Sender<CameraOrder>,
    stopper: Sender<()>,
    ended: Receiver<()>,
}

impl Host {
    /// A controller at this address, with so many areas.
    pub(crate) fn at(address: &str, areas: usize, common: &Arc<Common>) -> Result<Self, Error> {
        Self::start(address.to_owned(), areas, None, common)
    }

    /// A simulated TXT in this program.
    pub(crate) fn simulated(simulated: Simulated, common: &Arc<Common>) -> Result<Self, Error> {
        let (address, areas) = (simulated.address(), 1 + simulated.extensions());
        Self::start(address, areas, Some(Arc::new(simulated)), common)
    }

    fn start(
        address: String,
        areas: usize,
        simulated: Option<Arc<Simulated>>,
        common: &Arc<Common>,
    ) -> Result<Self, Error> {
        let limits = ft_transfer_area::TimeLimits::default().with_connect(CONNECT_LIMIT);
        let handler = TransferAreaComHandler::builder(&*address)
            .areas(areas)
            .time_limits(limits)
            .watchdog(WATCHDOG)
            .reconnect(RECONNECT)
            .build()?;
        if let Some(simulated) = &simulated {
            simulated.configure(&mut handler.lock());
        }
        let handler = Arc::new(handler);
        let (orders, for_worker) = bounded(WAITING);
        let (publish, state) = watch::channel(Arc::from(""));
        let (end, ended) = bounded(1);
        let camera = Arc::new(Camera::default());
        let running = Arc::new(AtomicBool::new(false));
        let worker = Worker::new(
            Arc::clone(&handler),
            simulated.clone(),
            Arc::clone(&camera),
            Arc::clone(common),
            Arc::clone(&running),
            for_worker,
            publish,
        );
        let host = Self {
            stopper: start_stopper(handler.transfer_area())?,
            i2c: i2c::start(Arc::clone(&handler), Arc::clone(common))?,
            camera_orders: camera::start(handler, Arc::clone(&camera))?,
            address,
            state,
            camera,
            simulated,
            running,
            orders,
            ended,
        };
        spawn("host", move || {
            worker.run();
            // Nobody may wait for it any more.
            let _ = end.send(());
        })?;
        Ok(host)
    }

    pub(crate) fn is_simulated(&self) -> bool {
        self.simulated.is_some()
    }

    /// Sets all outputs to 0 now. The worker does it, too; this works even if that hangs.
    pub(crate) fn stop(&self) {
        // One that is full is stopping them already.
        let _ = self.stopper.try_send(());
    }

    /// Waits until the motors are off for good and the connection is closed.
    pub(crate) fn wait_for_end(&self, deadline: Instant) -> bool {
        self.ended.recv_deadline(deadline).is_ok()
    }

    pub(crate) fn order(&self, turn: u64, area: usize, wish: AreaWish, reply: Reply) {
        self.when_running(reply, |reply| send(&self.orders, Order { turn, area, wish, reply }));
    }

    pub(crate) fn order_i2c(&self, turn: u64, wish: I2cWish, reply: Reply) {
        self.when_running(reply, |reply| send(&self.i2c, I2cOrder { turn, wish, reply }));
    }

    pub(crate) fn order_camera(&self, wish: CameraWish, reply: Reply) {
        self.when_running(reply, |reply| send(&self.camera_orders, CameraOrder { wish, reply }));
    }

    /// Changes the world of a simulated TXT.
    pub(crate) fn change_world(&self, area: usize, wish: &WorldWish, reply: Reply) {
        let not_simulated = || Trouble::new("not_simulated", "this controller is not simulated");
        let simulated = self.simulated.as_ref().ok_or_else(not_simulated);
        reply.send(simulated.and_then(|simulated| simulated.act(area, wish)).map(|()| None));
    }

    fn when_running(&self, reply: Reply, order: impl FnOnce(Reply)) {
        if self.running.load(Ordering::Relaxed) {
            order(reply);
        } else {
            reply.send(Err(not_connected()));
        }
    }
}

pub(super) fn not_connected() -> Trouble {
    Trouble::new("not_connected", "the controller is not connected at present")
}

pub(super) fn stopped() -> Trouble {
    Trouble::new("stopped", "the motors were stopped before this command was carried out")
}

/// Something that can be ordered, and is answered.
pub(super) trait Ordered {
    fn reply(self) -> Reply;
}

fn send<T: Ordered>(orders: &Sender<T>, order: T) {
    if let Err(full) = orders.try_send(order) {
        let text = "too many commands wait for this controller; this one was not carried out";
        full.into_inner().reply().send(Err(Trouble::new("busy", text)));
    }
}

/// A thread that sets all outputs of a controller to 0 when it is told to.
fn start_stopper(areas: TransferArea) -> Result<Sender<()>, Error> {
    let (stopper, stop) = bounded(1);
    spawn("stopper", move || {
        for () in stop {
            for area in areas.lock().iter_mut() {
                area.output.stop_motors();
            }
        }
    })?;
    Ok(stopper)
}

pub(super) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), Error> {
    let thread = thread::Builder::new().name(name.to_owned()).spawn(work);
    thread.map(drop).map_err(|error| Error::ThreadNotStarted { cause: error.into() })
}

#[cfg(test)]
mod tests {
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::super::reply::Answers;
    use super::super::wheel::Freed;
    use super::*;

    const LIMIT: Duration = Duration::from_secs(30);

    /// Waits until it is true, while page 1 shows that it is there.
    fn wait_until(common: &Common, what: &str, is_true: impl Fn() -> bool) {
        let begin = Instant::now();
        while !is_true() {
            assert!(begin.elapsed() < LIMIT, "{what}");
            common.wheel.sign_of_life(1);
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
            let turn = common.wheel.turn_of(1).unwrap();
            host.order(turn, 0, AreaWish::Motor { motor, duty: 512 }, answers.reply(Some(1)));
        };

        wait_until(&common, "it is connected", || host.running.load(Ordering::Relaxed));
        common.wheel.drive(1).unwrap();
        order(0);
        wait_until(&common, "M1 turns", || duty()[0] == 512);
        assert!(waiting.blocking_recv().unwrap().contains("\"ok\":true"));

        // The worker needs the camera's state for its report.
        let hang = host.camera.lock();
        wait_until(&common, "the watchdog has stopped M1", || duty() == [0; 8]);
        order(1);
        drop(hang);
        wait_until(&common, "nobody drives", || common.wheel.driver().is_err());
        let answer = waiting.blocking_recv().unwrap();
        assert!(answer.contains("\"stopped\""), "{answer}");
        assert_eq!(common.wheel.driver(), Err(Some(Freed::Hang)));
        assert_eq!(duty(), [0; 8]);

        common.end();
        assert!(host.wait_for_end(Instant::now() + LIMIT));
    }
}
