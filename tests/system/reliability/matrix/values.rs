//! A program leaves with a value beside its handler whose other side stands still. The value is dropped first.

use std::any::Any;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{mpsc, Arc};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{CameraOptions, Error, EventKind, TransferAreaComHandler};
use ft_transfer_area_recorder::{History, Options, Recorder};

use super::controller::{txt, Controller, DUTY};
use super::fake::Fake;
use super::panics::ON_PURPOSE;
use super::row::{By, Outcome, Row, Seen, Skipped, DEADLINE};
use crate::still::Recording;

const SECTION: &str = "Values beside a handler";

/// How a program leaves.
#[derive(Clone, Copy)]
enum Leave {
    Panics,
    Returns,
    Ends,
}

/// Makes the value, or says why this system can't.
type Make = fn(&TransferAreaComHandler) -> Result<Box<dyn Any>, Skipped>;

pub(crate) fn rows() -> Vec<Row> {
    let values: [(&str, Make); 7] = [
        ("with a recorder whose file takes nothing", recorder),
        ("with a recorder that has what came before, whose file takes nothing", with_history),
        ("with events that nobody reads", |handler| {
            Ok(Box::new(handler.areas().events(EventKind::ALL, 1).unwrap()))
        }),
        ("with a log of cycles that nobody reads", |handler| {
            Ok(Box::new(handler.areas().cycle_log(1).unwrap()))
        }),
        ("with pictures that nobody reads", |handler| {
            Ok(Box::new(handler.start_camera(CameraOptions::default()).unwrap()))
        }),
        ("with an I2C client whose device is silent", i2c),
        ("with a hook whose values take 1 s to be dropped", hook),
    ];
    let leaves = [
        ("a panic", Leave::Panics, "`ProgramPanicked`"),
        ("an early return by `?`", Leave::Returns, "`NotStarted`"),
        ("`end_transfer`", Leave::Ends, "`NotStarted`"),
    ];
    let mut rows = Vec::new();
    for (fault, leave, sees) in leaves {
        for (place, make) in values {
            rows.push(
                Row::new(SECTION, fault, place)
                    .sees(sees, "two exchanges")
                    .by(&[By::Exchange])
                    .test(move || run(make, leave)),
            );
        }
    }
    rows
}

fn run(make: Make, leave: Leave) -> Result<Outcome, Skipped> {
    let fake = Fake::start(|client| client.hold());
    let controller = Controller::start(txt());
    let builder = controller.handler();
    let handler = builder.i2c_port(fake.port()).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler.begin_transfer().unwrap();
    controller.wait_on();
    let area = handler.areas().clone();
    let (leaving, leaves) = mpsc::channel();
    let program = thread::spawn(move || -> Result<(), Error> {
        let handler = handler;
        // Dropped before the handler.
        let _value = match make(&handler) {
            Ok(value) => value,
            Err(skipped) => return leaving.send(Err(skipped)).map_err(|_| Error::NotStarted),
        };
        let _ = leaving.send(Ok(Instant::now()));
        match leave {
            Leave::Panics => panic!("{ON_PURPOSE}"),
            Leave::Returns => Err(Error::AreaCount { given: 0 })?,
            Leave::Ends => handler.end_transfer()?,
        }
        Ok(())
    });
    let struck = leaves.recv_timeout(DEADLINE).unwrap()?;
    let error = loop {
        if let Err(error) = area.wait_cycle() {
            break error;
        }
    };
    let soon = struck.elapsed();
    let (by, stopped) = controller.stopped_after(struck);
    // What is dropped has a limit, too.
    while !program.is_finished() {
        assert!(struck.elapsed() < DEADLINE, "the program does not end");
        thread::sleep(Duration::from_millis(5));
    }
    Ok(Outcome { seen: Seen::Error(error), soon: Some(soon), by, stopped })
}

fn recorder(handler: &TransferAreaComHandler) -> Result<Box<dyn Any>, Skipped> {
    boxed(Recording::still(handler))
}

fn with_history(handler: &TransferAreaComHandler) -> Result<Box<dyn Any>, Skipped> {
    let mut history = History::of(handler, Duration::from_secs(60), 1 << 20).unwrap();
    for _ in 0..2 {
        drop(handler.areas().wait_cycle().unwrap());
    }
    history.take_in();
    let follow = history.follow();
    boxed(Recording::into_full_pipe(|path| {
        Recorder::follow(path, follow, Options::default()).unwrap()
    }))
}

fn boxed(still: Option<Recording>) -> Result<Box<dyn Any>, Skipped> {
    Ok(Box::new(still.ok_or_else(|| Skipped("files can't stand still here".to_owned()))?))
}

/// A client, and a thread with another one whose request is not answered.
fn i2c(handler: &TransferAreaComHandler) -> Result<Box<dyn Any>, Skipped> {
    let mut theirs = handler.i2c().unwrap();
    thread::spawn(move || theirs.read(0x18, 0, &mut [0]));
    Ok(Box::new(handler.i2c().unwrap()))
}

/// What the hook has is dropped by its own thread, when the handler is dropped.
fn hook(handler: &TransferAreaComHandler) -> Result<Box<dyn Any>, Skipped> {
    struct Slow;
    impl Drop for Slow {
        fn drop(&mut self) {
            thread::sleep(Duration::from_secs(1));
        }
    }
    let called = Arc::new(AtomicBool::new(false));
    let slow = (Slow, Arc::clone(&called));
    handler
        .set_cycle_hook(move |_| {
            slow.1.store(true, Ordering::Relaxed);
            ControlFlow::Continue(())
        })
        .unwrap();
    Ok(Box::new(called))
}
