//! The simulated TXT over a real socket, with packets made by hand.

mod bad_input;
mod camera;
mod camera_client;
mod camera_endings;
mod endings;
mod exchange;
mod faults;
mod i2c;
mod microphone;
mod motor_control;
mod oddities;
mod refusal;
mod shipped_worlds;
mod wire_client;
mod world;

use std::time::Duration;

use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};

/// A simulated TXT that answers at once and closes no connection for being idle, which could
/// pass for another end of it. Its step is 10 ms.
fn unpaced() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().pace(Duration::ZERO).idle_limit(Duration::from_secs(3600))
}
