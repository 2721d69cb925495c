//! `txt bridge` with simulated TXTs: with a real Mosquitto where it is installed, and without.

mod alone;
mod commands;
mod faults;
mod support;
mod terminal;
mod values;

pub(crate) use support::mosquitto;
