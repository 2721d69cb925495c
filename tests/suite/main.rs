//! The tests that use the crate from outside, in one program so that they link once.

mod bad_input;
mod between_transfers;
mod by_hand;
mod camera;
mod camera_bad_input;
mod client;
mod codec;
mod configuration;
mod events;
mod hook;
mod i2c;
mod lifecycle;
mod locked_twice;
mod motors_off;
mod one_lock_one_exchange;
mod pictures;
mod reaction;
mod reconnect;
mod recorded_sessions;
mod support;
mod tx;
mod vectors;
mod waiting;
mod watchdog;
