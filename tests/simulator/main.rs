//! The simulated TXT over a real socket, with packets made by hand.

mod endings;
mod exchange;
mod faults;
mod wire_client;

use std::time::Duration;

use ft_transfer_area::simulator::{SimulatedTxt, SimulatedTxtBuilder};

/// A simulated TXT that answers at once. Its step is 10 ms.
fn unpaced() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().pace(Duration::ZERO)
}
