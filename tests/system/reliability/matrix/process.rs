//! What the operating system does to the program's process.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use super::child::Child;
use super::controller::{is_on, txt, Controller, IDLE_LIMIT};
use super::row::{By, Outcome, Row, Seen, Skipped, DEADLINE, MARGIN};
use super::system::{only_unix, signal, Signal};
use crate::proxy::fault::{Fault, Strike};
use crate::proxy::packets::Place;
use crate::proxy::Proxy;

const SECTION: &str = "The process";

pub(crate) fn rows() -> Vec<Row> {
    let killed = |fault, signal| {
        Row::new(SECTION, fault, "during the exchanges")
            .sees("nothing: the process has ended", "–")
            .by(&[By::Board])
            .test(move || killed_by(signal))
    };
    vec![
        killed("killed (SIGKILL)", Signal::SIGKILL),
        killed("terminated (SIGTERM)", Signal::SIGTERM),
        killed("interrupted (SIGINT)", Signal::SIGINT),
        killed("aborted (SIGABRT)", Signal::SIGABRT),
        Row::new(SECTION, "stopped (SIGSTOP) and continued", "for 0.3 s")
            .sees("nothing", "–")
            .test(stopped_for_a_moment),
        Row::new(
            SECTION,
            "stopped (SIGSTOP) and continued",
            "for longer than the idle limit (1 s)",
        )
        .sees("`ConnectionClosed` or `NoAnswer`", "when it continues")
        .by(&[By::Board])
        .test(stopped_for_long),
        Row::new(SECTION, "a handled signal every 100 ms, and silence", "`begin_transfer`")
            .sees("`NoAnswer`", "the read limit (1 s)")
            .by(&[By::NeverOn])
            .test(|| signalled(Place::QueryStatus)),
        Row::new(SECTION, "a handled signal every 100 ms, and silence", "during the exchanges")
            .sees("`NoAnswer`", "the read limit (1 s) and 0.5 s")
            .by(&[By::Board])
            .test(|| signalled(Place::Exchange)),
        Row::new(SECTION, "no descriptor left", "`begin_transfer`")
            .sees("`ConnectFailed`", "immediately")
            .by(&[By::NeverOn])
            .test(|| cannot_begin("no-descriptor")),
        Row::new(SECTION, "no descriptor left", "`start_camera`, `i2c` during the exchanges")
            .sees("`ConnectFailed`", "the start limit")
            .test(|| in_transfer("no-descriptor-in-transfer", ["ConnectFailed", "ConnectFailed"])),
        Row::new(SECTION, "no thread left", "`begin_transfer`")
            .sees("`ThreadNotStarted`", "the end of the handshake")
            .by(&[By::NeverOn])
            .test(|| cannot_begin("no-thread")),
        Row::new(SECTION, "no thread left", "`start_camera` during the exchanges")
            .sees("`ThreadNotStarted`", "immediately")
            .test(|| in_transfer("no-thread-in-transfer", ["ThreadNotStarted", "Ok"])),
    ]
}

/// A child process with a motor on.
fn start(controller: &Controller) -> Child {
    let mut child = Child::start(&format!("program 127.0.0.1 {} 20000", controller.port()));
    child.hear("begun");
    controller.wait_on();
    child
}

fn send(child: &Child, what: Signal) {
    signal(child.process.id(), what);
}

fn killed_by(signal: Signal) -> Result<Outcome, Skipped> {
    if signal != Signal::SIGKILL {
        only_unix("signals")?;
    }
    let controller = Controller::start(txt());
    let struck = kill(&controller, signal);
    // Wine's server names such sockets when it ends. One that does so once does it for each further program.
    if cfg!(windows) && !controller.txt.wait_until(|machine| !machine.online(), DEADLINE) {
        return Err(Skipped("Wine keeps the socket of a program that was killed".to_owned()));
    }
    let (by, stopped) = controller.stopped_after(struck);
    Ok(Outcome { seen: Seen::Nothing, soon: None, by, stopped })
}

/// Ends a program that drives, and returns when.
fn kill(controller: &Controller, by: Signal) -> Instant {
    let mut child = start(controller);
    let struck = Instant::now();
    match by {
        // Other systems can do this, too.
        Signal::SIGKILL => child.process.kill().unwrap(),
        signal => send(&child, signal),
    }
    let status = child.process.wait().unwrap();
    assert!(!status.success(), "{status}");
    struck
}

