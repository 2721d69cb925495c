//! The simulated TXT over real sockets, with packets made by hand.

mod areas;
mod bad_input;
mod by_clock;
mod camera;
mod camera_client;
mod camera_endings;
mod endings;
mod exchange;
mod factory;
mod faults;
mod i2c;
mod idle;
mod lock_step;
mod logger;
mod microphone;
mod motor_control;
mod oddities;
mod program;
mod refusal;
mod shipped_worlds;
mod stepped;
mod synchronised;
mod typed_lines;
mod wire_client;
mod workpieces;
mod world;

use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use ft_transfer_area_simulator::{SimulatedTxt, SimulatedTxtBuilder};

use wire_client::LIMIT;

/// A simulated TXT that answers immediately. It closes no idle connection, because a test could take
/// that for another kind of end. Its step is 10 ms.
fn unpaced() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().pace(Duration::ZERO).idle_limit(Duration::from_secs(3600))
}

/// Checks that the end of this waits for nothing that does not return.
#[track_caller]
fn drops_in_time(value: impl Send + 'static) {
    let (sender, dropped) = mpsc::channel();
    thread::spawn(move || {
        drop(value);
        sender.send(())
    });
    assert_eq!(dropped.recv_timeout(LIMIT), Ok(()), "the drop waits");
}
