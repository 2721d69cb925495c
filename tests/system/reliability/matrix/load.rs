//! Load, restarts, and an extension that comes and goes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::{FirmwareVersion, TimeLimits, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;

use super::controller::{handler_at, is_on, txt, Controller, DUTY};
use super::row::{By, Outcome, Row, Seen, Skipped, Turn, DEADLINE};
use super::system::only_unix;
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "Load and change";

/// How often a transfer is begun and ended.
const TRANSFERS: usize = 10_000;

/// How many programs do this at the same time.
const PROGRAMS: usize = 16;

pub(crate) fn rows() -> Vec<Row> {
    vec![
        Row::new(SECTION, "an extension comes and goes", "with four busy threads")
            .sees("nothing: `io_slave_alive` changes with it, and its outputs arrive", "–")
            .test(|| Ok(extension())),
        Row::new(SECTION, "the controller is restarted", "with other firmware")
            .sees("`ConnectionClosed`, then the new version", "immediately")
            .by(&[By::Board])
            .test(|| Ok(restart())),
        Row::new(SECTION, "16 busy threads", "during 200 exchanges")
            .sees("nothing", "–")
            .turn(Turn::Alone)
            .test(|| Ok(busy())),
        Row::new(SECTION, "FIN", "with 16 busy threads")
            .sees("`ConnectionClosed`", "when a processor is free")
            .by(&[By::Board])
            .turn(Turn::Alone)
            .test(|| Ok(fin_beside_busy_threads())),
        Row::new(SECTION, "10 000 transfers", "begun and ended")
            .sees("nothing: no thread and no descriptor is left over", "–")
            .by(&[By::Exchange])
            .turn(Turn::Alone)
            .test(many_transfers),
    ]
}

/// Threads that are always busy.
struct Busy {
    stopping: Arc<AtomicBool>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Busy {
    fn start(count: usize) -> Self {
        let stopping = Arc::new(AtomicBool::new(false));
        let spin = |_| {
            let stopping = Arc::clone(&stopping);
            thread::spawn(move || while !stopping.load(Ordering::Relaxed) {})
        };
        let threads = (0..count).map(spin).collect();
        Self { stopping, threads }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.stopping.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|thread| thread.join().unwrap());
    }
}

/// A program with a motor on. Its limit is long enough for a busy machine.
fn start(controller: &Controller, port: u16, areas: usize) -> TransferAreaComHandler {
    let limits = TimeLimits::default().read(DEADLINE);
    let builder = handler_at(port).areas(areas).time_limits(limits);
    let handler = builder.build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    handler
}

/// The motor is still on. Ends the transfer.
pub(crate) fn goes_on(controller: &Controller, handler: TransferAreaComHandler) -> Outcome {
    assert!(controller.txt.with_machine(|machine| is_on(machine)));
    let seen = handler.end_transfer().err().map_or(Seen::Nothing, Seen::Error);
    Outcome { seen, soon: None, by: By::GoesOn, stopped: None }
}

fn extension() -> Outcome {
    let controller = Controller::start(txt().extensions(1));
    let handler = start(&controller, controller.port(), 2);
    handler.areas().lock()[REMOTE_IO_1].output.duty[2] = DUTY;
    let _busy = Busy::start(4);
    for round in 0..20 {
        let alive = round % 2 != 0;
        controller.txt.with_machine(|machine| machine.alive[0] = alive);
        let follows = handler
            .areas()
            .wait_until(|areas| (areas[LOCAL_IO].state.io_slave_alive[0] != 0) == alive, DEADLINE);
        drop(follows.unwrap());
        let duty = if alive { DUTY } else { 0 };
        controller
            .wait("the extension's duty", |machine| machine.controllers[1].outputs.duty[2] == duty);
    }
    goes_on(&controller, handler)
}

fn restart() -> Outcome {
    let (old, new) = (FirmwareVersion::new(4, 1, 6), FirmwareVersion::new(4, 7, 0));
    let controller = Controller::start(txt().firmware(old));
    let strike = Strike { place: Place::Exchange, in_request: false, fault: Fault::Fin };
    let proxy = Proxy::start(controller.port(), [strike]);
    let handler = start(&controller, proxy.port(), 1);
    assert_eq!(handler.version(), Some(old));
    let error = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    let soon = proxy.struck().elapsed();
    let (by, stopped) = controller.stopped_after(proxy.struck());
    drop(controller);
    assert!(handler.begin_transfer().is_err(), "there is no controller");
    let controller = Controller::start(txt().firmware(new));
    proxy.lead_to(controller.port());
    assert_eq!(handler.begin_transfer(), Ok(()));
    assert_eq!(handler.version(), Some(new));
    for _ in 0..5 {
        drop(handler.areas().wait_cycle().unwrap());
    }
    assert!(!controller.txt.with_machine(|machine| is_on(machine)), "the motor is on again");
    assert_eq!(handler.end_transfer(), Ok(()));
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

fn busy() -> Outcome {
    let controller = Controller::start(txt());
    let handler = start(&controller, controller.port(), 1);
    let _busy = Busy::start(16);
    for _ in 0..200 {
        drop(handler.areas().wait_cycle().unwrap());
    }
    goes_on(&controller, handler)
}

fn fin_beside_busy_threads() -> Outcome {
    let controller = Controller::start(txt());
    let strike = Strike { place: Place::Exchange, in_request: false, fault: Fault::Fin };
    let proxy = Proxy::start(controller.port(), [strike]);
    let _busy = Busy::start(16);
    let handler = start(&controller, proxy.port(), 1);
    let error = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    let soon = proxy.struck().elapsed();
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped }
}

fn many_transfers() -> Result<Outcome, Skipped> {
    only_unix("list of a program's threads and files")?;
    let before = left_open();
    thread::scope(|scope| {
        for _ in 0..PROGRAMS {
            scope.spawn(|| {
                let txt = SimulatedTxt::builder().pace(Duration::ZERO).start().unwrap();
                let builder = TransferAreaComHandler::builder(txt.address());
                let handler = builder.build().unwrap();
                for _ in 0..TRANSFERS / PROGRAMS {
                    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
                    handler.begin_transfer().unwrap();
                    drop(handler.areas().wait_cycle().unwrap());
                    handler.end_transfer().unwrap();
                }
                assert!(!txt.with_machine(|machine| is_on(machine)));
            });
        }
    });
    // The system removes a thread from its list shortly after it was joined.
    let begin = Instant::now();
    while left_open().iter().zip(&before).any(|(after, before)| after > before) {
        assert!(begin.elapsed() < DEADLINE, "{before:?} before, {:?} after", left_open());
        thread::sleep(Duration::from_millis(1));
    }
    Ok(Outcome { seen: Seen::Nothing, soon: None, by: By::Exchange, stopped: None })
}

/// How many threads and files this process has, if the system reports it.
fn left_open() -> [usize; 2] {
    ["task", "fd"].map(|what| {
        std::fs::read_dir(format!("/proc/self/{what}")).map_or(0, |entries| entries.count())
    })
}