fn stopped_for_a_moment() -> Result<Outcome, Skipped> {
    only_unix("signals")?;
    let controller = Controller::start(txt());
    let mut child = start(&controller);
    send(&child, Signal::SIGSTOP);
    thread::sleep(Duration::from_millis(300));
    let goes_on = controller.txt.with_machine(|machine| is_on(machine));
    send(&child, Signal::SIGCONT);
    let exchanges = controller.txt.with_machine(|machine| machine.exchanges());
    controller.wait("more exchanges", |machine| machine.exchanges() > exchanges + 10);
    drop(child.stdin.take());
    let (ended, _) = child.hear("ended");
    let seen = if ended == "Ok" { Seen::Nothing } else { Seen::Named(ended) };
    let by = if goes_on { By::GoesOn } else { By::Board };
    Ok(Outcome { seen, soon: None, by, stopped: None })
}

fn stopped_for_long() -> Result<Outcome, Skipped> {
    only_unix("signals")?;
    let controller = Controller::with_idle_limit(txt(), IDLE_LIMIT);
    let mut child = start(&controller);
    let struck = Instant::now();
    send(&child, Signal::SIGSTOP);
    controller.wait("the end of online mode", |machine| !machine.online());
    let (by, stopped) = controller.stopped_after(struck);
    let continued = SystemTime::now();
    send(&child, Signal::SIGCONT);
    let (name, when) = child.hear("ended");
    let soon = when.duration_since(continued).unwrap_or_default();
    Ok(Outcome { seen: Seen::Named(name), soon: Some(soon), by, stopped })
}

/// The controller becomes silent, and signals come again and again.
fn signalled(place: Place) -> Result<Outcome, Skipped> {
    only_unix("signals")?;
    let controller = Controller::with_idle_limit(txt(), IDLE_LIMIT);
    let strike = Strike { place, in_request: false, fault: Fault::Cut };
    let proxy = Proxy::start(controller.port(), [strike]);
    let mut child = Child::start(&format!("signalled {}", proxy.port()));
    child.hear("begins");
    let (sender, ended) = mpsc::channel();
    let id = child.process.id();
    let hearing = thread::spawn(move || sender.send(child.hear("ended")));
    let begin = Instant::now();
    let (name, _) = loop {
        match ended.recv_timeout(Duration::from_millis(100)) {
            Ok(ended) => break ended,
            Err(_) => assert!(begin.elapsed() < 2 * MARGIN, "the limit is not kept"),
        }
        signal(id, Signal::SIGINT);
    };
    let soon = proxy.struck().elapsed();
    hearing.join().unwrap().unwrap();
    let (by, stopped) = controller.stopped_after(proxy.struck());
    Ok(Outcome { seen: Seen::Named(name), soon: Some(soon), by, stopped })
}

fn cannot_begin(role: &str) -> Result<Outcome, Skipped> {
    only_unix("limits that a process sets for itself")?;
    let controller = Controller::start(txt());
    let mut child = Child::start(&format!("{role} {}", controller.port()));
    let (_, begins) = child.hear("begins");
    let (name, begun) = child.hear("begun");
    let soon = begun.duration_since(begins).unwrap_or_default();
    let (by, stopped) = controller.stopped_after(Instant::now());
    Ok(Outcome { seen: Seen::Named(name), soon: Some(soon), by, stopped })
}

/// The camera and I2C fail like this, and the transfer goes on.
fn in_transfer(role: &str, [camera, i2c]: [&str; 2]) -> Result<Outcome, Skipped> {
    only_unix("limits that a process sets for itself")?;
    let controller = Controller::start(txt());
    let mut child = Child::start(&format!("{role} {}", controller.port()));
    let (_, begun) = child.hear("begun");
    let (name, failed) = child.hear("camera");
    assert_eq!(name, camera);
    assert_eq!(child.hear("i2c").0, i2c);
    assert_eq!(child.hear("goes-on").0, "Ok");
    assert_eq!(child.hear("ended").0, "Ok");
    let soon = failed.duration_since(begun).unwrap_or_default();
    Ok(Outcome { seen: Seen::Named(name), soon: Some(soon), by: By::GoesOn, stopped: None })
}
