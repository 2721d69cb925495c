//! Ends of all kinds, and connections that are lost.

use std::process::Command;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use ft_transfer_area::{CameraOptions, Error, TransferAreaComHandler};
use ft_transfer_area_simulator::world::World;

use super::{check, wait_until, Check, ADDRESS};
use crate::controller::Controller;
use crate::examples::run::Run;

/// Longer than the program is away when it has ended.
const LIMIT: Duration = Duration::from_secs(20);

pub(super) fn checks() -> Vec<(String, Check)> {
    vec![
        check("50 starts in a row", starts),
        check("connection that is reset, made again", reset),
        check("connection whose cable is pulled out, made again", pulled),
        check("connection to a program that is killed, made again", killed),
    ]
}

type End = fn(&Controller);

/// Ways to end a session, each after some exchanges.
const ENDS: [(&str, End); 7] = [
    ("end_transfer", |_| {
        let handler = handler();
        handler.begin_transfer().unwrap();
        handler.end_transfer().unwrap();
    }),
    ("a dropped handler", |_| drop(online())),
    ("a panic under a guard", |_| {
        let handler = Arc::new(online());
        let panicking = Arc::clone(&handler);
        let thread = thread::spawn(move || {
            let _guard = panicking.areas().lock();
            std::panic::resume_unwind(Box::new("as a program's mistake"));
        });
        thread.join().unwrap_err();
        while handler.areas().wait_cycle().is_ok() {}
    }),
    ("I2C", |_| {
        let handler = online();
        let mut id = [0];
        handler.i2c().unwrap().read(0x18, 0, &mut id).unwrap();
        assert_eq!(id, [0xFA]);
        handler.end_transfer().unwrap();
    }),
    ("the camera", |_| {
        let handler = online();
        let frames = handler.start_camera(CameraOptions::default()).unwrap();
        frames.recv_timeout(LIMIT).unwrap();
        handler.end_transfer().unwrap();
    }),
    ("Ctrl-C", |controller| {
        let program = running(controller, "motor_on_off_switch");
        program.interrupt();
        program.finish();
    }),
    ("kill", |controller| drop(running(controller, "motor_on_off_switch"))),
];

fn handler() -> TransferAreaComHandler {
    TransferAreaComHandler::builder(ADDRESS).build().unwrap()
}

/// A handler that has exchanged.
fn online() -> TransferAreaComHandler {
    let handler = handler();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    handler
}

/// A sample that has exchanged.
fn running(controller: &Controller, name: &str) -> Run {
    let before = controller.board.state().frames;
    let program = Run::start(name, &[ADDRESS]);
    wait_until("the program exchanges", || controller.board.state().frames > before + 5);
    program
}

fn starts(controller: &Controller) {
    controller.plug_in(World::default());
    let before = controller.ends().len();
    let in_a_row = each_after_each(ENDS.len());
    assert_eq!(in_a_row.len(), 50);
    for (start, index) in in_a_row.into_iter().enumerate() {
        let (name, end) = ENDS[index];
        end(controller);
        let ends = &controller.ends()[before..];
        assert!(ends.is_empty(), "start {start}, which ended by {name}: {}", ends.join(", "));
    }
}

/// Numbers in an order in which each comes once right after each, also after itself.
fn each_after_each(count: usize) -> Vec<usize> {
    let first = |number: usize| (number + 1..count).flat_map(move |other| [number, other]);
    let numbers = (0..count).flat_map(|number| std::iter::once(number).chain(first(number)));
    numbers.chain([0]).collect()
}

fn reset(controller: &Controller) {
    goes_on(controller, || {
        system("ss", &["-K", "dport", "=", "65000", "or", "dport", "=", "65002"])
    });
}

fn pulled(controller: &Controller) {
    goes_on(controller, || {
        system("ip", &["link", "set", "lo", "down"]);
        thread::spawn(|| {
            thread::sleep(LIMIT / 4);
            system("ip", &["link", "set", "lo", "up"]);
        });
    });
}

fn killed(controller: &Controller) {
    goes_on(controller, || controller.kill());
}

/// Runs a program of the system; the network is our own.
fn system(program: &str, arguments: &[&str]) {
    let output = Command::new(program).args(arguments).output().unwrap();
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A handler learns that its connection is lost, once, and exchanges again.
fn goes_on(controller: &Controller, lose: impl FnOnce()) {
    controller.plug_in(World::default());
    let handler = TransferAreaComHandler::builder(ADDRESS).reconnect(LIMIT).build().unwrap();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    lose();
    let lost = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    assert!(matches!(lost, Error::ConnectionLost { .. }), "{lost}");
    for _ in 0..100 {
        drop(handler.areas().wait_cycle().unwrap());
    }
    assert_eq!(handler.areas().statistics().gaps, 1);
    handler.end_transfer().unwrap();
}
