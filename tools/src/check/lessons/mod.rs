//! What the program of each lesson has to do, and a sentence for each way to miss it.

pub(super) mod blink;
pub(super) mod counter;
pub(super) mod distance;
pub(super) mod end_switch;
pub(super) mod gate;
pub(super) mod lamp;
pub(super) mod motor;
pub(super) mod sorting;
pub(super) mod thermostat;
pub(super) mod traffic_light;

use std::time::Duration;

/// Long enough to see that nothing happens.
const A_WHILE: Duration = Duration::from_millis(700);
